# SPDX-License-Identifier: Apache-2.0
"""The steps of a commissioning in their order: what each does to the machine, and what it finds."""

import contextlib
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Protocol

from tqdm import tqdm

from fluxtrue_tools.commission import (
    balance,
    bus_turning,
    connection,
    dc_zero,
    drag,
    levels,
    plan,
    spin,
    surface,
    turning,
)
from fluxtrue_tools.commission.balance import Balance
from fluxtrue_tools.commission.bursts import Raw, offset
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.connection import Followed
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.drag import Drag
from fluxtrue_tools.commission.drive import Capture, nothing
from fluxtrue_tools.commission.levels import Resistance
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.shown import Losses
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.surface import Surface
from fluxtrue_tools.errors import FluxtrueError

SETTLE_S = 0.05
ANGLE_RAD = 0.03  # electrical: of the angle that `phases` finds, and of a sensor with harmonics


@dataclass
class Found:
    """What the steps have found so far."""

    offset_A: complex = 0.0  # of the current sensors, stationary frame
    offset_sigma_A: float = 0.0  # of each component, by the noise
    followed: Followed | None = None
    spun: Spun | None = None
    drag: Drag | None = None
    resistance: Resistance | None = None
    first: plan.First | None = None
    levels: list[Raw] = field(default_factory=list)
    bursts: list[Raw] = field(default_factory=list)
    balance: Balance | None = None
    surface: Surface | None = None
    dc_zero: DcZero = field(default_factory=DcZero)

    def known(self, known: Nameplate) -> Nameplate:
        """The nameplate with what has been measured in its place."""
        known = replace(known, offset_A=self.offset_A)
        if self.followed is not None:
            known = replace(known, pole_pairs=self.followed.connection.pole_pairs)
        if self.spun is not None:
            known = replace(known, psi_f_Vs=self.spun.psi_f_Vs)
        return known

    @property
    def largest_A(self) -> float:
        """The largest current of all bursts."""
        return max((float(abs(raw.i).max()) for raw in self.bursts), default=0.0)

    @property
    def moved_rad(self) -> float:
        """The electrical angle by which the rotor moved in a burst."""
        return max((raw.moved_rad for raw in self.bursts), default=0.0)


@dataclass(frozen=True)
class Step:
    """One step with its announcement."""

    name: str
    does: str
    run: Callable[[Capture, Found, Nameplate], None]
    seconds: float  # about as long does the drive run, in software in the loop
    bus_seconds: float = 0.0  # the same over CAN; 0: as many times longer as the drive says


Earlier = tuple[tuple[str, ...], Found]  # finished steps, and what they have found


class Kept(Protocol):
    """Where finished steps are kept: work.py."""

    def save(self, steps: tuple[str, ...], found: Found) -> None: ...


def _enable(drive: Capture) -> None:
    drive.set("torque_requested_Nm", 0.0)
    drive.set("enable", 1.0)
    drive.rest(SETTLE_S)
    if drive.get("run_state") != 1.0:
        raise FluxtrueError(f"commission: switching cannot be enabled (fault word 0x{int(drive.get('fault_word')):x})")


def _disable(drive: Capture) -> None:
    drive.set("enable", 0.0)
    drive.rest(SETTLE_S)


def _offsets(drive: Capture, found: Found, known: Nameplate) -> None:
    _disable(drive)
    found.offset_A, found.offset_sigma_A = offset(drive)
    found.dc_zero = dc_zero.measure(drive, known)


def _phases(drive: Capture, found: Found, known: Nameplate) -> None:
    if isinstance(drive, OverTheBus):
        found.followed = connection.measure(drive, known, bus_turning.rotate)
    else:
        found.followed = connection.measure(drive, known, connection.rotate)
    turning.connect(drive, found.followed.connection, known, connection.NAME)
    turning.release(drive)


def _spin(drive: Capture, found: Found, known: Nameplate) -> None:
    assert found.followed is not None
    if isinstance(drive, OverTheBus):
        found.spun = spin.measure(drive, known, found.followed.connection, bus_turning.direction)
    else:
        found.spun = spin.measure(drive, known, found.followed.connection, spin.direction)
    turning.connect(drive, found.spun.connection, known, spin.NAME)
    turning.release(drive)


def _drag(drive: Capture, found: Found, known: Nameplate) -> None:
    assert found.spun is not None
    if isinstance(drive, OverTheBus):
        found.drag = drag.measure(drive, known, found.spun, bus_turning.runs)
    else:
        found.drag = drag.measure(drive, known, found.spun, drag.runs)
    if found.spun.harmonics is not None:
        with_it = found.spun.harmonics.with_inertia(found.drag.inertia_kgm2)
        found.spun = replace(found.spun, harmonics=with_it)


def _losses(found: Found, known: Nameplate) -> Losses:
    if found.resistance is None:
        return Losses(known.r_ohm, known.level_V)
    return Losses(found.resistance.r_ohm, found.resistance.level_V)


def _resistance(drive: Capture, found: Found, known: Nameplate) -> None:
    _enable(drive)
    found.first = plan.first(drive, known, _losses(found, known))
    found.levels = levels.measure(drive, known, found.first)
    found.balance = balance.measure(found.levels)
    alike = [found.balance.corrected(raw) for raw in found.levels]
    angle_rad = ANGLE_RAD if found.spun is None else 0.0
    found.resistance = levels.solve(
        alike, known.psi_f_Vs, drive.get("compensation_V"), found.balance.noise_A, angle_rad
    )
    legs = plan.Legs(found.resistance.total_V, found.resistance.knee_A, found.resistance.compensated_V,
                     drive.get("compensation_knee_A"))  # fmt: skip
    found.first = plan.first(drive, known, _losses(found, known), legs)


def _map(drive: Capture, found: Found, known: Nameplate) -> None:
    assert found.resistance is not None and found.first is not None
    _enable(drive)
    losses = Losses(found.resistance.r_ohm, found.resistance.total_V)
    compensated = drive.get("dead_time_compensation")
    drive.set("dead_time_compensation", 0.0)  # by the sign of currents with an offset: it can be computed better later
    try:
        found.bursts = plan.sweep(drive, found.first, known, losses)
    finally:
        drive.set("dead_time_compensation", compensated)
    used = [raw for raw in found.bursts if raw.is_valid]
    lost = [raw.failure for raw in found.bursts if not raw.is_valid]
    if len(lost) > plan.LOST_MAX:
        raise FluxtrueError(f"commission: map: {len(lost)} of {len(found.bursts)} bursts failed: {lost[0]}")
    found.balance = balance.measure([*found.levels, *used])
    alike = [found.balance.corrected(raw) for raw in used]
    error = surface.MEASURED if found.spun is not None else surface.GIVEN if known.psi_f_source else surface.GUESSED
    found.surface = surface.fit(alike, found.balance.noise_A, known.i_max_A, found.resistance.r_ohm,
                                (known.psi_f_Vs, error), found.resistance.total_V, found.resistance.knee_A)  # fmt: skip


STEPS = (
    Step("offsets", "switching is disabled, nothing moves, no current; the dc link is discharged, charged and "
         "discharged again", _offsets, 1.8, 12.0),
    Step(connection.NAME, "a current of up to {vector:.3g} A that does not turn with the rotor: the shaft turns "
         "slowly, by up to {turns:g} turns divided by the pole pairs, and back", _phases, 10.0, 20.0),
    Step(spin.NAME, "the shaft turns at {speed:.0f} rpm in both directions, for moments somewhat faster, with up to "
         "{torque:.3g} A of current that makes torque; beyond {limit:.0f} rpm switching is disabled", _spin, 20.0,
         165.0),
    Step(drag.NAME, "the shaft is accelerated to {speed:.0f} rpm, or somewhat beyond, runs down and is braked, with up "
         "to {torque:.3g} A; beyond {limit:.0f} rpm switching is disabled", _drag, 10.0, 25.0),
    Step("resistance", "direct currents up to {level:.3g} A along the magnet for {level_s:.1f} s, more where they are "
         "repeated: no torque but by an error of the angle, which turns a light rotor; beyond {angle:.0f} electrical "
         "degrees a current ends", _resistance, 4.0),
    Step("map", "voltage pulses with currents up to {reach:.3g} A; alternating torque: the rotor swings; beyond "
         "{angle:.0f} electrical degrees a burst ends", _map, 4.0),
)  # fmt: skip
NEEDS = {"offsets": ("offsets",), "phases": ("offsets", "phases"), "spin": ("offsets", "phases", "spin"),
         "drag": ("offsets", "phases", "spin", "drag"), "resistance": ("offsets", "resistance"),
         "map": ("offsets", "resistance", "map")}  # fmt: skip
ALL = "all"
TURNING = (connection.NAME, spin.NAME, drag.NAME)  # the steps that turn the shaft


def chosen(names: tuple[str, ...]) -> list[Step]:
    """The named steps with those that they need."""
    names = tuple(NEEDS) if names == (ALL,) else names
    unknown = [name for name in names if name not in NEEDS]
    if unknown:
        raise FluxtrueError(f"--step {unknown[0]!r}: allowed: {ALL}, or {', '.join(NEEDS)}, separated by commas")
    wanted = {needed for name in names for needed in NEEDS[name]}
    return [step for step in STEPS if step.name in wanted]


def announcement(step: Step, known: Nameplate) -> str:
    """What will move and how much current flows."""
    return step.does.format(reach=known.i_max_A, level=levels.LEVELS[-1] * known.i_max_A, level_s=levels.duration_s(),
                            angle=known.swing_deg, vector=connection.SHARES[-1] * known.i_max_A, turns=connection.TURNS,
                            speed=turning.SPEED_SHARE * known.speed_max_rpm,
                            limit=turning.LIMIT_SHARE * known.speed_max_rpm,
                            torque=spin.Q_SHARES[-1] * known.i_max_A)  # fmt: skip


Shown = Callable[[Capture, Step], AbstractContextManager[None]]


@contextlib.contextmanager
def on_terminal(drive: Capture, step: Step) -> Iterator[None]:
    """A bar on a terminal."""
    with tqdm(total=step.seconds, desc=step.name, bar_format="{desc} {percentage:3.0f} %|{bar}|", leave=False,
              disable=not sys.stderr.isatty()) as bar:  # fmt: skip
        drive.passed = lambda seconds: bar.update(min(seconds / drive.slower, bar.total - bar.n))
        try:
            yield
        finally:
            drive.passed = nothing


def _connect(drive: Capture, found: Found, known: Nameplate) -> None:
    """The connection that an earlier run has found."""
    connection = found.spun.connection if found.spun is not None else found.followed and found.followed.connection
    if connection is not None:
        turning.connect(drive, connection, known, "connection")
        turning.release(drive)


def _go(drive: Capture, steps: list[Step], known: Nameplate, say: Callable[[str], None], kept: Kept | None,
        earlier: Earlier, shown: Shown) -> Found:  # fmt: skip
    done, found = earlier
    if done:
        _connect(drive, found, found.known(known))
    for step in steps:
        if step.name in done:
            say(f"{step.name}: kept from an earlier run")
            continue
        say(f"{step.name}: {announcement(step, found.known(known))}")
        drive.dc_zero_V = found.dc_zero.shown_V
        with shown(drive, step):
            step.run(drive, found, found.known(known))
        done = (*done, step.name)
        if kept is not None:
            kept.save(done, found)
    return found


def run(drive: Capture, steps: list[Step], known: Nameplate, say: Callable[[str], None], kept: Kept | None = None,
        earlier: Earlier | None = None, shown: Shown = on_terminal) -> Found:  # fmt: skip
    """All steps; at the end, also after a failure, switching is disabled and the drive's settings are as before.

    kept      where finished steps are kept
    earlier   those of a run before, which are not repeated
    shown     context of each step, which shows how far it is
    """
    earlier = earlier if earlier is not None else ((), Found())
    before = {name: drive.get(name) for name in drive.settings}
    try:
        for name in drive.switched_off:  # the voltages are evaluated without them
            drive.set(name, 0.0)
        return _go(drive, steps, known, say, kept, earlier, shown)
    finally:
        _disable(drive)
        for name, value in before.items():
            drive.set(name, value)
