# SPDX-License-Identifier: Apache-2.0
"""Cost and accuracy of the building blocks, measured on an emulated Cortex-M4.

A benchmark reports and asserts nothing: the bounds are held by tests/target. To measure another
function, build an ELF that contains it (build.build_target), put its arguments into memory
(Machine.place) and count a call (Machine.count); Case and measure() do that for whole lists.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from fluxtrue_tools.bench.build import FX_SOURCES, SMALL, build_target
from fluxtrue_tools.bench.drive import Stage, build_drive, build_task, measure_drive, measure_task
from fluxtrue_tools.bench.fx_cases import Case, cases
from fluxtrue_tools.bench.machine import Machine
from fluxtrue_tools.bench.peers import LOOPS, PEERS

COMPILED = f"Compiled as the image is: files of firmware/fast_sources.txt -O2, all others {SMALL[0]}"

__all__ = ["Case", "Machine", "Result", "call_overhead", "measure", "run", "table"]


@dataclass(frozen=True)
class Result:
    """Instructions issued by one function over its cases, without the return to the caller."""

    name: str
    title: str
    group: str
    calls: int
    minimum: int
    average: float
    maximum: int
    error: float | None
    unit: str


def call_overhead(machine: Machine) -> int:
    """Instructions that a function without a body issues: its return."""
    return machine.count("bench_nothing", 0)[1]


def measure(machine: Machine, what: Iterable[Case], overhead: int) -> list[Result]:
    """Call every case's function with all of its rows."""
    results = []
    for case in what:
        calls = [machine.count(f"bench_{case.name}", *map(int, row)) for row in case.rows]
        issued = np.array([number for _, number in calls]) - overhead
        error = None
        if case.error is not None:
            values = np.array([value for value, _ in calls], dtype=np.uint64).astype(np.int64)
            error = float(case.error(case.rows, values).max())
        results.append(
            Result(
                case.name,
                case.title,
                case.group,
                len(calls),
                int(issued.min()),
                float(issued.mean()),
                int(issued.max()),
                error,
                case.unit,
            )
        )
    return results


def _error(error: float | None, unit: str) -> str:
    return "" if error is None else f"{error:.2g} {unit}"


def table(results: Iterable[Result], overhead: int) -> str:
    """The figures as text, peers below the function they compare with."""
    peers = list(PEERS)
    lines = [
        "Instructions issued on an emulated Cortex-M4 (simulation; instructions are not cycles).",
        f"{COMPILED}, each file by itself; what is inline, as in what calls it: -O2.",
        f"Not counted: {overhead} for the return; counted: registers saved by the called function.",
        "",
        f"{'function':<42}{'min':>5}{'avg':>8}{'max':>5}  largest error",
    ]
    ours = list(results)
    for place, result in enumerate(ours):
        lines.append(
            f"{result.title:<42}{result.minimum:>5}{result.average:>8.1f}{result.maximum:>5}"
            f"  {_error(result.error, result.unit)}".rstrip()
        )
        if any(later.group == result.group for later in ours[place + 1 :]):
            continue
        for peer in (peer for peer in peers if peer.function == result.group):
            label = f"  {peer.name}, {peer.source}"
            lines.append(f"{label:<50}{peer.instructions:>5}       {_error(peer.error, peer.unit)}".rstrip())
    return "\n".join(lines)


def drive_table(stages: Iterable[Stage], counted: int, limited: int) -> str:
    """The drive's stages as text, other projects' ticks below."""
    lines = [
        "",
        f"The drive, hsm1, {counted} periods in closed loop with its own map (torque steps at 3000 rpm, then",
        f"a run-up into the voltage limit: {limited} periods limited).",
        f"{COMPILED}, -flto.",
        "Hardware access is a few variables. Stages as calls, the interrupts as they are; a period's own stages are",
        "inlined, those of the 1 kHz task are not.",
        "",
        f"{'stage':<42}{'min':>5}{'avg':>8}{'max':>5}",
    ]
    lines += [f"{s.title:<42}{s.minimum:>5}{s.average:>8.1f}{s.maximum:>5}" for s in stages]
    lines += ["", "Control ticks of other projects, to be compared with the first line:"]
    lines += [f"  {peer.source + ', ' + peer.content:<70}{peer.average:>5}{peer.maximum:>5}" for peer in LOOPS]
    return "\n".join(lines)


def run(build_dir: Path) -> str:
    """Build for the target, measure, print the table; the same as JSON."""
    machine = Machine(build_target(build_dir / "bench" / "fx.elf", FX_SOURCES))
    overhead = call_overhead(machine)
    results = measure(machine, cases(), overhead)
    print(table(results, overhead))
    stages, counted, limited = measure_drive(build_drive(build_dir / "bench"))
    stages += measure_task(build_task(build_dir / "bench"))
    print(drive_table(stages, counted, limited))
    data = {"call_overhead": overhead, "functions": [asdict(result) for result in results],
            "drive": {"periods": counted, "limited": limited, "stages": [asdict(s) for s in stages]}}  # fmt: skip
    return json.dumps(data, indent=2) + "\n"
