# SPDX-License-Identifier: Apache-2.0
"""Movements of the shaft: what every step that turns it has in common, and the bounds that it must keep."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

TURN = 2.0 * math.pi
SPEED_SHARE = 0.24  # of the largest speed
LIMIT_SHARE = 0.3  # of the largest speed: here the firmware disables switching
CONSENT_S = 0.2  # after the last command for which the shaft may move
STEP_S = 0.01  # between two commands
SETTLE_S = 0.05
SIGNALS = ("id_A", "iq_A", "ud_V", "uq_V", "theta_e_rad", "sensor_turns")
ENDED = {1: "the commands stopped", 2: "the shaft turned faster than 30 % of the largest speed"}


@dataclass(frozen=True)
class Connection:
    """How the angle sensor and the three leads are connected."""

    pole_pairs: int
    reversed: bool  # the sensor counts against the electrical direction
    offset_rad: float  # electrical angle at the sensor's zero

    def turned(self, by_rad: float) -> "Connection":
        """The same with an offset that is larger by this angle."""
        return Connection(self.pole_pairs, self.reversed, math.remainder(self.offset_rad + by_rad, TURN))


def _stopped(drive: Capture) -> str:
    why = ENDED.get(int(drive.get("spin_failure")), f"fault word 0x{int(drive.get('fault_word')):x}")
    return f"switching was disabled: {why}"


def advance(drive: Capture, seconds: float, step: str, signals: tuple[str, ...] = SIGNALS) -> Array:
    """Let the drive run while the movement is agreed; refused when something has ended it."""
    drive.set("spin_periods", round((seconds + CONSENT_S) / drive.period_s))
    rows = drive.capture(signals, round(seconds / drive.period_s))
    if drive.get("run_state") != 1.0:
        raise FluxtrueError(f"commission: {step}: {_stopped(drive)}")
    return rows


def _settle(drive: Capture) -> None:
    """After a change that needs no agreement to a movement."""
    drive.capture(("run_state",), round(SETTLE_S / drive.period_s))


def connect(drive: Capture, connection: Connection | None, known: Nameplate, step: str) -> None:
    """Disable, take another source of the angle (none: the angle is imposed), enable with currents of zero."""
    currents(drive, 0.0, 0.0)
    drive.set("enable", 0.0)
    _settle(drive)
    drive.set("angle_imposed", float(connection is None))
    drive.set("machine_monitors", 0.0)  # they compare with the nameplate's guesses
    if connection is not None:
        drive.set("angle_pole_pairs", connection.pole_pairs)
        drive.set("angle_reversed", float(connection.reversed))
        drive.set("angle_offset_rad", connection.offset_rad)
    _settle(drive)
    drive.set("spin_rpm", LIMIT_SHARE * known.speed_max_rpm)
    drive.set("current_mode", 1.0)
    drive.set("enable", 1.0)
    advance(drive, SETTLE_S, step, ("run_state",))


def currents(drive: Capture, i_d_A: float, i_q_A: float) -> None:
    """References in the frame of the angle that acts."""
    drive.set("id_ref_A", i_d_A)
    drive.set("iq_ref_A", i_q_A)


def release(drive: Capture) -> None:
    """Without current and without limits; the angle's source stays what it is."""
    currents(drive, 0.0, 0.0)
    drive.set("imposed_hz", 0.0)
    drive.set("current_mode", 0.0)
    drive.set("enable", 0.0)
    drive.set("spin_periods", 0.0)
    drive.set("machine_monitors", 1.0)
    _settle(drive)


def speed_rad_s(rows: Array, period_s: float) -> float:
    """Mean over the rows, mechanical, as the sensor counts; its turns are the last column."""
    turns = rows[:, -1]
    times = period_s * np.arange(len(turns))
    return float(TURN * np.polyfit(times, turns, 1)[0])
