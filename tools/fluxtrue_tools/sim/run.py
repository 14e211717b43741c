# SPDX-License-Identifier: Apache-2.0
"""From a scenario to a recording: chunks between breakpoints, linear ramps inside them."""

import difflib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.scenario import Points, Scenario

RPM: Final = 2.0 * math.pi / 60.0
CHUNK_S: Final = 0.1

CHANNELS: Final = (
    "truth.time_s",
    "torque_command_Nm",
    "truth.torque_shaft_mean_Nm",
    "torque_estimate_Nm",
    "truth.speed_rpm",
    "speed_rpm",
    "truth.i_d_A",
    "truth.i_q_A",
    "id_A",
    "iq_A",
    "id_ref_A",
    "iq_ref_A",
    "truth.u_d_V",
    "truth.u_q_V",
    "ud_V",
    "uq_V",
    "truth.vdc_V",
    "vdc_V",
    "truth.psi_f_Vs",
    "psi_f_Vs",
    "psi_quality",
    "truth.r_ohm",
    "r_ohm",
    "r_quality",
    "torque_correction",
    "voltage_limited",
    "fault_word",
    "run_state",
)
"""What is recorded; a truth column is a mean over its row, the rest the value at its end."""

LEARNT: Final = ("drop_V", "lq_scale", "ld_scale", "angle_error_rad", "iron_scale", "local_flux_Vs",
                 "torque_confidence", "contradiction", "parameter_clamped")  # fmt: skip
"""What the firmware's robust identification knows besides; the twin and another mode have no more than defaults."""


def column_name(channel: str) -> str:
    """Name of a column: the plant's truth is marked as such."""
    named = {"truth.time_s": "time_s", "truth.torque_shaft_mean_Nm": "true_torque_Nm"}
    return named.get(channel, channel.replace("truth.", "true_").replace("_mean_", "_"))


@dataclass
class Recording:
    """Columns over time."""

    scenario: Scenario
    motor: Motor
    columns: list[str]
    rows: NDArray[np.float64]
    wall_s: float = 0.0
    _index: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._index = {name: i for i, name in enumerate(self.columns)}

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        return self.rows[:, self._index[column]]

    def window(self, first: float, last: float) -> NDArray[np.bool_]:
        """Rows that lie wholly in a time window."""
        every = self.scenario.record_every_s
        now = self["time_s"]
        return np.asarray((now > first + 0.5 * every) & (now < last + 0.5 * every))

    def mean(self, column: str, span: tuple[float, float] | None = None) -> float:
        """Mean over a time window; left out: the scenario's."""
        return float(self[column][self.window(*(span or self.scenario.averaged()))].mean())

    def error_percent(self, column: str, truth: str) -> float | None:
        """Mean of a column against the mean of its truth; None when that is nothing."""
        true = self.mean(truth)
        return None if true == 0.0 else 100.0 * (self.mean(column) / true - 1.0)

    @property
    def torque_error_percent(self) -> float | None:
        """Mean shaft torque against the command."""
        return self.error_percent("true_torque_Nm", "torque_command_Nm")

    @property
    def fault_word(self) -> int:
        """Every fault bit that was ever set."""
        return int(np.bitwise_or.reduce(self["fault_word"].astype(np.int64)))


def _plant(scenario: Scenario, motor: Motor) -> dict[str, float]:
    """Every plant parameter: the motor's data, then what the scenario says."""
    profile, mechanics = scenario.profile, scenario.mechanics
    plant = motor.plant | scenario.plant.values()
    inertia = mechanics.inertia_kgm2 or motor.inertia_kgm2
    plant |= {
        "seed": float(scenario.seed),
        "imposed_speed": float(mechanics.mode == "imposed"),
        "speed_rad_s": profile.speed_rpm[0][1] * RPM,
        "inertia_kgm2": inertia,
        "viscous_Nms": mechanics.viscous_Nms,
        "winding_C": profile.winding_C[0][1],
        "magnet_scale": profile.magnet_scale[0][1],
        "load_Nm": profile.load_Nm[0][1],
    }
    if profile.vdc_V is not None:
        plant["vdc_V"] = profile.vdc_V[0][1]
    return plant


def _ramped(scenario: Scenario) -> dict[str, tuple[Points, float]]:
    """Simulation name: (points, factor) of every profile that moves."""
    profile = scenario.profile
    named: dict[str, tuple[Points | None, float]] = {
        "torque_command_Nm": (profile.torque_Nm, 1.0),
        "plant.speed_rad_s": (profile.speed_rpm, RPM),
        "plant.vdc_V": (profile.vdc_V, 1.0),
        "plant.winding_C": (profile.winding_C, 1.0),
        "plant.magnet_scale": (profile.magnet_scale, 1.0),
        "plant.load_Nm": (profile.load_Nm, 1.0),
    }
    return {n: (p, f) for n, (p, f) in named.items() if p is not None and len(p) > 1}


def value_at(points: Points, now: float, after: bool) -> float:
    """A profile's value; at a step, the one before or the one after it."""
    times = [t for t, _ in points]
    if now < times[0] or (now == times[0] and not after):
        return points[0][1]
    for (t0, v0), (t1, v1) in zip(points, points[1:], strict=False):
        if t0 == t1:
            continue
        if (t0 < now < t1) or (now == t0 and after) or (now == t1 and not after):
            return v0 + (v1 - v0) * (now - t0) / (t1 - t0)
    return points[-1][1]


def _breakpoints(scenario: Scenario) -> list[float]:
    end = scenario.duration_s
    times = {0.0, end} | {event.t for event in scenario.event}
    for points, _ in _ramped(scenario).values():
        times |= {t for t, _ in points}
    times |= {CHUNK_S * k for k in range(1, math.ceil(end / CHUNK_S))}
    return sorted(t for t in times if t <= end)


def _refused(error: lib.LoopError, motor: Motor, where: str) -> FluxtrueError:
    """The library's answer in terms of the scenario."""
    allowed = ""
    if error.code == lib.UNKNOWN_NAME:
        names = motor.names()
        near = difflib.get_close_matches(error.name, names, n=3) or names
        allowed = f", allowed: {', '.join(near)}"
    return FluxtrueError(f"{where}: {error}{allowed}")


def _start(scenario: Scenario, motor: Motor, where: str) -> lib.Loop:
    try:
        loop = lib.Loop(motor.library, _plant(scenario, motor), motor.flux_map, scenario.controller.kind)
        for name, value in scenario.controller.values().items():
            loop.set(name, value)
        loop.set("torque_command_Nm", scenario.profile.torque_Nm[0][1])
        for event in scenario.event:
            for name in event.set:
                if math.isnan(loop.get(name)):
                    raise lib.LoopError(name, None, lib.UNKNOWN_NAME)
    except lib.LoopError as error:
        raise _refused(error, motor, where) from error
    return loop


def _check_rows(scenario: Scenario, period_s: float, where: str) -> int:
    """PWM periods per row; the window must have a row to average."""
    wanted, (first, last) = scenario.record_every_s, scenario.averaged()
    every = max(1, round(min(wanted, 2.0 * scenario.duration_s) / period_s))
    row_s = every * period_s
    rows = min(round(scenario.duration_s / period_s) // every, math.ceil((last + 0.5 * wanted) / row_s) - 1)
    if rows < 1 or rows * row_s <= first + 0.5 * wanted:
        raise FluxtrueError(
            f"{where}: record_every_s = {wanted:g}: no row in the window {first:g} to {last:g} s (PWM period "
            f"{period_s:g} s), allowed: one row at least"
        )
    return every


def _check_speed(scenario: Scenario, motor: Motor, period_s: float, where: str) -> None:
    """Beyond half an electrical turn per period a sampled angle says nothing of the speed."""
    limit = 60.0 / (2.0 * period_s * motor.plant["pole_pairs"])
    for _, speed in scenario.profile.speed_rpm:
        if abs(speed) > limit:
            raise FluxtrueError(
                f"{where}: profile.speed_rpm = {speed:g}, allowed: up to {limit:g} (half an electrical turn per period)"
            )


def _check_finite(columns: list[str], rows: NDArray[np.float64], where: str) -> None:
    bad = np.argwhere(~np.isfinite(rows))
    if bad.size:
        row, column = bad[0]
        raise FluxtrueError(
            f"{where}: the simulation left the range of numbers ({columns[column]} = {rows[row, column]:g} in row "
            f"{row + 1}): a value in [plant], [profile], [mechanics] or an event is absurd"
        )


def simulate(
    scenario: Scenario,
    motor: Motor,
    *,
    where: str = "scenario",
    channels: Sequence[str] | None = None,
    progress: Callable[[float], Any] | None = None,
) -> Recording:
    """Run a scenario. `progress` is told the simulated seconds of every chunk."""
    loop = _start(scenario, motor, where)
    if channels is None:
        channels = (*CHANNELS, *LEARNT) if scenario.controller.kind == "firmware" else CHANNELS
    begin = time.perf_counter()
    with loop:
        _check_speed(scenario, motor, loop.period_s, where)
        loop.record(channels, _check_rows(scenario, loop.period_s, where))
        try:
            rows = _run(scenario, loop, progress)
        except lib.LoopError as error:
            raise _refused(error, motor, where) from error
        except FluxtrueError as error:
            raise FluxtrueError(f"{where}: {error}") from error
    wall = time.perf_counter() - begin
    columns = [column_name(c) for c in channels]
    _check_finite(columns, rows, where)
    return Recording(scenario, motor, columns, rows, wall)


def _run(
    scenario: Scenario, loop: lib.Loop, progress: Callable[[float], Any] | None
) -> NDArray[np.float64]:
    ramped = _ramped(scenario)
    events = sorted(scenario.event, key=lambda event: event.t)
    times = _breakpoints(scenario)
    rows = []
    for start, stop in zip(times, times[1:], strict=False):
        while events and events[0].t <= start:
            for name, value in events.pop(0).set.items():
                loop.set(name, value)
        ramps = {
            name: (factor * value_at(points, start, True), factor * value_at(points, stop, False))
            for name, (points, factor) in ramped.items()
        }
        periods = round(stop / loop.period_s) - round(start / loop.period_s)
        rows.append(loop.run(periods, ramps))
        if progress is not None:
            progress(stop - start)
    return np.concatenate(rows)
