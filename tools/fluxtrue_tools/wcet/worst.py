# SPDX-License-Identifier: Apache-2.0
"""The bounds of all handlers of an image, in each mode of operation and for each cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet import facts, observed
from fluxtrue_tools.wcet.bound import CYCLES, INSTRUCTIONS, MOST, Cost, Handlers, Image

COSTS = (INSTRUCTIONS, CYCLES, MOST)
OF_DRIVE = "driving"  # the mode of the drive that the bench emulates


@dataclass
class Worst:
    """The image, and for each mode and cost its handlers."""

    image: Image
    handlers: dict[tuple[str, str], Handlers]
    figures: dict[str, dict[str, dict[str, int]]]  # mode, handler, cost

    @property
    def reached(self) -> set[str]:
        return {name for one in self.handlers.values() for name in one.reached}

    def plan(self) -> observed.Plan:
        """For the emulated drive: all functions that a handler reaches in any mode."""
        return observed.plan(self.image, self.reached)

    def mismatches(self, watch: observed.Watch) -> list[str]:
        """What the emulated drive did that the bounds of its mode exclude."""
        return observed.mismatches(self.image, self.handlers[OF_DRIVE, INSTRUCTIONS.name], watch)


def bounds(
    image: Image, data: Mapping[str, Any], pointers: Mapping[str, list[str]], costs: tuple[Cost, ...] = COSTS
) -> Worst:
    """All of it; anything that is not known is an error that names everything missing."""
    found = Worst(image, {}, {})
    image.enter(data["handlers"].values(), pointers)
    problems: set[str] = set()
    modes = facts.modes(data)
    for mode, known in modes.items():
        figures = found.figures[mode] = {title: {} for title in data["handlers"]}
        for cost in costs:
            handlers = found.handlers[mode, cost.name] = Handlers(image, mode, known, pointers, cost)
            for title, name in data["handlers"].items():
                figures[title][cost.name] = handlers.handler(name)
            problems |= handlers.problems
    used = set(data.get("loops_of_other_images", {})).union(*(known.used for known in modes.values()))
    problems |= {f"nothing in the image is described by '{key}'" for known in modes.values()
                 for key in {*known.loops, *known.copies} - used}  # fmt: skip
    if problems:
        raise FluxtrueError("the execution times are not bounded:\n  " + "\n  ".join(sorted(problems)))
    return found


def exceeded(figures: Mapping[str, Mapping[str, int]], runs: Mapping[str, Mapping[str, Iterable[float]]]) -> list[str]:
    """Handlers of which the emulated drive ran more than their bound; `runs`: least, average and most by cost."""
    return [f"{title}: {max(seen[cost.name])} {cost.name} were executed, the bound is {figures[title][cost.name]}"
            for title, seen in runs.items() if title in figures
            for cost in COSTS if max(seen[cost.name]) > figures[title][cost.name]]  # fmt: skip
