# SPDX-License-Identifier: Apache-2.0
"""Harmonics of the angle sensor, from windows in which the shaft coasts: (CM-37) ... (CM-39).

The shaft turns smoothly. What the sensor shows beside a smooth movement, and what repeats itself in each of its turns,
is an error of the sensor.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fluxtrue_tools.motor.flux_model import Array

ORDERS: Final = (1, 2, 3, 4)  # per turn of the sensor
DEGREE: Final = 3  # of the smooth movement over the time of a window
ROUNDS: Final = 3  # the harmonic belongs to the angle of the shaft, which is the shown one without it
LARGE_RAD: Final = math.radians(2.0)  # electrical
SIGMAS: Final = 3.0  # an amplitude that is no error of the measurement
LEAST_TURNS: Final = 0.7  # of the sensor in a window: in less, the smooth movement resembles the harmonics
LIGHTER: Final = 15.0  # a rotor may be so many times lighter than the nameplate's guess
SWING_SHARE: Final = 0.1  # uncertainty of a swing that was computed with a measured inertia


@dataclass(frozen=True)
class Coasting:
    """One window: in each sample the turns of the sensor, and the machine's current that makes torque."""

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
    """Once to four times per turn of the sensor, electrical: what it shows, how far the directions are from their mean,
    and what is to be added because the machine's own currents make the shaft swing, (CM-39), times the inertia."""

    shown_rad: Sequence[complex]
    spread_rad: Sequence[float]
    swing_rad_kgm2: Sequence[complex]
    inertia_kgm2: float
    is_measured: bool  # the inertia; else it is the nameplate's guess, with which nothing can be corrected

    def wave(self, order: int) -> Wave:
        """(CM-38)."""
        swing = self.swing_rad_kgm2[order - 1] / self.inertia_kgm2
        sigma = math.hypot(self.spread_rad[order - 1], (SWING_SHARE if self.is_measured else LIGHTER) * abs(swing))
        return Wave(self.shown_rad[order - 1] + (swing if self.is_measured else 0.0), sigma)

    @property
    def first(self) -> Wave:
        """Once per turn."""
        return self.wave(1)

    @property
    def second(self) -> Wave:
        """Twice per turn."""
        return self.wave(2)

    @property
    def further(self) -> Wave:
        """The larger of those three and four times per turn."""
        return max((self.wave(3), self.wave(4)), key=lambda wave: abs(wave.value_rad))

    @property
    def is_large(self) -> bool:
        """More than a well-mounted sensor has."""
        return any(abs(wave.value_rad) > max(LARGE_RAD, SIGMAS * wave.sigma_rad) for wave in map(self.wave, ORDERS))

    def with_inertia(self, inertia_kgm2: float) -> "Harmonics":
        """The same with a measured inertia."""
        return replace(self, inertia_kgm2=inertia_kgm2, is_measured=True)


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


def _turns(window: Coasting) -> float:
    return abs(float(window.turns[-1] - window.turns[0]))


def fit(windows: Sequence[Coasting]) -> Direction | None:
    """Windows of one direction, each with a smooth movement of its own, together; None: no window is long enough."""
    windows = [window for window in windows if _turns(window) >= LEAST_TURNS]
    if not windows:
        return None
    waves = np.zeros(len(ORDERS), complex)
    for _ in range(ROUNDS):
        matrices, values = zip(*(_equations(window, waves) for window in windows), strict=True)
        x, *_ = np.linalg.lstsq(np.vstack(matrices), np.vstack(values), rcond=None)
        waves, currents = (x[0::2] - 1j * x[1::2]).T
    seconds = sum(window.spacing_s * (len(window.turns) - 1) for window in windows)
    return Direction(waves, currents, 2.0 * math.pi * sum(map(_turns, windows)) / seconds)


def together(found: Sequence[Direction], pole_pairs: int, torque_Nm_per_A: float, inertia_kgm2: float) -> Harmonics:
    """(CM-38): the mean of all directions.

    torque_Nm_per_A   in the direction in which the sensor counts
    inertia_kgm2      the nameplate's
    """
    orders = np.array(ORDERS)
    waves = pole_pairs * np.array([each.waves for each in found])
    swing = np.mean([each.currents_A / (orders * each.speed_rad_s) ** 2 for each in found], axis=0)
    mean = waves.mean(axis=0)
    spread = np.sqrt((np.abs(waves - mean) ** 2).sum(axis=0) / max(len(found) - 1, 1) / len(found))
    return Harmonics([complex(value) for value in mean], [float(value) for value in spread],
                     [complex(value) for value in pole_pairs * torque_Nm_per_A * swing], inertia_kgm2,
                     is_measured=False)  # fmt: skip
