# SPDX-License-Identifier: Apache-2.0
"""One simulated drive through a warm-up and the windows in which its torque is measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign.drive import STEP_S, Profile
from fluxtrue_tools.campaign.spec import Windows
from fluxtrue_tools.campaign.windows import Window
from fluxtrue_tools.sim.library import Loop

Array = NDArray[np.float64]
RPM: Final = 2.0 * np.pi / 60.0
DRIVE_ROW_S: Final = 0.01
WINDOW_ROW_S: Final = 0.001
START_S: Final = 0.1  # switching enabled, no torque
TRANSITION_S: Final = 0.05  # shortest time from one window to the next

CHANNELS: Final = ("truth.time_s", "torque_requested_Nm", "truth.torque_mean_Nm", "truth.speed_rad_s", "truth.i_d_A",
                   "truth.i_q_A", "torque_estimated_Nm", "voltage_limited", "fault_word")  # fmt: skip
SIGNED: Final = ("truth.torque_mean_Nm", "truth.speed_rad_s")  # the plant counts them its own way


@dataclass
class Trace:
    """Rows of one controller's run, for a closer analysis."""

    columns: list[str]
    drive: Array
    windows: list[Array]  # settling and measuring


class Tour:
    """A drive whose switching is enabled, at an imposed speed.

    forward   -1: what the firmware counts as forward is backwards for the plant, because leads are exchanged
    """

    def __init__(self, loop: Loop, windows: Windows, counted: Sequence[str], forward: float = 1.0) -> None:
        self.columns = [*CHANNELS, *counted]
        self._loop, self._windows, self._forward = loop, windows, forward
        self._speed, self._torque = 0.0, 0.0
        self._drive = np.empty((0, len(self.columns)))
        self._rows: list[Array] = []

    def _move(self, seconds: float, speed_rad_s: float, torque_Nm: float) -> Array:
        """Change speed and torque linearly to new values."""
        sign = self._forward
        ramps = {"torque_requested_Nm": (self._torque, torque_Nm),
                 "plant.speed_rad_s": (sign * self._speed, sign * speed_rad_s)}  # fmt: skip
        rows = self._loop.run(round(seconds / self._loop.period_s), ramps)
        self._speed, self._torque = speed_rad_s, torque_Nm
        for name in SIGNED:
            rows[:, self.columns.index(name)] *= sign
        return rows

    def _record(self, row_s: float) -> None:
        self._loop.record(self.columns, max(1, round(row_s / self._loop.period_s)))

    def warm_up(self, profile: Profile) -> None:
        """Run the warm-up drive, point by point."""
        self._record(DRIVE_ROW_S)
        rows = [self._move(START_S, 0.0, 0.0)]
        for speed, torque in zip(profile.speed_rad_s, profile.torque_Nm, strict=True):
            rows.append(self._move(STEP_S, float(speed), float(torque)))
        self._drive = np.concatenate(rows)

    def measure(self, windows: list[Window]) -> None:
        """Visit all windows and measure in each."""
        self._record(WINDOW_ROW_S)
        self._move(START_S, 0.0, 0.0)
        for window in windows:
            speed = window.speed_rpm * RPM
            way_s = max(TRANSITION_S, abs(speed - self._speed) / (self._windows.slew_rpm_per_s * RPM))
            self._move(way_s, speed, window.torque_Nm)
            self._record(WINDOW_ROW_S)  # a row starts with the window
            periods_s = self._windows.settle_s + window.measure_s
            self._rows.append(self._move(periods_s, speed, window.torque_Nm))

    @property
    def trace(self) -> Trace:
        """What has been recorded so far."""
        return Trace(self.columns, self._drive, self._rows)


def window_row(
    window: Window, columns: list[str], rows: Array, rated_Nm: float, oscillation_share: float
) -> dict[str, Any]:
    """Means of the measured part, and the error that is scored."""
    kept = rows[-max(1, round(window.measure_s / WINDOW_ROW_S)) :]
    mean = dict(zip(columns, kept.mean(axis=0), strict=True))
    torque = kept[:, columns.index("truth.torque_mean_Nm")]
    base = max(abs(window.torque_Nm), 0.1 * rated_Nm)
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
        "oscillates": bool(torque.std() > oscillation_share * rated_Nm),
        "finite": bool(np.isfinite(rows).all()),
    }


def run_row(trace: Trace, counted: Sequence[str]) -> dict[str, Any]:
    """Totals of the whole run of one controller."""
    every = np.concatenate([trace.drive, *trace.windows])
    fault = np.nan_to_num(every[:, trace.columns.index("fault_word")]).astype(np.int64)
    totals = {f"run_{name}": int(np.count_nonzero(every[:, trace.columns.index(name)])) for name in counted}
    return {"run_fault_word": int(np.bitwise_or.reduce(fault)), "run_finite": bool(np.isfinite(every).all())} | totals
