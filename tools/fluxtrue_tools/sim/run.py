# SPDX-License-Identifier: Apache-2.0
"""From a scenario to a recording: chunks between breakpoints, linear ramps inside them."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools import faults
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import check, profiles
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.profiles import RPM, value_at
from fluxtrue_tools.sim.scenario import Scenario

CHUNK_S: Final = 0.1

CHANNELS: Final = (
    "truth.time_s",
    "torque_requested_Nm",
    "truth.torque_shaft_mean_Nm",
    "torque_estimated_Nm",
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

IDENTIFIED: Final = ("drop_V", "lq_scale", "ld_scale", "angle_error_rad", "iron_scale", "local_flux_Vs",
                 "torque_confidence", "mismatch_share", "parameter_clamped")  # fmt: skip
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
    processor_s: float = 0.0
    motor_check: int = 0  # why the motor data were refused, as faults.refused_data() tells it
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
        """Mean over a time window, by default the scenario's."""
        return float(self[column][self.window(*(span or self.scenario.averaged()))].mean())

    def error_percent(self, column: str, truth: str) -> float | None:
        """Error of a column's mean relative to the mean of the truth; None if the latter is zero."""
        true = self.mean(truth)
        return None if true == 0.0 else 100.0 * (self.mean(column) / true - 1.0)

    @property
    def torque_error_percent(self) -> float | None:
        """Mean shaft torque against the requested torque."""
        return self.error_percent("true_torque_Nm", "torque_requested_Nm")

    @property
    def request_reverses(self) -> bool:
        """Whether the requested torque has both signs in the window: a share of its mean then says little."""
        requested = self["torque_requested_Nm"][self.window(*self.scenario.averaged())]
        return bool(requested.min() < 0.0 < requested.max())

    @property
    def fault_word(self) -> int:
        """Every fault bit that was ever set."""
        return int(np.bitwise_or.reduce(self["fault_word"].astype(np.int64)))

    def faults(self) -> list[tuple[float, list[str]]]:
        """When the drive tripped, with names: the time of every row that brought new faults."""
        found, known = [], 0
        words = self["fault_word"].astype(np.int64)
        for row in np.flatnonzero(np.diff(words, prepend=0)):
            new = int(words[row]) & ~known
            if new:
                found.append((float(self["time_s"][row]), faults.named(new)))
                known |= new
        return found

    def in_words(self, fault: str) -> str:
        """A fault's name; with the configuration fault also the check that failed."""
        why = faults.refused_data(self.motor_check) if fault == faults.CONFIG else ""
        return f"{fault} ({why})" if why else fault

    def unexpected(self) -> str | None:
        """Complaint about the run's faults: a trip that the scenario does not expect, or a missing one."""
        tripped, wanted = self.faults(), self.scenario.expect_fault
        if not tripped:
            return None if wanted is None else f"expect_fault = {wanted!r}: the drive did not trip"
        if wanted in tripped[0][1]:
            return None
        told = ", then ".join(f"{', '.join(map(self.in_words, names))} at {time_s:g} s" for time_s, names in tripped)
        if wanted is not None:
            return f"expect_fault = {wanted!r}: the drive tripped with another fault first: {told}"
        return f'the drive tripped: {told}; a scenario that means it says expect_fault = "{tripped[0][1][0]}"'


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


def _start(scenario: Scenario, motor: Motor, where: str) -> lib.Loop:
    try:
        loop = lib.Loop(motor.library, _plant(scenario, motor), motor.flux_map, scenario.controller.kind)
        for name, value in scenario.controller.values().items():
            loop.set(name, value)
        loop.set("torque_requested_Nm", scenario.profile.torque_Nm[0][1])
    except lib.LoopError as error:
        raise check.refused(error, scenario, motor, where) from error
    return loop


def check_finite(columns: list[str], rows: NDArray[np.float64]) -> None:
    """Refuse rows with a value that is infinite or no number."""
    bad = np.argwhere(~np.isfinite(rows))
    if bad.size:
        row, column = bad[0]
        raise FluxtrueError(
            f"the simulation left the range of numbers ({columns[column]} = {rows[row, column]:g}): "
            "a value in [plant], [profile], [mechanics] or an event is impossible"
        )


def simulate(
    scenario: Scenario,
    motor: Motor,
    *,
    where: str = "scenario",
    channels: Sequence[str] | None = None,
    progress: Callable[[float], Any] | None = None,
) -> Recording:
    """Run a scenario. `progress` is called with the simulated seconds of every chunk."""
    scenario = scenario.resolved(motor.torque_max_Nm, motor.speed_max_rpm)
    check.effective(scenario, motor, where)
    if channels is None:
        channels = (*CHANNELS, *IDENTIFIED) if scenario.controller.kind == "firmware" else CHANNELS
    columns = [column_name(c) for c in channels]
    check.speed(scenario, motor, 1.0 / motor.plant["pwm_hz"], where)
    with _start(scenario, motor, where) as probe:  # all values of the run, without simulating it
        every = check.rows(scenario, probe.period_s, len(columns), where)
        check.ranges(scenario, motor, probe, where)
    begin = time.thread_time()
    with _start(scenario, motor, where) as loop:
        try:
            loop.record(channels, every)
            rows = _run(scenario, loop, columns, progress)
            check_number = int(loop.get("motor_check")) if scenario.controller.kind == "firmware" else 0
        except lib.LoopError as error:
            raise check.refused(error, scenario, motor, where) from error
        except FluxtrueError as error:
            raise FluxtrueError(f"{where}: {error}") from error
    return Recording(scenario, motor, columns, rows, time.thread_time() - begin, check_number)


def _run(
    scenario: Scenario, loop: lib.Loop, columns: list[str], progress: Callable[[float], Any] | None
) -> NDArray[np.float64]:
    ramped = profiles.moving(scenario)
    events = sorted(scenario.event, key=lambda event: event.t)
    times = profiles.breakpoints(scenario, CHUNK_S)
    rows = []
    for start, stop in pairwise(times):
        while events and events[0].t <= start:
            for name, value in events.pop(0).set.items():
                loop.set(name, value)
        ramps = {
            name: (factor * value_at(points, start, True), factor * value_at(points, stop, False))
            for name, (_, points, factor) in ramped.items()
        }
        periods = round(stop / loop.period_s) - round(start / loop.period_s)
        rows.append(loop.run(periods, ramps))
        check_finite(columns, rows[-1])
        if progress is not None:
            progress(stop - start)
    return np.concatenate(rows)
