# SPDX-License-Identifier: Apache-2.0
"""Steady state of the machine with shorted phases over speed, and where the drive makes use of it."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array, torque
from fluxtrue_tools.motor.motor import Motor

STEPS = 400  # from standstill to top speed; each begins with the currents of the one before
ITERATIONS = 50
ACCURACY = 1e-9  # of i_max


@dataclass(frozen=True)
class ShortCircuit:
    """Currents and torque [k] at the speeds [k]; in the steady state, windings at 20 °C, no iron loss."""

    speed_rpm: Array
    id_A: Array
    iq_A: Array
    torque_Nm: Array  # negative: it brakes

    @property
    def current_A(self) -> Array:
        """Peak of the phase current."""
        return np.hypot(self.id_A, self.iq_A)

    def torque_at(self, speed_rpm: float) -> float:
        """Interpolated, N·m."""
        return float(np.interp(speed_rpm, self.speed_rpm, self.torque_Nm))


def _solved(motor: Motor, omega: float, d: float, q: float) -> tuple[float, float]:
    """0 = R i_d - w psi_q, 0 = R i_q + w psi_d, by Newton's method from (d, q)."""
    model, machine = motor.model, motor.config.machine
    for _ in range(ITERATIONS):
        residual = np.array([machine.r_ohm * d - omega * float(model.psi_q(d, q)),
                             machine.r_ohm * q + omega * float(model.psi_d(d, q))])  # fmt: skip
        jacobian = np.array([
            [machine.r_ohm - omega * float(model.psi_q(d, q, nd=1)), -omega * float(model.psi_q(d, q, nq=1))],
            [omega * float(model.psi_d(d, q, nd=1)), machine.r_ohm + omega * float(model.psi_d(d, q, nq=1))],
        ])  # fmt: skip
        step = np.linalg.solve(jacobian, residual)
        d, q = d - float(step[0]), q - float(step[1])
        if math.hypot(*step) < ACCURACY * machine.i_max_A:
            return d, q
    raise FluxtrueError(
        f"flux map: no currents of a short circuit found at {omega:.4g} rad/s; wanted: a map whose fluxes rise with "
        "their currents, also beyond its edge"
    )


def short_circuit(motor: Motor) -> ShortCircuit:
    """From standstill to top speed; the speeds are denser near standstill, where the torque has its peak."""
    machine = motor.config.machine
    speeds = machine.speed_max_rpm * np.linspace(0.0, 1.0, STEPS) ** 2
    d = q = 0.0
    points = []
    for speed in speeds:
        d, q = _solved(motor, speed * machine.pole_pairs * 2 * math.pi / 60, d, q)
        points.append((d, q))
    i_d, i_q = np.array(points).T
    return ShortCircuit(speeds, i_d, i_q, torque(motor.model, machine.pole_pairs, i_d, i_q))


def used_from_rpm(motor: Motor) -> float:
    """Speed above which a fault shorts the phases (SS-2); below it switching is disabled."""
    emf_per_rpm = math.sqrt(3.0) * motor.derived.psi_f_Vs * motor.config.machine.pole_pairs * 2 * math.pi / 60
    return motor.derived.share_short * motor.config.inverter.vdc_V / emf_per_rpm
