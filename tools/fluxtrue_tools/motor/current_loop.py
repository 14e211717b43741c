# SPDX-License-Identifier: Apache-2.0
"""The sampled loop of current control as a linear model: docs/theory/current-control.md, sections 7 and 8."""

import math

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.motor.derived import CLOSED_LOOP_SHARE, DELAY_PERIODS, TURNING_FEEDBACK, TURNING_INTEGRAL
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import Motor

SIGMA = 1.0 / (2.0 * DELAY_PERIODS)  # per period
INTEGRAL = CLOSED_LOOP_SHARE * (1.0 - CLOSED_LOOP_SHARE) * SIGMA
NEAR_ZERO = 1e-3  # |z - 1|, |z - pole|: there the loop has no finite gain


class CurrentLoop:
    """The loop at the machine's voltage in the rotor's frame, (CC-12), without resistance.

    theta: electrical angle per period, rad; k and i: feedback and integral part per period; slope: of the tables'
    flux over the machine's, so that an inductance 25 % smaller than the tables' is 4/3.
    """

    def __init__(self, theta: float, k: complex, i: complex, slope: float = 1.0) -> None:
        self.pole, self.k, self.i, self.slope = np.exp(-1j * theta), k, i, slope

    def gain(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Open loop at z."""
        return np.asarray(self.slope * (self.k + self.i / (z - 1.0)) / (z * (z - self.pole)))

    def margins(self, points: int = 20001) -> tuple[float, float]:
        """Phase margin in degrees over all frequencies of both signs, largest sensitivity."""
        z = np.exp(1j * np.linspace(-np.pi, np.pi, points))
        z = z[np.abs(z - 1.0) > NEAR_ZERO]
        loop = self.gain(z[np.abs(z - self.pole) > NEAR_ZERO])
        crossings = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
        return float(np.abs(np.angle(-loop[crossings], deg=True)).min()), float(1.0 / np.abs(1.0 + loop).min())

    def largest_pole(self) -> float:
        """Magnitude of the slowest eigenvalue."""
        plant = np.polymul([1.0, -self.pole], [1.0, -1.0, 0.0])
        return float(np.abs(np.roots(np.polyadd(plant, self.slope * np.array([0, 0, self.k, self.i - self.k])))).max())


def usual(
    theta: float, share: float = 1.0, advance: float = 0.0, sigma: float = SIGMA, slope: float = 1.0
) -> CurrentLoop:
    """Section 3, with a share of the feed-forward and an additional advance of the angle."""
    turn = np.exp(1j * (advance - 0.5) * theta)
    return CurrentLoop(theta, turn * (sigma - 1j * share * theta), turn * sigma * INTEGRAL, slope)


def turning(theta: float, slope: float = 1.0) -> CurrentLoop:
    """Section 8: the voltage is stated half a period before the end of the one in which it acts."""
    half = np.exp(-0.5j * theta)
    k = TURNING_FEEDBACK * np.exp(-1.5j * theta)
    return CurrentLoop(theta, half * k, half * TURNING_INTEGRAL * (k + 2j * math.sin(0.5 * theta)), slope)


def current_loop(motor: Motor, speed_rpm: float, inductance: float = 1.0) -> CurrentLoop:
    """The loop of a motor at a speed, with true inductances of so many times the tables'."""
    theta = speed_rpm * motor.config.machine.pole_pairs * 2 * math.pi / 60 / motor.config.inverter.pwm_hz
    slope = 1.0 / inductance
    return turning(theta, slope) if motor.config.is_turning else usual(theta, slope=slope)


def frequencies_Hz(motor: Motor, points: int) -> Array:
    """Of the open loop's plot: up to half of the PWM frequency."""
    half = 0.5 * motor.config.inverter.pwm_hz
    return np.geomspace(1e-3 * half, half, points)
