# SPDX-License-Identifier: Apache-2.0
"""The information bound: against hand calculation, and its model against the simulated drive."""

import math

import numpy as np
import pytest

from fluxtrue_tools.campaign.bound import (
    information,
    noise_variance,
    prior_variances,
    torque_deviation,
    torque_jacobian,
    voltage_jacobian,
)  # fmt: skip
from fluxtrue_tools.campaign.bound_model import STATES, physics_of, truth_of
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.campaign.sample import draws, sample
from fluxtrue_tools.campaign.spec import Campaign
from fluxtrue_tools.sim.library import Loop


def test_two_states_and_three_measurements_give_the_covariance_worked_out_by_hand() -> None:
    # Prior variances 4 and 1; x1 measured twice (variance 2), x1 + x2 once (variance 1); the window measures x2 (0.5).
    rows = np.array([[1.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    information_of_drive = np.diag([0.25, 1.0]) + information(rows, np.array([2.0, 2.0, 1.0]))
    assert information_of_drive == pytest.approx(np.array([[2.25, 1.0], [1.0, 2.0]]))
    own = information(np.array([[0.0, 1.0]]), np.array([0.5]))
    # The sum [[2.25, 1], [1, 4]] has the determinant 8; its inverse is [[4, -1], [-1, 2.25]]/8.
    got = torque_deviation(information_of_drive, [own, 0.0 * own], np.array([[2.0, 1.0], [2.0, 1.0]]))
    assert got[0] == pytest.approx(math.sqrt((4.0 * 4.0 - 2.0 * 2.0 + 2.25) / 8.0))
    # Without the window: determinant 3.5, inverse [[2, -1], [-1, 2.25]]/3.5.
    assert got[1] == pytest.approx(math.sqrt((4.0 * 2.0 - 2.0 * 2.0 + 2.25) / 3.5))


def test_without_data_the_bound_is_the_prior() -> None:
    got = torque_deviation(np.diag([1.0 / 9.0, 1.0 / 16.0]), [np.zeros((2, 2))], np.array([[1.0, 1.0]]))
    assert got[0] == pytest.approx(5.0)


def test_states_of_very_different_size_do_not_spoil_the_inverse() -> None:
    got = torque_deviation(np.diag([1e18, 1e-6]), [np.zeros((2, 2))], np.array([[1e9, 1e-3]]))
    assert got[0] == pytest.approx(math.sqrt(2.0))


def test_a_prior_is_the_variance_of_its_uniform_range(small: Campaign, machine: Machine) -> None:
    got = dict(zip(STATES, prior_variances(small, machine), strict=True))
    assert got["lq"] == pytest.approx(0.1**2 / 3)
    assert got["magnet"] == pytest.approx(0.125**2 / 3)
    assert got["resistance"] == pytest.approx((0.00393 * 5.0) ** 2 / 3)
    assert got["current_gain"] == pytest.approx(0.005**2 / 9)  # of the mean of three phases
    assert got["angle"] == pytest.approx(math.radians(0.5) ** 2 / 3)


def test_the_noise_of_a_mean_falls_with_its_length(small: Campaign, machine: Machine) -> None:
    one, hundred = (noise_variance(small, machine, np.array([0.0]), n)[0] for n in (1.0, 100.0))
    assert one == pytest.approx(100.0 * hundred)
    # At rest only R·i is left: 18 mOhm times 0.8 A rms per phase, sqrt(2/3) of it in an axis.
    assert math.sqrt(one) == pytest.approx(0.018 * 0.8 * math.sqrt(2.0 / 3.0))


def test_the_slopes_are_those_of_the_steady_state_equations(small: Campaign, machine: Machine) -> None:
    drawn = sample(small, machine, draws(small.seed, 0))
    physics, x = physics_of(machine, drawn), truth_of(machine, drawn)
    # No errors of the sensors and no iron loss, so that the slopes can be calculated by hand.
    for name, value in {"vdc_gain": 1.0, "current_gain": 1.0, "angle": 0.0, "iron": 0.0}.items():
        x[STATES.index(name)] = value
    i, omega = np.array([-60.0 + 80.0j]), np.array([1000.0])
    slope = voltage_jacobian(physics, x, i, omega)
    column = STATES.index
    psi_f = float(machine.model.psi_d(0.0, 0.0))
    assert slope[:, column("magnet")] == pytest.approx([0.0, 1000.0 * psi_f], abs=1e-6)
    psi_q = float(machine.model.psi_q(-60.0, 80.0))
    assert slope[:, column("lq")] == pytest.approx([-1000.0 * psi_q, 0.0], abs=1e-6)
    assert slope[:, column("resistance")] == pytest.approx([physics.r_ohm * -60.0, physics.r_ohm * 80.0])
    # A volt of device drop: 4/pi along the current, which is (-0.6, 0.8) here.
    assert slope[:, column("device_drop")] == pytest.approx([4 / math.pi * -0.6, 4 / math.pi * 0.8])
    # T = 1.5 p (psi_d i_q - psi_q i_d): the magnet's share is 1.5·3·psi_f·80, L_q's -1.5·3·psi_q·(-60).
    torque = torque_jacobian(physics, x, i, omega)[0]
    assert torque[column("magnet")] == pytest.approx(4.5 * psi_f * 80.0)
    assert torque[column("lq")] == pytest.approx(4.5 * psi_q * 60.0)
    assert torque[column("resistance")] == 0.0


@pytest.mark.parametrize(("speed_rpm", "torque_Nm"), [(600.0, 60.0), (-3000.0, 80.0), (5000.0, -40.0)])
def test_the_model_says_what_the_simulated_drive_does(
    small: Campaign, machine: Machine, speed_rpm: float, torque_Nm: float
) -> None:
    drawn = sample(small, machine, draws(small.seed, 2))
    # These vanish in a mean over whole turns; without them a short run is enough.
    still = dict.fromkeys(("angle_h1_rad", "angle_h2_rad", "current_noise_A_rms"), 0.0)
    omega_m = speed_rpm * 2.0 * math.pi / 60.0
    with Loop(machine.motor.library, drawn.plant | still | {"speed_rad_s": omega_m}, machine.motor.flux_map) as loop:
        for name, value in {"torque_loop": 0.0, "identification": 0.0, "enable": 1.0}.items():
            loop.set(name, value)
        loop.set("torque_requested_Nm", torque_Nm)
        loop.run_s(0.3)
        names = ["truth.i_d_A", "truth.i_q_A", "truth.u_d_V", "truth.u_q_V", "truth.torque_mean_Nm"]
        loop.record(names, 1000)
        i_d, i_q, u_d, u_q, torque = loop.run(1000)[0]
    physics, x = physics_of(machine, drawn), truth_of(machine, drawn)
    # The recorded voltages are those at the terminals: no errors of sensors, no losses of the inverter.
    for name, value in {"dead_time": 0.0, "device_drop": 0.0, "vdc_gain": 1.0, "current_gain": 1.0,
                        "angle": 0.0}.items():  # fmt: skip
        x[STATES.index(name)] = value
    i, omega = np.array([i_d + 1j * i_q]), np.array([3.0 * omega_m])
    # Between the map's nodes the plant interpolates by Hermite cubics, the model by a spline: parts per thousand.
    assert physics.voltage(x, i, omega)[0] == pytest.approx(u_d + 1j * u_q, abs=0.003 * abs(u_d + 1j * u_q) + 0.05)
    assert physics.torque(x, i, omega)[0] == pytest.approx(torque, abs=0.003 * abs(torque))
