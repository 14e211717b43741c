# SPDX-License-Identifier: Apache-2.0
"""One case: one plant, one drive and the same windows for every controller. The result is a table of numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign import bound
from fluxtrue_tools.campaign.drive import STEP_S, Profile, make_profile
from fluxtrue_tools.campaign.envelope import make_envelope
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.sample import Sample, draws, sample
from fluxtrue_tools.campaign.spec import Campaign, Controller
from fluxtrue_tools.campaign.windows import Window, plan
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.check import complaint
from fluxtrue_tools.sim.library import Loop, LoopError

Array = NDArray[np.float64]
RPM: Final = 2.0 * np.pi / 60.0
DRIVE_ROW_S: Final = 0.01
WINDOW_ROW_S: Final = 0.001
START_S: Final = 0.1  # switching enabled, no torque
TRANSITION_S: Final = 0.05  # shortest time from one window to the next

CHANNELS: Final = ("truth.time_s", "torque_requested_Nm", "truth.torque_mean_Nm", "truth.speed_rad_s", "truth.i_d_A",
                   "truth.i_q_A", "torque_estimated_Nm", "voltage_limited", "fault_word")  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """Everything that is decided before the first period is simulated."""

    sample: Sample
    profile: Profile
    windows: list[Window]


def make_plan(campaign: Campaign, machine: Machine, case: int) -> Plan:
    """The case's plant, drive and windows."""
    streams = draws(campaign.seed, case)
    drawn = sample(campaign, machine, streams)
    envelope = make_envelope(machine, drawn.factors)
    profile = make_profile(campaign.drive, envelope, streams.drive)
    return Plan(drawn, profile, plan(campaign.windows, envelope, streams.windows))


@dataclass
class Trace:
    """Rows of one controller's run, for a closer analysis."""

    columns: list[str]
    drive: Array
    windows: list[Array]  # settling and measuring


class _Run:
    """One controller on the case's plant."""

    def __init__(self, campaign: Campaign, machine: Machine, plan: Plan, controller: Controller) -> None:
        motor = machine.motor
        self.plan, self.windows = plan, campaign.windows
        self.columns = [*CHANNELS, *campaign.check.count_nonzero]
        self.loop = Loop(motor.library, plan.sample.plant, motor.flux_map)
        for name, value in controller.set.items():
            self.loop.set(name, value)
        self.loop.set("enable", 1.0)
        self.speed, self.torque = 0.0, 0.0
        self.drive = np.empty((0, len(self.columns)))
        self.rows: list[Array] = []

    def _move(self, seconds: float, speed_rad_s: float, torque_Nm: float) -> Array:
        """Change speed and torque linearly to new values."""
        ramps = {"torque_requested_Nm": (self.torque, torque_Nm), "plant.speed_rad_s": (self.speed, speed_rad_s)}
        rows = self.loop.run(round(seconds / self.loop.period_s), ramps)
        self.speed, self.torque = speed_rad_s, torque_Nm
        return rows

    def _record(self, row_s: float) -> None:
        self.loop.record(self.columns, max(1, round(row_s / self.loop.period_s)))

    def warm_up(self) -> None:
        """Run the warm-up drive, point by point."""
        self._record(DRIVE_ROW_S)
        profile = self.plan.profile
        rows = [self._move(START_S, 0.0, 0.0)]
        for speed, torque in zip(profile.speed_rad_s, profile.torque_Nm, strict=True):
            rows.append(self._move(STEP_S, float(speed), float(torque)))
        self.drive = np.concatenate(rows)

    def measure(self) -> None:
        """Visit all windows and measure in each."""
        self._record(WINDOW_ROW_S)
        self._move(START_S, 0.0, 0.0)
        for window in self.plan.windows:
            speed = window.speed_rpm * RPM
            way_s = max(TRANSITION_S, abs(speed - self.speed) / (self.windows.slew_rpm_per_s * RPM))
            self._move(way_s, speed, window.torque_Nm)
            self._record(WINDOW_ROW_S)  # a row starts with the window
            periods_s = self.windows.settle_s + window.measure_s
            self.rows.append(self._move(periods_s, speed, window.torque_Nm))


def run_controller(campaign: Campaign, machine: Machine, plan: Plan, controller: Controller) -> Trace:
    """Warm-up and windows of one controller."""
    run = _Run(campaign, machine, plan, controller)
    with run.loop:
        if controller.warm_up:
            run.warm_up()
        run.measure()
    return Trace(run.columns, run.drive, run.rows)


def _window_row(campaign: Campaign, machine: Machine, window: Window, columns: list[str],
                rows: Array) -> dict[str, Any]:  # fmt: skip
    """Means of the measured part, and the error that is scored."""
    kept = rows[-max(1, round(window.measure_s / WINDOW_ROW_S)) :]
    mean = dict(zip(columns, kept.mean(axis=0), strict=True))
    torque = kept[:, columns.index("truth.torque_mean_Nm")]
    base = max(abs(window.torque_Nm), 0.1 * machine.rated_Nm)
    return {
        "speed_rpm": window.speed_rpm,
        "torque_requested_Nm": window.torque_Nm,
        "torque_Nm": mean["truth.torque_mean_Nm"],
        "torque_std_Nm": float(torque.std()),
        "estimate_Nm": mean["torque_estimated_Nm"],
        "id_A": mean["truth.i_d_A"],
        "iq_A": mean["truth.i_q_A"],
        "error_percent": 100.0 * (mean["truth.torque_mean_Nm"] - window.torque_Nm) / base,
        "voltage_limited": mean["voltage_limited"],
        "fault_word": int(np.nan_to_num(rows[:, columns.index("fault_word")]).astype(np.int64).max()),
        "oscillates": bool(torque.std() > campaign.check.oscillation_share * machine.rated_Nm),
        "finite": bool(np.isfinite(rows).all()),
    }


def _drive_row(campaign: Campaign, trace: Trace) -> dict[str, Any]:
    """Totals of the whole run of one controller."""
    every = np.concatenate([trace.drive, *trace.windows])
    fault = np.nan_to_num(every[:, trace.columns.index("fault_word")]).astype(np.int64)
    counted = {f"run_{name}": int(np.count_nonzero(every[:, trace.columns.index(name)]))
               for name in campaign.check.count_nonzero}  # fmt: skip
    return {"run_fault_word": int(np.bitwise_or.reduce(fault)), "run_finite": bool(np.isfinite(every).all())} | counted


def _controller_rows(campaign: Campaign, machine: Machine, plan: Plan, controller: Controller,
                     trace: Trace) -> list[dict[str, Any]]:  # fmt: skip
    whole = _drive_row(campaign, trace)
    rows = [
        _window_row(campaign, machine, window, trace.columns, rows)
        for window, rows in zip(plan.windows, trace.windows, strict=True)
    ]
    limits = bound.of_case(campaign, machine, plan.sample, trace) if controller.warm_up else [np.nan] * len(rows)
    return [
        {"controller": controller.name, "window": k} | row | {"bound_percent": float(limit)} | whole
        for k, (row, limit) in enumerate(zip(rows, limits, strict=True))
    ]


def run_case(campaign: Campaign, machine: Machine, case: int,
             keep: Callable[[str, Trace], None] | None = None) -> list[dict[str, Any]]:  # fmt: skip
    """All controllers of a case, a row per window; the same numbers wherever and whenever it runs."""
    plan = make_plan(campaign, machine, case)
    if not plan.windows:
        return []  # this plant cannot reach the smallest torque at any speed
    truth = {f"plant_{name}": value for name, value in plan.sample.factors.items()}
    rows = []
    for controller in campaign.controller:
        trace = run_controller(campaign, machine, plan, controller)
        if keep is not None:
            keep(controller.name, trace)
        rows += [{"case": case} | row | truth for row in _controller_rows(campaign, machine, plan, controller, trace)]
    return rows


def check_names(campaign: Campaign, machine: Machine, where: str) -> None:
    """Refuse what the plant or the firmware would refuse, before the first case."""
    plan = make_plan(campaign, machine, 0)
    for index, controller in enumerate(campaign.controller):
        try:
            with _Run(campaign, machine, plan, controller).loop as loop:
                recorded = [*CHANNELS, *campaign.check.count_nonzero]
                loop.record(recorded)
        except LoopError as error:
            key = error.name if error.name.startswith("plant.") else f"controller.{index}.set.{error.name}"
            key = "check.count_nonzero" if error.name in campaign.check.count_nonzero else key
            raise FluxtrueError(f"{where}: {complaint(error, key, machine.motor)}") from error
