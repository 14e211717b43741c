# SPDX-License-Identifier: Apache-2.0
"""Torque over speed in the steady state, where the trim holds the voltage at the planned one: (CR-17), (CR-20).

Source   docs/theory/current-reference.md
Units    rpm >= 0, N·m, positive where it drives; windings at 20 °C
Errors   the current of the iron loss (CR-18) and what magnets withstand (CR-11) are left out
"""

import math

import numpy as np

from fluxtrue_tools.motor.flux_model import Array, flux, torque
from fluxtrue_tools.motor.motor import Motor

FLUX_MAX = 10.0  # of the base flux: at low speed the voltage limits nothing


def _omega(motor: Motor, speed_rpm: Array) -> Array:
    return np.maximum(speed_rpm * motor.config.machine.pole_pairs * 2 * np.pi / 60, 1e-6)


def _planned_V(motor: Motor) -> float:
    return motor.derived.ref_v_ratio * motor.config.inverter.vdc_V


def _circle_V(motor: Motor) -> float:
    """The plan with the largest trim (CR-14)."""
    return motor.config.inverter.vdc_V / math.sqrt(3.0)


def _half_drop(motor: Motor, torque_Nm: Array) -> Array:
    """R T/(1.5 p), V² per rad/s: half of the middle term of (CR-17) over the speed."""
    machine = motor.config.machine
    return machine.r_ohm * np.asarray(torque_Nm) / (1.5 * machine.pole_pairs)


def available_flux(motor: Motor, speed_rpm: Array, torque_Nm: Array, current_A: Array) -> Array:
    """psi of (CR-17) where |u| is the planned voltage, V·s: zero where the drop alone is larger than that."""
    omega = _omega(motor, speed_rpm)
    resistive = 2.0 * omega * _half_drop(motor, torque_Nm) + (motor.config.machine.r_ohm * current_A) ** 2
    volts = np.sqrt(np.clip(_planned_V(motor) ** 2 - resistive, 0.0, _circle_V(motor) ** 2))
    return np.minimum(volts / omega, FLUX_MAX * motor.bases.flux_Vs)


def torque_envelope(motor: Motor, speed_rpm: Array, brakes: bool = False) -> Array:
    """Magnitude of the largest torque at each speed (CR-20), before torque_max_Nm cuts it; zero where none is possible.

    Found where the flux that a torque leaves falls below the least one of its contour, from zero torque on.
    """
    limits = motor.limits
    signed = -limits.torque_Nm if brakes else limits.torque_Nm
    left = available_flux(motor, speed_rpm[:, None], signed, limits.current_end_A) - limits.psi_min_Vs
    return np.array([_first_zero(limits.torque_Nm, row) for row in left])


def _first_zero(x: Array, y: Array) -> float:
    """Where y falls below zero first, linear between the points; the last x where it does not."""
    below = np.flatnonzero(y < 0.0)
    if below.size == 0:
        return float(x[-1])
    k = int(below[0])
    return float(x[k - 1] + (x[k] - x[k - 1]) * y[k - 1] / (y[k - 1] - y[k])) if k > 0 else 0.0


def voltage_speed(motor: Motor, i_d: Array, i_q: Array) -> Array:
    """The speed at which currents need the planned voltage, rpm: (CR-17) solved for w; zero where the drop needs it."""
    machine = motor.config.machine
    psi = np.maximum(flux(motor.model, i_d, i_q), 1e-6 * motor.bases.flux_Vs)
    left = np.maximum(_planned_V(motor) ** 2 - (machine.r_ohm * np.hypot(i_d, i_q)) ** 2, 0.0)
    drop = _half_drop(motor, torque(motor.model, machine.pole_pairs, i_d, i_q))
    omega = (np.sqrt(drop**2 + psi**2 * left) - drop) / psi**2
    return np.asarray(omega / machine.pole_pairs * 60 / (2 * np.pi))
