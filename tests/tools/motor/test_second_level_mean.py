# SPDX-License-Identifier: Apache-2.0
"""(SL-9) against the mean torque of every machine: what it removes beyond the true difference hides torque."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.motor.flux_model import flux, torque
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.quantise import Q15_ONE, Q16_ONE
from fluxtrue_tools.motor.second_level import make_second_level

ROOT = Path(__file__).resolve().parents[3]
MACHINES = sorted(path.parent for top in ("firmware", "tests") for path in (ROOT / top / "motors").glob("*/motor.toml"))
SHARE_MAX = 1 / 16  # MEAN_SHARE_MAX of firmware/second_level/own_torque.c


def currents(model, psi, i_d, i_q):
    """The currents of a flux, by Newton's method with the incremental inductances, beginning near them."""
    for _ in range(6):
        d, q = psi.real - model.psi_d(i_d, i_q), psi.imag - model.psi_q(i_d, i_q)
        dd, dq = model.psi_d(i_d, i_q, nd=1), model.psi_d(i_d, i_q, nq=1)
        qd, qq = model.psi_q(i_d, i_q, nd=1), model.psi_q(i_d, i_q, nq=1)
        i_d, i_q = i_d + (qq * d - dq * q) / (dd * qq - dq * qd), i_q + (dd * q - qd * d) / (dd * qq - dq * qd)
    assert np.max(np.hypot(psi.real - model.psi_d(i_d, i_q), psi.imag - model.psi_q(i_d, i_q))) < 1e-9
    return i_d, i_q


def mean_torque(model, pole_pairs, i_d, i_q, theta):
    """Mean over a period with the same currents at both ends. The voltage is constant: in the stator's frame the flux
    moves along a straight line, while the rotor turns by theta."""
    points, weights = np.polynomial.legendre.leggauss(5)
    psi, mean = model.psi_d(i_d, i_q) + 1j * model.psi_q(i_d, i_q), 0.0
    for s, weight in zip((points + 1) / 2, weights / 2, strict=True):
        at = psi * ((1 - s) * np.exp(-1j * s * theta) + s * np.exp(1j * (1 - s) * theta))
        mean = mean + weight * torque(model, pole_pairs, *currents(model, at, i_d, i_q))
    return mean


def removed_Nm(motor, i_q, at_samples):
    """What mean_loss() of own_torque.c removes at the largest speed, with the generated constants."""
    words, b = make_second_level(motor).words, motor.bases
    turn = motor.config.omega_max_rad_s / motor.config.machine.pole_pairs / (2 * np.pi) * b.step_s
    share = min(words["mean_share"] / Q15_ONE * turn**2, SHARE_MAX)
    constant = np.minimum(words["mean_flux"] / Q16_ONE * np.abs(i_q) / b.current_A, 1.0) * b.torque_Nm
    return share * np.maximum(2 * at_samples - constant, 0.0)


@cache
def torques(folder):
    """Over the current circle at the largest speed, N·m: removed, truly missing, T_0; where the voltage suffices."""
    motor = load_motor(folder)
    config, model = motor.config, motor.model
    machine, omega = config.machine, config.omega_max_rad_s
    i_d, i_q = np.meshgrid(np.linspace(-1, 0, 31), np.linspace(-1, 1, 62), indexing="ij")  # no i_q = 0
    inside = np.hypot(i_d, i_q) <= 1
    i_d, i_q = machine.i_max_A * i_d[inside], machine.i_max_A * i_q[inside]
    at_samples = np.sign(i_q) * torque(model, machine.pole_pairs, i_d, i_q)
    mean = np.sign(i_q) * mean_torque(model, machine.pole_pairs, i_d, i_q, omega * motor.bases.period_s)
    tolerance_Nm = make_second_level(motor).words["tolerance"] / Q15_ONE * motor.bases.torque_Nm
    reached = omega * flux(model, i_d, i_q) <= config.inverter.vdc_V / np.sqrt(3)
    return removed_Nm(motor, i_q, at_samples), at_samples - mean, tolerance_Nm, reached


@pytest.mark.parametrize("folder", MACHINES, ids=lambda path: path.name)
def test_no_more_torque_is_removed_than_the_mean_lacks(folder):
    """Where reluctance makes the mean the larger one, (SL-9) adds nothing: that counts where the voltage suffices."""
    removed, missing, tolerance_Nm, reached = torques(folder)
    limit_Nm = min(1.0, 0.1 * tolerance_Nm)
    assert np.max(removed - np.maximum(missing, 0.0)) < limit_Nm
    assert np.max((removed - missing)[reached], initial=0.0) < limit_Nm


@pytest.mark.parametrize("folder", MACHINES, ids=lambda path: path.name)
def test_what_is_left_is_no_third_of_the_tolerance(folder):
    """Otherwise the difference between mean and samples ends a healthy drive."""
    removed, missing, tolerance_Nm, reached = torques(folder)
    assert np.max((missing - removed)[reached], initial=0.0) < tolerance_Nm / 3
