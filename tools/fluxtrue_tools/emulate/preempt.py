# SPDX-License-Identifier: Apache-2.0
"""An activity interrupted at each of its instructions.

By the fast ISR, with the host's answer for comparison: tests/target/emulator/preempt.h. By any other interrupt, with
the image's own: every variable in its memory must be as if the interrupt had come just before the activity, or just
after. Padding is left out: a structure copied from the stack takes over what the interrupt has left there.
"""

import ctypes
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from fluxtrue_tools.emulate.core import BREAK, Core
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop

FAST: Final = 16 + 39
TASK: Final = 16 + 48
MRAI: Final = 16 + 69
CAN: Final = 16 + 81
GATE: Final = 16 + 103
RAM_END: Final = 0x20007000
SLICE_S: Final = 1e-4
SLICES: Final = 25
# The registers that determine what the bridge does.
BRIDGE: Final = (*(f"FTM0.C{n}V" for n in range(6)), "FTM0.SWOCTRL", "FTM0.OUTMASK", "FTM0.SYNC")


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
    """Number of instruction boundaries tried, and the outcomes that mix old and new data."""

    instructions: int
    points: int
    mixed: int
    outcomes: int
    choices: int
    first: str


def interrupt_everywhere(loop: Loop, victim: int, rounds: int = 1) -> Report:
    """Interrupt the activity's next run at each instruction; afterwards the simulation is in its former state."""
    library = loop._library
    library.preempt_run.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.POINTER(_Report)]
    report = _Report()
    code = library.preempt_run(loop._sim, victim, rounds, ctypes.byref(report))
    text = report.first.decode(errors="replace")
    if code != 0:
        raise FluxtrueError(f"interrupting vector {victim}: {text}")
    return Report(report.instructions, report.points, report.mixed, report.outcomes, report.choices, text)


@dataclass(frozen=True)
class Sides:
    """Number of boundaries tried, and whether the outcome was that of an interrupt before or after the activity."""

    instructions: int
    before: int
    after: int
    mixed: tuple[int, ...]  # instruction counts with neither of the two outcomes
    same: bool  # both outcomes are the same
    snapshot_before: int  # snapshots of the two outcomes, from which the run can continue
    snapshot_after: int


class Stepper:
    """Runs a core from one exception's entry or return to another's."""

    def __init__(self, core: Core) -> None:
        self.core = core
        self._until: set[tuple[int, bool]] = set()
        core.on_exception(self._on_exception)

    def _on_exception(self, vector: int, entered: bool) -> None:
        if (vector, entered) in self._until:
            self._until.discard((vector, entered))
            if not self._until:
                self.core.break_after(0)

    def run(self, *until: tuple[int, bool]) -> None:
        """Until each of them has happened."""
        self._until = set(until)
        self.stop()
        if self._until:
            raise FluxtrueError(f"(vector, entered) {sorted(self._until)} never happened")

    def stop(self) -> None:
        for _ in range(SLICES):
            if self.core.run(SLICE_S) == BREAK:
                return


@contextmanager
def interrupt_from_both_sides(
    core: Core, victim: int, by: int, raise_it: Callable[[], None], padding: Collection[int]
) -> Iterator[Sides]:
    """From the victim's next run on. `raise_it` makes the interrupt `by` pending. The core is left as it was.

    padding: addresses that are not compared (fluxtrue_tools.emulate.padding).

    The rotor must stand: what the image takes away for the time since its angle was sampled depends on the delay.
    """
    snapshots = [core.save()]
    try:
        sides = _both_sides(core, victim, by, raise_it, padding)
        snapshots += [sides.snapshot_before, sides.snapshot_after]
        yield sides
    finally:
        core.on_exception(lambda _vector, _entered: None)
        core.restore(snapshots[0])
        for snapshot in snapshots:
            core.free(snapshot)


def _both_sides(core: Core, victim: int, by: int, raise_it: Callable[[], None], padding: Collection[int]) -> Sides:
    stepper = Stepper(core)
    stepper.run((victim, True))
    for pdb in ("PDB0.SC", "PDB1.SC"):
        core.set_register(pdb, 0)  # no conversions: no other period begins
    start = core.save()
    bottom = core.symbol("stack_top")
    left_out = [address - bottom for address in padding if bottom <= address < RAM_END]

    def found() -> tuple[bytes, tuple[int, ...]]:
        content = bytearray(core.read(bottom, RAM_END - bottom))
        for offset in left_out:
            content[offset] = 0
        return bytes(content), tuple(core.register(name) for name in BRIDGE)

    begun = core.instructions
    stepper.run((victim, False))
    length = core.instructions - begun
    raise_it()
    stepper.run((by, False))
    late, after = found(), core.save()
    core.restore(start)
    raise_it()
    stepper.run((by, False), (victim, False))
    early, before = found(), core.save()
    sides: list[int] = []
    mixed: list[int] = []
    for n in range(length):
        core.restore(start)
        core.break_after(n)
        stepper.stop()
        if core.active_vector != victim:
            raise FluxtrueError(f"vector {victim} was over before {n} instructions")
        raise_it()
        stepper.run((by, False), (victim, False))
        outcome = found()
        if outcome in (early, late):
            sides.append(0 if outcome == early else 1)
        else:
            mixed.append(n)
    core.free(start)
    return Sides(length, sides.count(0), sides.count(1), tuple(mixed), early == late, before, after)
