# SPDX-License-Identifier: Apache-2.0
"""The sampled loop of current control as a linear model: docs/theory/current-control.md, sections 7 and 8."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.motor.derived import (
    CLOSED_LOOP_SHARE,
    DELAY_PERIODS,
    MEASURED_SHARE,
    TURNING_FEEDBACK,
    TURNING_INTEGRAL,
)
from fluxtrue_tools.motor.envelope import available_flux, torque_envelope
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import Motor

SIGMA = 1.0 / (2.0 * DELAY_PERIODS)  # per period
INTEGRAL = CLOSED_LOOP_SHARE * (1.0 - CLOSED_LOOP_SHARE) * SIGMA  # a_i
POINT_FLUX, POINT_TORQUE = 0.85, 0.25  # shares of the available ones
POINT_CURRENT = 0.95  # of i_max_A, at most
POINTS = 400
NEAR_ZERO = 1e-3  # |z - 1|, |z - pole|: there the loop has no finite gain


class CurrentLoop:
    """The loop at the machine's voltage in the rotor's frame, (CC-12).

    theta: electrical angle per period, rad; k and i: feedback and integral part per period; slope: of the tables'
    flux over the machine's, so that an inductance 25 % smaller than the tables' is 4/3; loss: decay of the flux on the
    resistance per period, R T_s/l; drop: what the law adds for the measured current, per period.
    """

    def __init__(
        self, theta: float, k: complex, i: complex, slope: float = 1.0, loss: float = 0.0, drop: complex = 0.0
    ) -> None:
        self.pole, self.k, self.i, self.slope, self.drop = np.exp(-1j * theta - loss), k, i, slope, drop
        self.hold = -math.expm1(-loss) / loss if loss > 0.0 else 1.0

    def gain(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Open loop at z."""
        feedback = self.slope * (self.k + self.i / (z - 1.0)) - self.drop
        return np.asarray(self.hold * feedback / (z * (z - self.pole)))

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
        k, i = self.slope * self.k - self.drop, self.slope * self.i
        return float(np.abs(np.roots(np.polyadd(plant, self.hold * np.array([0, 0, k, i - k])))).max())


def usual(
    theta: float,
    share: float = MEASURED_SHARE,
    advance: float = 0.0,
    sigma: float = SIGMA,
    slope: float = 1.0,
    loss: float = 0.0,
) -> CurrentLoop:
    """Section 3: of the rotational voltage a share follows the measured flux, the rest the target (CC-24).

    With a share of 1 (CC-12). advance: additional one of the angle.
    """
    turn = np.exp(1j * (advance - 0.5) * theta)
    integral = INTEGRAL * (sigma + 1j * (1.0 - share) * theta)
    return CurrentLoop(theta, turn * (sigma - 1j * share * theta), turn * integral, slope, loss)


def turning(theta: float, slope: float = 1.0, loss: float = 0.0) -> CurrentLoop:
    """Section 8: the voltage is stated half a period before the end of the one in which it acts."""
    half = np.exp(-0.5j * theta)
    k = TURNING_FEEDBACK * np.exp(-1.5j * theta)
    return CurrentLoop(
        theta, half * k, half * TURNING_INTEGRAL * (k + 2j * math.sin(0.5 * theta)), slope, loss, half * loss
    )


def operating_point(motor: Motor, speed_rpm: float, inductance: float = 1.0) -> tuple[float, float]:
    """i_d and i_q of the plots: part of the torque, with a reserve of voltage.

    Smaller inductances weaken the field less: they take more i_d for it.
    """
    speed = np.array([speed_rpm])
    psi = POINT_FLUX * float(available_flux(motor, speed, POINT_TORQUE * torque_envelope(motor, speed), np.zeros(1))[0])
    possible = min(float(motor.limits.torque_max(np.array([psi]))[0]), motor.config.machine.torque_max_Nm)
    (contour,) = motor.solver.contours(np.array([POINT_TORQUE * max(possible, 0.0)]))
    i_d, i_q = (float(x[0]) for x in contour.at(np.array([psi])))
    largest = math.sqrt((POINT_CURRENT * motor.config.machine.i_max_A) ** 2 - i_q**2)
    return max(i_d / min(inductance, 1.0), -largest), i_q


def turn_per_period(motor: Motor, speed_rpm: float) -> float:
    """Electrical angle, rad."""
    return speed_rpm * motor.config.machine.pole_pairs * 2 * math.pi / 60 / motor.config.inverter.pwm_hz


def current_loop(motor: Motor, speed_rpm: float, inductance: float = 1.0) -> CurrentLoop:
    """The loop of a motor at a speed and its operating point, with so many times the tables' inductances.

    Of the resistance the mean over both axes is taken: without it the axes are alike, whatever their inductances.
    """
    i_d, i_q = operating_point(motor, speed_rpm, inductance)
    per_H = 0.5 / float(motor.model.psi_d(i_d, i_q, nd=1)) + 0.5 / float(motor.model.psi_q(i_d, i_q, nq=1))
    loss = motor.config.machine.r_ohm * per_H / inductance / motor.config.inverter.pwm_hz
    theta, slope = turn_per_period(motor, speed_rpm), 1.0 / inductance
    return turning(theta, slope, loss) if motor.config.is_turning else usual(theta, slope=slope, loss=loss)


@dataclass(frozen=True)
class Response:
    """The open loop at frequencies in the rotor's frame, ascending; negative ones turn against the field."""

    frequency_Hz: Array
    gain: NDArray[np.complex128]


def model_response(motor: Motor, speed_rpm: float, inductance: float = 1.0) -> Response:
    """The model, up to half of the PWM frequency in both directions."""
    half = 0.5 * motor.config.inverter.pwm_hz
    positive = np.geomspace(1e-3 * half, half, POINTS)
    frequency = np.concatenate([-positive[::-1], positive])
    z = np.exp(2j * np.pi * frequency / motor.config.inverter.pwm_hz)
    return Response(frequency, current_loop(motor, speed_rpm, inductance).gain(z))
