# SPDX-License-Identifier: Apache-2.0
"""Harmonics of the angle sensor, from windows in which the shaft coasts: (CM-37) ... (CM-39).

The shaft turns smoothly. What the sensor shows beside a smooth movement, and what repeats itself in each of its turns,
is an error of the sensor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fluxtrue_tools.motor.flux_model import Array

ORDERS: Final = (1, 2, 3, 4)  # per turn of the sensor
DEGREE: Final = 3  # of the smooth movement over the time of a window
ROUNDS: Final = 3  # the harmonic belongs to the angle of the shaft, which is the shown one without it
LARGE_RAD: Final = math.radians(2.0)  # the largest coefficient that the firmware corrects


@dataclass(frozen=True)
class Coasting:
    """One window: in each sample the turns of the sensor, and the current that makes torque."""

    turns: Array
    i_q_A: Array
    spacing_s: float


@dataclass(frozen=True)
class Direction:
    """Of the windows of one direction: complex amplitudes for each order."""

    waves: Array  # of the sensor's deviation, mechanical, rad
    currents_A: Array  # of the current that makes torque
    speed_rad_s: float  # of the sensor


@dataclass(frozen=True)
class Wave:
    """One harmonic: the sensor shows Re(value exp(j k theta)) too much, theta since its zero."""

    value_rad: complex  # electrical
    sigma_rad: float

    @property
    def phase_rad(self) -> float:
        """The angle since the sensor's zero, times the order, at which the sensor shows most too much."""
        return -float(np.angle(self.value_rad)) % (2.0 * math.pi)


@dataclass(frozen=True)
class Harmonics:
    """Once and twice per turn of the sensor; the larger amplitude of those three and four times per turn."""

    first: Wave
    second: Wave
    further_rad: float

    @property
    def is_large(self) -> bool:
        """More than a well-mounted sensor has, and than the firmware corrects."""
        return max(abs(self.first.value_rad), abs(self.second.value_rad), self.further_rad) > LARGE_RAD


def _deviation(angle: Array, waves: Array) -> Array:
    return np.asarray(sum((wave * np.exp(1j * k * angle)).real for k, wave in zip(ORDERS, waves, strict=True)))


def _beside_the_smooth(values: Array) -> Array:
    """Columns without what a polynomial in time explains."""
    basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, len(values)), DEGREE))
    return np.asarray(values - basis @ (basis.T @ values))


def _equations(window: Coasting, waves: Array) -> tuple[Array, Array]:
    """(CM-37): cosines and sines of the orders; the shown angle, and the current."""
    shown = 2.0 * math.pi * window.turns
    shaft = shown - _deviation(shown, waves)
    columns = [of(k * shaft) for k in ORDERS for of in (np.cos, np.sin)]
    parts = _beside_the_smooth(np.column_stack((*columns, shown, window.i_q_A)))
    return parts[:, : len(columns)], parts[:, len(columns) :]


def fit(windows: Sequence[Coasting]) -> Direction:
    """Windows of one direction, each with a smooth movement of its own, together."""
    waves = np.zeros(len(ORDERS), complex)
    for _ in range(ROUNDS):
        matrices, values = zip(*(_equations(window, waves) for window in windows), strict=True)
        x, *_ = np.linalg.lstsq(np.vstack(matrices), np.vstack(values), rcond=None)
        waves, currents = (x[0::2] - 1j * x[1::2]).T
    turns = sum(abs(float(window.turns[-1] - window.turns[0])) for window in windows)
    seconds = sum(window.spacing_s * (len(window.turns) - 1) for window in windows)
    return Direction(waves, currents, 2.0 * math.pi * turns / seconds)


def _swing(found: Direction, torque_Nm_per_A: float, inertia_kgm2: float) -> Array:
    """(CM-39): by which these currents make the shaft itself swing."""
    speed = np.array(ORDERS) * found.speed_rad_s
    return np.asarray(torque_Nm_per_A * np.abs(found.currents_A) / (inertia_kgm2 * speed**2))


def together(found: Sequence[Direction], pole_pairs: int, torque_Nm_per_A: float, inertia_kgm2: float) -> Harmonics:
    """(CM-38): the mean of all directions. The uncertainty has two parts: how far they are from each other, and how
    far the shaft may swing, with the nameplate's inertia."""
    waves = pole_pairs * np.array([each.waves for each in found])
    swing = pole_pairs * np.mean([_swing(each, torque_Nm_per_A, inertia_kgm2) for each in found], axis=0)
    mean = waves.mean(axis=0)
    spread = np.sqrt((np.abs(waves - mean) ** 2).sum(axis=0) / max(len(found) - 1, 1) / len(found))
    sigma = np.hypot(spread, swing)
    first, second = (Wave(complex(mean[k]), float(sigma[k])) for k in range(2))
    return Harmonics(first, second, float(np.abs(mean[2:]).max()))
