# SPDX-License-Identifier: Apache-2.0
"""An activity interrupted by the fast ISR at each of its instructions: tests/target/emulator/preempt.h."""

import ctypes
from dataclasses import dataclass
from typing import Final

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop

MRAI: Final = 16 + 69
TASK: Final = 16 + 48


class _Report(ctypes.Structure):
    _fields_ = (
        ("instructions", ctypes.c_int),
        ("points", ctypes.c_int),
        ("mixed", ctypes.c_int),
        ("outcomes", ctypes.c_int),
        ("choices", ctypes.c_int),
        ("first", ctypes.c_char * 160),
    )


@dataclass(frozen=True)
class Report:
    """Boundaries tried, and outcomes that mix old with new."""

    instructions: int
    points: int
    mixed: int
    outcomes: int
    choices: int
    first: str


def interrupt_everywhere(loop: Loop, victim: int, rounds: int = 1) -> Report:
    """From the victim's next run on; the simulation is left as it was."""
    library = loop._library
    library.preempt_run.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.POINTER(_Report)]
    report = _Report()
    code = library.preempt_run(loop._sim, victim, rounds, ctypes.byref(report))
    text = report.first.decode(errors="replace")
    if code != 0:
        raise FluxtrueError(f"interrupting vector {victim}: {text}")
    return Report(report.instructions, report.points, report.mixed, report.outcomes, report.choices, text)
