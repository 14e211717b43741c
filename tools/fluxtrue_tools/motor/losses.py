# SPDX-License-Identifier: Apache-2.0
"""Losses of machine and inverter over torque and speed, on the current references."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.motor.envelope import available_flux, torque_envelope
from fluxtrue_tools.motor.flux_model import Array, flux
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.references import Contour

SPEEDS, TORQUES = 100, 80
SPEED_MIN_SHARE = 0.02  # of top speed: at standstill every efficiency is zero
PASSES = 3  # of flux and current: R^2 |i|^2 is a few per cent of the voltage's square, and changes little with the flux


@dataclass(frozen=True)
class Losses:
    """Power [torque][speed], W; NaN beyond the envelope. Windings at 20 °C; torque_Nm is a magnitude."""

    speed_rpm: Array
    torque_Nm: Array
    copper_W: Array
    iron_W: Array
    inverter_W: Array

    @property
    def total_W(self) -> Array:
        """All of them."""
        return self.copper_W + self.iron_W + self.inverter_W

    @property
    def efficiency(self) -> Array:
        """Shaft power over dc power while driving."""
        shaft = self.torque_Nm[:, None] * self.speed_rpm[None, :] * 2 * math.pi / 60
        return shaft / (shaft + self.total_W)


def _currents(motor: Motor, contour: Contour, speed_rpm: Array, brakes: bool) -> tuple[Array, Array]:
    """i_d and i_q of one torque at each speed, with the flux that the torque and these currents leave."""
    torque_Nm = -contour.torque_Nm if brakes else contour.torque_Nm
    i_d = i_q = np.zeros(len(speed_rpm))
    for _ in range(PASSES):
        i_d, i_q = contour.at(available_flux(motor, speed_rpm, np.array(torque_Nm), np.hypot(i_d, i_q)))
    return i_d, i_q


def losses(motor: Motor, brakes: bool = False) -> Losses:
    """Copper 3/2 R i^2; iron (k_h |w| + k_e w^2) |psi|^2 (PL-8); inverter: the device drop in three legs.

    The mean of a sinusoidal phase current of peak i is 2/pi i. Switching losses are not known and not contained.
    """
    machine, drop_V = motor.config.machine, motor.config.inverter.device_drop_V
    speed = np.linspace(SPEED_MIN_SHARE * machine.speed_max_rpm, machine.speed_max_rpm, SPEEDS)
    torque = np.linspace(machine.torque_max_Nm / TORQUES, machine.torque_max_Nm * (1 - 1e-6), TORQUES)
    omega = speed * machine.pole_pairs * 2 * math.pi / 60
    currents = np.array([_currents(motor, c, speed, brakes) for c in motor.solver.contours(torque)])
    i_d, i_q = currents[:, 0], currents[:, 1]
    possible = torque[:, None] <= torque_envelope(motor, speed, brakes)[None, :]
    i = np.where(possible, np.hypot(i_d, i_q), np.nan)
    iron = machine.iron_loss_hysteresis * omega + machine.iron_loss_eddy * omega**2
    return Losses(
        speed_rpm=speed,
        torque_Nm=torque,
        copper_W=1.5 * machine.r_ohm * i**2,
        iron_W=np.where(possible, iron * flux(motor.model, i_d, i_q) ** 2, np.nan),
        inverter_W=3.0 * drop_V * 2.0 / math.pi * i,
    )
