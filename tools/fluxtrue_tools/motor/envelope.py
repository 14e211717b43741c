# SPDX-License-Identifier: Apache-2.0
"""Torque over speed at the planned share of the dc voltage, with the resistive drop of i_max along the whole voltage.

The references allow more: they plan with the drop of the torque (CR-2). Where the drop at i_max is 3 % of the voltage,
the difference is at most that; where it is a fifth, the speed at which the torque ends is that much too low here.
"""

import numpy as np

from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import Motor


def available_flux(motor: Motor, speed_rpm: Array) -> Array:
    """(v_ratio vdc - R i_max)/w, V·s: the least flux that (CR-2) can give."""
    machine = motor.config.machine
    omega = np.maximum(speed_rpm * machine.pole_pairs * 2 * np.pi / 60, 1e-6)
    volts = motor.derived.ref_v_ratio * motor.config.inverter.vdc_V - machine.r_ohm * machine.i_max_A
    return np.minimum(volts / omega, 10.0 * motor.bases.flux_Vs)


def torque_envelope(motor: Motor, speed_rpm: Array) -> Array:
    """T_max at each speed, before torque_max_Nm cuts it."""
    return motor.limits.torque_max(available_flux(motor, speed_rpm))
