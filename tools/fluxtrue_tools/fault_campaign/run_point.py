# SPDX-License-Identifier: Apache-2.0
"""One fault at one operating point: the drive is started, brought there, the fault is injected, and all is recorded."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign.fmea import Point, Row, Step
from fluxtrue_tools.fault_campaign.spec import Faults
from fluxtrue_tools.sim.ecu_loop import WRONG, Change, EcuLoop
from fluxtrue_tools.sim.motor import Motor

Array = NDArray[np.float64]
LoopOf = Callable[[Motor, Mapping[str, float]], EcuLoop]
"""Makes the loop of a motor and a plant."""
BEFORE_MS: Final = 20
RPM: Final = math.pi / 30.0  # rad/s
START_SPEED: Final = 0.8  # of the largest
SLEW_RPM_PER_MS: Final = 20.0
REQUEST: Final = "bus.command.TorqueRequested"
REQUEST_LATER: Final = "request"  # in a line's setup: what is requested until the injection
CHANNELS: Final = ("truth.torque_shaft_mean_Nm", "truth.i_d_A", "truth.i_q_A", "truth.vdc_V", "fault_word",
                   "truth.theta_m_rad")  # fmt: skip
# As in the shipped scenarios: 0.5 A of noise, 12-bit angle. The firmware always gets whole codes of the converters.
SENSORS: Final = {"current_noise_A_rms": 0.5, "angle_bits": 12.0}


@dataclass(frozen=True)
class Imposed:
    """A state of the bridge that begins so long after the injection, whatever the firmware wants."""

    bridge: int
    at_ms: float


@dataclass
class Trace:
    """What happened, a row per PWM period; time 0 is the injection."""

    period_s: float
    rows: Array
    requested_Nm: tuple[float, float]  # before and at the end
    ecu: list[tuple[float, int, int]]  # ms, faults of the state machine, state; once per ms

    def __getitem__(self, name: str) -> Array:
        return self.rows[:, CHANNELS.index(name)]

    @property
    def time_ms(self) -> Array:
        """The times at the end of each period."""
        first = round(BEFORE_MS * 1e-3 / self.period_s)
        return (np.arange(len(self.rows)) - first + 1) * self.period_s * 1e3


class _Drive:
    """The loop and the names a table may set."""

    def __init__(self, loop: EcuLoop, point: Point) -> None:
        self.loop, self.point = loop, point

    def get(self, name: str) -> float:
        kind, _, rest = name.partition(".")
        if kind == "memory":
            return self.loop.read(rest)
        if name.startswith("bus.command.") and rest.removeprefix("command.") in self.loop.sender.command.values:
            value = self.loop.sender.command.values[rest.removeprefix("command.")]
            return math.nan if isinstance(value, str) else value
        if name.startswith("bus.limits."):
            return self.loop.sender.limits.get(rest.removeprefix("limits."), 0.0)
        if kind == "bus" and rest in WRONG:
            return self.loop.sender.wrong.get(rest, 0.0)
        value = self.loop.get(name)
        if math.isnan(value):
            raise FluxtrueError(f"{name}: no such name")
        return value

    def set(self, name: str, value: float) -> None:
        kind, _, rest = name.partition(".")
        if kind == "memory":
            self.loop.write(rest, value)
        elif name.startswith("bus.command."):
            self.loop.sender.command.values[rest.removeprefix("command.")] = value
        elif name.startswith("bus.limits."):
            self.loop.sender.limits[rest.removeprefix("limits.")] = value
        elif kind == "bus":
            self.loop.sender.wrong[rest] = value
        else:
            self.loop.set(name, value)

    def apply(self, step: Step) -> None:
        present = self.get(step.name) if step.how else 0.0
        self.set(step.name, step.applied(present, self.point.torque_Nm))

    def ramps(self, step: Step, now_ms: int, starts: dict[Step, float]) -> dict[str, tuple[float, float]]:
        """The part of a straight line that lies in this millisecond."""
        start = starts.setdefault(step, self.get(step.name))
        stop, length = step.applied(start, self.point.torque_Nm), step.until_ms - step.at_ms
        at = [start + (stop - start) * (now_ms + k - step.at_ms) / length for k in (0, 1)]
        return {step.name: (at[0], at[1])}


def check_names(motor: Motor, rows: Iterable[Row], loop_of: LoopOf = EcuLoop) -> None:
    """Refuse a name that is not there, before the first run."""
    point = Point(0, 1.0, motor.name, 0.0, 0.0, 0.0, 0.0)
    with loop_of(motor, {}) as loop:
        drive = _Drive(loop, point)
        for row in rows:
            for step in (*row.setup, *row.injection):
                try:
                    if step.name != REQUEST_LATER:
                        drive.get(step.name)
                except FluxtrueError as error:
                    raise FluxtrueError(f"line {row.id}: {error}") from error


def _slow(motor: Motor, rpm: float) -> float:
    """Where the drive is started: enable is refused where the magnets already charge the dc link through the diodes."""
    return math.copysign(min(abs(rpm), START_SPEED * motor.speed_max_rpm), rpm)


def _accelerate(loop: EcuLoop, from_rpm: float, to_rpm: float) -> None:
    """The rest of the way, in state run without torque."""
    count = math.ceil(abs(to_rpm - from_rpm) / SLEW_RPM_PER_MS)
    for k in range(count):
        at = [(from_rpm + (to_rpm - from_rpm) * j / count) * RPM for j in (k, k + 1)]
        loop.step_ms({"plant.speed_rad_s": (at[0], at[1])})


def _start(campaign: Faults, motor: Motor, row: Row, point: Point, loop_of: LoopOf) -> _Drive:
    given = {step.name.removeprefix("plant."): step for step in row.setup if step.name.startswith("plant.")}
    speed = _slow(motor, point.speed_rpm) * RPM
    plant: dict[str, Any] = {**SENSORS, **campaign.plant, "speed_rad_s": speed, "vdc_start_V": motor.plant["vdc_V"],
                             "seed": float(campaign.seed + 1000 * point.index)}  # fmt: skip
    base = motor.plant | plant
    for name, step in given.items():
        plant[name] = step.applied(base.get(name, 1.0 if name.endswith(("gain_a", "gain_b", "gain_c")) else 0.0), 0.0)
    drive = _Drive(loop_of(motor, plant), point)
    for step in row.setup:
        if step.name != REQUEST_LATER and not step.name.startswith("plant."):
            drive.apply(step)
    return drive


def _change(loop: EcuLoop, now_ms: int, imposed: Imposed | None) -> Change | None:
    """What is imposed in this millisecond."""
    if imposed is None:
        return None
    after = round(imposed.at_ms * 1e-3 / loop.period_s) - now_ms * loop.periods_per_ms
    return Change(after, "plant.imposed_bridge", imposed.bridge) if 0 <= after < loop.periods_per_ms else None


def _watch(drive: _Drive, row: Row, watch_ms: int,
           imposed: Imposed | None) -> tuple[list[Array], list[tuple[float, int, int]]]:  # fmt: skip
    """Run from the injection on, millisecond by millisecond."""
    starts: dict[Step, float] = {}
    rows, ecu = [], []
    for now in range(watch_ms):
        ramps: dict[str, tuple[float, float]] = {}
        for step in row.injection:
            if step.until_ms > step.at_ms and step.at_ms <= now < step.until_ms:
                ramps |= drive.ramps(step, now, starts)
            elif step.at_ms == now and step.until_ms == step.at_ms:
                drive.apply(step)
        loop = drive.loop
        rows.append(loop.step_ms(ramps, _change(loop, now, imposed)))
        ecu.append((now + 1.0, int(loop.read("ecu.supervisor.faults")), loop.state))
    return rows, ecu


def run_point(campaign: Faults, motor: Motor, row: Row, point: Point, imposed: Imposed | None = None,
              loop_of: LoopOf = EcuLoop) -> Trace:  # fmt: skip
    """The same numbers wherever and whenever it runs, with `imposed` up to its beginning."""
    drive = _start(campaign, motor, row, point, loop_of)
    loop = drive.loop
    with loop:
        waits = next((step.applied(0.0, point.torque_Nm) for step in row.setup if step.name == REQUEST_LATER), None)
        loop.power_up()
        _accelerate(loop, _slow(motor, point.speed_rpm), point.speed_rpm)
        loop.steps(campaign.settle_ms, TorqueRequested=point.torque_Nm if waits is None else waits)
        requested = drive.get(REQUEST)
        loop.record(CHANNELS)
        before = [loop.step_ms() for _ in range(BEFORE_MS)]
        after, ecu = _watch(drive, row, row.watch_ms or campaign.watch_ms, imposed)
        return Trace(loop.period_s, np.concatenate(before + after), (requested, drive.get(REQUEST)), ecu)
