# SPDX-License-Identifier: Apache-2.0
"""Inductances by the first pulses, of a few samples each, whose voltage the legs take a large part of: (CM-49)."""

import numpy as np

from fluxtrue_tools.commission.bursts import Raw, legs_of
from fluxtrue_tools.motor.flux_model import Array

POINTS = 32  # between two samples
SLOWEST = 0.1  # share of a period's voltage that changes the current at least: less is the noise of the samples
ACTIVE = 0.5  # share of the largest voltage: with less no pulse acts
TINY_A = 1e-9


def legs_in_time(i_s: Array, u_s: Array, level_V: float, knee_A: float) -> Array:
    """Mean in each period of the vector of three legs that lose 1 V at large currents, (CM-49).

    i_s   samples in the stationary frame
    u_s   voltage in the periods between them, with the drive's compensation and without the legs
    """
    change = np.diff(i_s)
    between = (np.arange(POINTS) + 0.5) / POINTS
    path = i_s[:-1, None] + change[:, None] * between
    legs = legs_of(path, knee_A)
    along = np.conj(change / np.maximum(np.abs(change), TINY_A))[:, None]
    least = SLOWEST * np.abs(u_s)[:, None] + TINY_A
    volts = np.maximum(((u_s[:, None] - level_V * legs) * along).real, least)
    return np.asarray((legs / volts).sum(axis=1) / (1.0 / volts).sum(axis=1))


def inductance_H(acting: Raw, r_ohm: float, level_V: float, knee_A: float, of_q: bool) -> float:
    """Of one axis, by the changes of flux linkage and current in the periods of the pulses.

    acting   with the voltage of the drive's compensation
    """
    turn = np.exp(1j * acting.theta)
    back = np.exp(-0.5j * (acting.theta[1:] + acting.theta[:-1]))
    i_s, u_s = acting.i * turn, acting.u[:-1] * np.conj(back)
    lost = r_ohm * 0.5 * (i_s[1:] + i_s[:-1]) + level_V * legs_in_time(i_s, u_s, level_V, knee_A)
    psi, i = acting.period_s * (u_s - lost) * back, np.diff(i_s) * back
    psi_axis, i_axis = (psi.imag, i.imag) if of_q else (psi.real, i.real)
    volts = np.abs(acting.u[:-1])
    sign = np.where(volts > ACTIVE * volts.max(), np.sign(psi_axis), 0.0)
    changed_A = float(sign @ i_axis)
    return float(sign @ psi_axis) / changed_A if changed_A != 0.0 else 0.0
