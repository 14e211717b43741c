# SPDX-License-Identifier: Apache-2.0
"""Pole pairs, direction and rough offset of the angle sensor by a slowly rotating current: (CM-15) ... (CM-17).

A current vector that does not follow the rotor is turned by some electrical turns and back. The rotor follows, because
its magnet points to the current; how far the sensor turns meanwhile gives pole pairs and direction.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from fluxtrue_tools.commission import turning
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

NAME = "phases"
SHARES = (0.03, 0.06, 0.12, 0.25)  # of i_max: the smallest that the rotor follows
TURNS = 3.0  # electrical, in each direction
HZ = 1.0
RISE_S, SPEED_UP_S = 0.8, 0.5
SWING_S = 2.0  # of braking the swing before the current turns
SWING_SHARE = 0.2  # of the current, while the rotor gains speed
WHOLE = 0.08  # distance of the pole pairs from a whole number
BEHIND_RAD = math.radians(60.0)  # rms, of the rotor about the current
STILL_TURNS = 0.1  # of the electrical turns that were imposed: less is a rotor that stands
PAIRS_MAX = 50


D = TypeVar("D", bound=Capture)


@dataclass(frozen=True)
class Followed:
    """How the rotor followed one current."""

    current_A: float
    pole_pairs: float  # not rounded; negative: the sensor counts backwards
    behind_rad: float  # rms distance between rotor and current
    connection: Connection


def _brake_swing(drive: Capture, current_A: float) -> None:
    """Take the swing about the current away: its torque accelerates the rotor with less current than it brakes it."""
    before = 0.0
    for _ in range(round(SWING_S / turning.STEP_S)):
        taken = turning.advance(drive, turning.STEP_S, NAME, ("theta_e_rad", "sensor_turns"))
        speed = abs(float(taken[-1, 1] - taken[0, 1]))
        turning.currents(drive, current_A * (SWING_SHARE if speed > before else 1.0), 0.0)
        before = speed
    turning.currents(drive, current_A, 0.0)


def rotate(drive: Capture, current_A: float) -> tuple[Array, Array]:
    """Imposed angle and sensor's angle on the way there and back, both continuous, in turns."""
    steps = round(RISE_S / turning.STEP_S)
    for k in range(steps):
        turning.currents(drive, current_A * (k + 1) / steps, 0.0)
        turning.advance(drive, turning.STEP_S, NAME)
    _brake_swing(drive, current_A)
    rows = []
    for direction in (1.0, -1.0):
        rows += [_at(drive, direction * HZ * share) for share in _shares()]
    taken = np.vstack(rows)
    return np.unwrap(taken[:, 0]) / turning.TURN, taken[:, 1]


def _shares() -> list[float]:
    """The shares of the frequency in each step: up, constant, down."""
    up = round(SPEED_UP_S / turning.STEP_S)
    on = round(TURNS / HZ / turning.STEP_S) - up
    rise = [(k + 0.5) / up for k in range(up)]
    return [*rise, *[1.0] * on, *rise[::-1]]


def _at(drive: Capture, hz: float) -> Array:
    drive.set("imposed_hz", hz)
    return turning.advance(drive, turning.STEP_S, NAME, ("theta_e_rad", "sensor_turns"))


def _circular_mean(turns: Array) -> complex:
    return complex(np.exp(2j * np.pi * turns).mean())


def followed(imposed: Array, sensor: Array, current_A: float) -> Followed:
    """(CM-16), (CM-17): the mean of both directions has no lag by friction."""
    slope = float(np.polyfit(imposed, sensor, 1)[0])
    if abs(slope) < STILL_TURNS / PAIRS_MAX:
        return Followed(current_A, 0.0, math.pi, Connection(1, False, 0.0))
    pairs = max(round(1.0 / abs(slope)), 1)
    distance = imposed - math.copysign(pairs, slope) * sensor
    half = len(distance) // 2
    ways = [_circular_mean(part) for part in (distance[:half], distance[half:])]
    middle = ways[0] / abs(ways[0]) + ways[1] / abs(ways[1])
    left = np.angle(np.exp(2j * np.pi * distance) / middle)
    connection = Connection(pairs, slope < 0.0, float(np.angle(middle)))
    return Followed(current_A, 1.0 / slope, float(np.sqrt(np.mean(left**2))), connection)


def _is_right(found: Followed) -> bool:
    return abs(found.pole_pairs - round(found.pole_pairs)) < WHOLE and 0.0 < found.behind_rad < BEHIND_RAD


def measure(drive: D, known: Nameplate, turn: Callable[[D, float], tuple[Array, Array]]) -> Followed:
    """Measure with the smallest current that the rotor follows.

    turn   rotate(), or that of a drive over CAN
    """
    turning.connect(drive, None, known, NAME)
    try:
        for share in SHARES:
            current_A = share * known.i_max_A
            found = followed(*turn(drive, current_A), current_A)
            if _is_right(found):
                return found
    finally:
        turning.release(drive)
    if found.pole_pairs == 0.0:
        raise FluxtrueError(f"commission: {NAME}: the rotor did not move with {found.current_A:.3g} A: it is blocked, "
                            "or a lead or the angle sensor is not connected")  # fmt: skip
    raise FluxtrueError(f"commission: {NAME}: the rotor did not follow {found.current_A:.3g} A ({found.pole_pairs:.3g} "
                        f"pole pairs, {math.degrees(found.behind_rad):.0f} degrees from the current): the shaft is "
                        "coupled, or one phase is missing")  # fmt: skip
