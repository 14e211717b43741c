# SPDX-License-Identifier: Apache-2.0
"""Pole pairs, direction and rough offset of the angle sensor by a slowly rotating current: (CM-15) ... (CM-17).

A current vector that does not follow the rotor is turned by some electrical turns and back. The rotor follows, because
its magnet points to the current; how far the sensor turns meanwhile gives pole pairs and direction.
"""

import cmath
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
TURNS = 2.8  # electrical, in each direction
HZ = 1.0
RISE_S, SPEED_UP_S = 0.8, 0.7
SWING_S = 2.0  # of braking the swing before the current turns
SWING_SHARE = 0.2  # of the current, while the rotor gains speed
POINTS, EVEN = 200, 0.97  # of the slope, and the share of the frequency from which it counts as even
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


def _push(drive: Capture, current_A: float, offset_A: complex) -> None:
    """A current along the imposed d axis. The offsets of the sensors do not turn with it: at 1 Hz, about the frequency
    of a rotor that swings about a small current, they would make it swing more and more."""
    shown_A = current_A + offset_A * cmath.exp(-1j * drive.get("theta_e_rad"))
    turning.currents(drive, shown_A.real, shown_A.imag)


def _brake_swing(drive: Capture, current_A: float, offset_A: complex) -> None:
    """Take the swing about the current away: its torque accelerates the rotor with less current than it brakes it."""
    before = 0.0
    for _ in range(round(SWING_S / turning.STEP_S)):
        taken = turning.advance(drive, turning.STEP_S, NAME, ("theta_e_rad", "sensor_turns"))
        speed = abs(float(taken[-1, 1] - taken[0, 1]))
        _push(drive, current_A * (SWING_SHARE if speed > before else 1.0), offset_A)
        before = speed


def rotate(drive: Capture, current_A: float, offset_A: complex) -> tuple[Array, Array]:
    """Imposed angle and sensor's angle on the way there and back, both continuous, in turns.

    offset_A   of the current sensors, stationary frame
    """
    steps = round(RISE_S / turning.STEP_S)
    for k in range(steps):
        _push(drive, current_A * (k + 1) / steps, offset_A)
        turning.advance(drive, turning.STEP_S, NAME)
    _brake_swing(drive, current_A, offset_A)
    rows = []
    for hz in (direction * HZ * share for direction in (1.0, -1.0) for share in _shares()):
        _push(drive, current_A, offset_A)
        rows.append(_at(drive, hz))
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


def _slope(imposed: Array, sensor: Array) -> float:
    """(CM-16): of the sensor's turns over the imposed ones, while these are even.

    Where the imposed angle is accelerated, a rotor that swings slowly is behind it, and overshoots where it turns back.
    """
    size = len(imposed) // POINTS
    x, y = (turns[: size * POINTS].reshape(POINTS, size).mean(axis=1) for turns in (imposed, sensor))
    hz, back = np.abs(np.gradient(x)), int(np.argmax(x))
    along, square = 0.0, 0.0
    for way in (slice(0, back), slice(back, POINTS)):
        even = hz[way] > EVEN * hz.max()
        count = np.count_nonzero(even)
        weights = np.sqrt(np.sin(np.pi * (np.arange(count) + 0.5) / count))
        distance = x[way][even] - np.average(x[way][even], weights=weights)
        along += float(weights @ (distance * y[way][even]))
        square += float(weights @ distance**2)
    return along / square


def followed(imposed: Array, sensor: Array, current_A: float) -> Followed:
    """(CM-16), (CM-17): the mean of both directions has no lag by friction."""
    slope = _slope(imposed, sensor)
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


def measure(drive: D, known: Nameplate, turn: Callable[[D, float, complex], tuple[Array, Array]]) -> Followed:
    """Measure with the smallest current that the rotor follows.

    turn   rotate(), or that of a drive over CAN
    """
    turning.connect(drive, None, known, NAME)
    try:
        for share in SHARES:
            current_A = share * known.i_max_A
            found = followed(*turn(drive, current_A, known.offset_A), current_A)
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
