# SPDX-License-Identifier: Apache-2.0
"""Every experiment in order."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from fluxtrue_tools.demo import grid, paper, realtime, step
from fluxtrue_tools.demo.experiment import Bench, Bound, Result, number
from fluxtrue_tools.sim.run import Recording

Say = Callable[[str], None]


@dataclass
class Demonstration:
    """What the report and summary.json are made of."""

    results: list[Result] = field(default_factory=list)
    realtime_factor: float = math.nan
    motulator_realtime_factor: float = math.nan
    story: Recording | None = None

    @property
    def realtime(self) -> Bound:
        """The bound of the simulation's speed relative to real time."""
        return Bound("simulated over processor time", self.realtime_factor, realtime.REALTIME_FACTOR, "x", True)

    def missed(self) -> list[str]:
        """One line for each bound that was missed."""
        lines = [f"{r.name}: {b.text()}" for r in self.results for b in r.bounds if not b.met]
        return lines + ([] if self.realtime.met else [f"realtime_factor: {self.realtime.text()}"])

    def summary(self) -> dict[str, Any]:
        """The content of summary.json; a value that could not be measured is null."""
        data = {
            "experiments": [result.summary for result in self.results],
            "realtime_factor": self.realtime_factor,
            "motulator_realtime_factor": self.motulator_realtime_factor,
            "bounds_missed": self.missed(),
        }
        cleaned = _null_for_nan(data)
        assert isinstance(cleaned, dict)
        return cleaned


def _null_for_nan(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _null_for_nan(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_null_for_nan(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def demonstrate(bench: Bench, say: Say, grid_done: Callable[[], None]) -> Demonstration:
    """Run them all; `say` is called with the name of the next one, `grid_done` after each run of the grid."""
    demonstration = Demonstration()
    say("the paper's figures 3 and 4: three sets of adaptation gains")
    demonstration.results += [paper.fig3_4(bench, gains) for gains in paper.GAIN_SETS]
    say("the paper's figures 7 and 8")
    demonstration.results += [paper.fig7(bench), paper.fig8(bench)]
    say(f"the measured machine: {grid.job_count()} runs, firmware and double-precision twin")
    on_grid, twin = grid.grid(bench, grid_done)
    demonstration.story = grid.story(bench)
    say("torque step and current step")
    demonstration.results += [on_grid, step.torque_step(bench), twin]
    say("speed of the simulation, next to motulator's")
    demonstration.realtime_factor = number(realtime.ours(bench), 4)
    demonstration.motulator_realtime_factor = number(realtime.motulator(), 4)
    return demonstration
