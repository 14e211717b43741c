# SPDX-License-Identifier: Apache-2.0
"""Every figure of docs/performance.md, measured anew: plain numbers that can be compared exactly."""

from __future__ import annotations

import fnmatch
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.bench import disassembly, image, sizes, stack
from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.bench.drive import Stage, build_drive, build_task, measure_drive, measure_task
from fluxtrue_tools.bench.laws import measure_laws
from fluxtrue_tools.emulate import build as emulation
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet import bound as wcet
from fluxtrue_tools.wcet import facts, observed, worst

BUDGET = ROOT / "hal" / "s32k144" / "budget.toml"
MODES = {"paper": 0, "robust": 1}
INTERRUPTS = {"fast ISR": image.FAST, "MRAI ISR": image.MRAI, "CAN ISR": image.CAN, "1 kHz task": image.TASK,
              "gate fault ISR": image.GATE}  # fmt: skip
PWM_HZ = 10_000
TASK_PERIODS = 10
COMMAND_HZ = 100
FIGURES = dict[str, Any]


def budget() -> dict[str, Any]:
    """The limits and lists in the budget.toml of the port."""
    with BUDGET.open("rb") as file:
        return tomllib.load(file)


def _spread(values: NDArray[np.int64], also: NDArray[np.int64]) -> list[float]:
    """Minimum, mean to a tenth, maximum; the maximum also of further values."""
    return [int(values.min()), round(float(values.mean()), 1), int(max(values.max(), also.max(initial=0)))]


def _work(spans: NDArray[np.int64]) -> NDArray[np.int64]:
    """Instructions and cycles of the interrupts of each period: the fast ISR and, where the identification has one, the
    MRAI ISR that it pends."""
    ours = spans[np.isin(spans[:, 0], (image.FAST, image.MRAI))]
    begins = np.flatnonzero(ours[:, 0] == image.FAST)
    both: NDArray[np.int64] = np.add.reduceat(ours[begins[0] :, 1:], begins - begins[0])
    return both


COLUMNS = ("instructions", "cycles", "least", "most")  # of a recording; the last two with the memories


def _row(runs: NDArray[np.int64], reactions: NDArray[np.int64]) -> FIGURES:
    spreads = {name: _spread(runs[:, k], reactions[:, k]) for k, name in enumerate(COLUMNS)}
    at_most = {"driving": int(runs[:, 1].max()), "reacting": int(reactions[:, 1].max(initial=0))}
    return {"runs": len(runs), **spreads, "cycles_at_most": at_most}


def _mode(
    parts: emulation.Parts, functions: list[disassembly.Function], mode: int, watch: image.Watch
) -> tuple[FIGURES, int]:
    recording = image.record(parts, functions, mode, watch)
    rows: FIGURES = {}
    for name, vector in INTERRUPTS.items():
        runs, reactions = recording.of(vector), recording.reactions_of(vector)
        if len(runs) == 0 and (name, mode) == ("MRAI ISR", MODES["robust"]):
            continue  # what this identification does in every period is part of the fast ISR
        if len(runs) == 0 and len(reactions) == 0:
            raise FluxtrueError(f"the {name} never ran")
        rows[name] = _row(runs if len(runs) > 0 else reactions, reactions)
    rows["10 kHz work"] = _row(_work(recording.spans), _work(recording.reacting))
    met = {"periods": recording.periods, "voltage limited": recording.limited, "beyond the tables": recording.clamped,
           "field weakening": recording.weakened, "reacting": len(recording.reactions_of(image.FAST))}  # fmt: skip
    return {"met": met, "runs": rows}, recording.stack_bytes


def pointers(port: dict[str, Any], names: list[str]) -> dict[str, list[str]]:
    """Patterns of the port's list against the image's names."""
    plain = sorted({disassembly.plain(name) for name in names})
    found: dict[str, list[str]] = {}
    for entry in port["pointer"]:
        for pattern in entry["calls"]:
            # A target that was compiled into its caller is not among the names, and there is no call of it.
            found.setdefault(entry["in"], []).extend(fnmatch.filter(plain, pattern))
    return found


def stack_use(functions: list[disassembly.Function], port: dict[str, Any]) -> tuple[list[stack.Use], list[str]]:
    """Worst case of each priority, and the reasons why it may be too small."""
    nodes = stack.graph(functions)
    depths = stack.Depths(nodes, pointers(port, list(nodes)))
    uses = stack.levels(depths, [stack.Level(x["name"], tuple(x["handlers"])) for x in port["level"]])
    sites = {entry["in"]: entry["sites"] for entry in port["pointer"]}
    for node in nodes.values():
        found, listed = len(node.indirect), sites.get(disassembly.plain(node.name))
        if listed is not None and found > listed:
            depths.problems.append(f"{node.name}: {found} calls through pointers, {listed} are listed")
    return uses, sorted(set(depths.problems)) + stack.heap(nodes)


def _utilisation(runs: FIGURES, core_hz: int, column: str) -> FIGURES:
    """Shares of the processor, estimated, and the PWM frequency at which all of it takes half.

    The task is counted with 1000 steps per second, whatever that frequency.
    """
    work = runs["10 kHz work"][column]
    task, can = runs["1 kHz task"][column][1] / TASK_PERIODS, runs["CAN ISR"][column][1] * COMMAND_HZ
    return {
        "10 kHz work, average": round(100 * work[1] * PWM_HZ / core_hz, 2),
        "10 kHz work, maximum": round(100 * work[2] * PWM_HZ / core_hz, 2),
        "with task and CAN, average": round(100 * ((work[1] + task) * PWM_HZ + can) / core_hz, 2),
        "highest PWM frequency at 50 %": int((0.5 * core_hz - can - task * PWM_HZ) / work[1] // 100 * 100),
    }


def _spreads(stages: list[Stage]) -> dict[str, list[float]]:
    return {s.name: [s.minimum, round(s.average, 1), s.maximum] for s in stages}


def _worst(found: worst.Worst, watch: observed.Watch, drives: FIGURES) -> FIGURES:
    """The bounds of the handlers, none of which the emulated drive exceeds."""
    wrong = found.mismatches(watch)
    for drive in drives.values():
        wrong += worst.exceeded(found.figures[worst.OF_DRIVE], drive["runs"])
    if wrong:
        raise FluxtrueError("the bounds of the execution times are wrong:\n  " + "\n  ".join(wrong))
    entered, loops = observed.entered(found.image, found.reached, watch)
    return {"bounds": found.figures, "loops": loops, "loops entered": entered}


def _bounds(parts: emulation.Parts, functions: list[disassembly.Function], port: FIGURES) -> worst.Worst:
    """Upper bounds of the handlers of an image."""
    names = [function.name for function in functions]
    return worst.bounds(wcet.Image.read(parts.image), facts.load(), pointers(port, names))


def _sensor(angle: str, modes: dict[str, int], port: FIGURES) -> FIGURES:
    """The interrupts of the image for another angle sensor in the drive of the encoder's image, their bounds, and their
    shares of the processor with the robust identification."""
    parts = emulation.prepare("hsm1", angle=angle, flashed=True)
    functions = disassembly.read(parts.image)
    bounds = _bounds(parts, functions, port)
    watch = observed.Watch(bounds.plan())
    drives = {name: _mode(parts, functions, mode, watch)[0] for name, mode in modes.items()}
    runs = {name: drive["runs"] for name, drive in drives.items()}
    shares = {column: _utilisation(runs["robust"], port["core_Hz"], column) for column in COLUMNS[1:]}
    found = _worst(bounds, watch, drives)["bounds"][worst.OF_DRIVE]
    return {"runs": runs, "utilisation": shares, "bounds": {name: found[name] for name in ("fast ISR", "1 kHz task")}}


def _sensors(port: FIGURES) -> FIGURES:
    """The sensors but the encoder: the resolver, whose image is the one that has bounds, in both identifications."""
    robust = {"robust": MODES["robust"]}
    return {angle: _sensor(angle, MODES if angle == "resolver" else robust, port)
            for angle in emulation.FLASHED if angle != "encoder"}  # fmt: skip


def measure(folder: Path) -> FIGURES:
    """Build what is missing below `folder` and measure all figures; this takes some minutes."""
    port = budget()
    parts = emulation.prepare("hsm1", flashed=True)
    functions = disassembly.read(parts.image)
    uses, problems = stack_use(functions, port)
    if problems:
        raise FluxtrueError("the image's stack is not bounded:\n  " + "\n  ".join(problems))
    bounds = _bounds(parts, functions, port)
    watch = observed.Watch(bounds.plan())
    drives: FIGURES = {}
    deepest = 0
    for name, mode in MODES.items():
        drives[name], used = _mode(parts, functions, mode, watch)
        deepest = max(deepest, used)
    total = sum(u.frame + u.stack for u in uses)
    if deepest > total:
        raise FluxtrueError(f"the emulated drive used {deepest} bytes of stack, more than the worst case of {total}")
    whole = sizes.whole(parts.image)
    program = build_drive(folder / "bench")
    stages, counted, limited = measure_drive(program)
    return {
        "compiler": sizes.compiler(),
        "drives": drives,
        "sensors": _sensors(port),
        "worst case": _worst(bounds, watch, drives),
        "utilisation": {name: {column: _utilisation(drive["runs"], port["core_Hz"], column) for column in COLUMNS[1:]}
                        for name, drive in drives.items()},
        "kernels": {
            "periods": counted, "limited": limited,
            "stages": _spreads(stages),
            "laws": measure_laws(program),
            "task stages": _spreads(measure_task(build_task(folder / "bench"))),
        },
        "image": {"flash": whole.size.flash, "RAM": whole.size.ram, "code in RAM": whole.size.ram_code,
                  "stack reserved": whole.stack},
        "modules": {name: list(both) for name, both in sizes.modules(parts.image).items()},
        "control library": sizes.library(parts.image.parent),
        "state": sizes.state(parts.image),
        "stack": {
            "levels": [{"level": u.name, "frame": u.frame, "stack": u.stack,
                        "path": [disassembly.plain(f) for f in u.path if not f.endswith(disassembly.VENEER)]}
                       for u in uses],
            "total": total, "seen in emulation": deepest,
        },
    }  # fmt: skip
