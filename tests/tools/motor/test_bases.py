# SPDX-License-Identifier: Apache-2.0
"""Per-unit bases and gains, and their values in the generated C."""

import math
import re

import pytest
from conftest import MOTORS

from fluxtrue_tools.motor.emit_c import motor_si_c, motor_tables_c
from fluxtrue_tools.motor.motor import load_motor


@pytest.fixture(scope="module", params=["hsm1", "paper"])
def motor(request):
    return load_motor(MOTORS / request.param)


def members(text):
    """{member: number} of the generated struct; the last of equal names wins, except for the first bases."""
    found = re.findall(r"\.(\w+) = (-?[0-9][0-9.e+-]*)[fu]?,", text)
    return {name: float(value) for name, value in reversed(found)}


def test_the_paper_machines_bases_are_those_of_a_pocket_calculator():
    """omega_max = 4 * 6000/60 * 2 pi = 800 pi; omega_b = 1.25 of it = 1000 pi; V_b = 1.5 * 350 V."""
    b = load_motor(MOTORS / "paper").bases
    assert b.omega_rad_s == pytest.approx(3141.592654, rel=1e-9)
    assert b.voltage_V == pytest.approx(525.0, rel=1e-12)
    assert b.current_A == pytest.approx(400.0, rel=1e-12)
    assert b.flux_Vs == pytest.approx(0.16711269, rel=1e-7)
    assert b.resistance_ohm == pytest.approx(1.3125, rel=1e-12)
    assert b.inductance_H == pytest.approx(417.78173e-6, rel=1e-7)
    assert b.torque_Nm == pytest.approx(401.07046, rel=1e-7)
    assert b.period_s == pytest.approx(1e-4, rel=1e-12)


def test_hsm1_gets_a_higher_voltage_and_less_speed_reserve_so_that_its_flux_fits():
    """|psi| on the 250 A circle reaches 0.158 Vs: at 1.25 omega_max, 1.5 vdc would give psi_b = 0.134 Vs.

    omega_b = 1.05 * 1000 pi; 0.158 * 3299/0.97 = 537 V, so V_b = 540 V and psi_b = 0.1637 Vs.
    """
    b = load_motor(MOTORS / "hsm1").bases
    assert b.omega_rad_s == pytest.approx(1.05 * 1000 * math.pi, rel=1e-12)
    assert b.voltage_V == pytest.approx(540.0, rel=1e-12)
    assert b.flux_Vs == pytest.approx(0.163702, rel=1e-5)


@pytest.mark.parametrize("speed_max_rpm", [600.0, 300.0, 10.0])
def test_a_slow_machine_gets_a_speed_base_that_its_flux_and_the_gains_fit(write, speed_max_rpm):
    """|psi| is largest at i_d = 0, i_q = 250 A: hypot(84, 125) mVs. That is 0.3 of psi_b = 525 V/omega_b.

    The references begin below the largest MTPA flux although 0.6 V_dc at this speed would carry far more,
    and are as good as a fast machine's.
    """
    motor = load_motor(write(machine={"speed_max_rpm": speed_max_rpm}))
    assert motor.bases.omega_rad_s == pytest.approx(0.3 * 525.0 / math.hypot(0.084, 0.125), rel=1e-6)
    assert motor.bases.omega_rad_s >= motor.config.omega_max_rad_s * 1.25
    assert motor.references.psi_Vs[0] < motor.limits.psi_mtpa_Vs.max() < motor.bases.flux_Vs
    assert motor.reference_errors.torque_mtpa_max_Nm < 0.002 * motor.config.machine.torque_max_Nm
    motor_tables_c(motor)


def test_the_generated_bases_are_consistent_to_float_accuracy(motor):
    c = members(motor_tables_c(motor))
    eps = 2.0**-23
    assert c["flux_Vs"] == pytest.approx(c["voltage_V"] / c["omega_rad_s"], rel=2 * eps)
    assert c["resistance_ohm"] == pytest.approx(c["voltage_V"] / c["current_A"], rel=2 * eps)
    assert c["inductance_H"] == pytest.approx(c["resistance_ohm"] / c["omega_rad_s"], rel=2 * eps)
    poles = motor.config.machine.pole_pairs
    assert c["torque_Nm"] == pytest.approx(1.5 * poles * c["flux_Vs"] * c["current_A"], rel=3 * eps)


def test_nothing_within_the_current_circle_exceeds_one_per_unit(motor):
    b, t = motor.bases, motor.tables
    for d, row in zip(t.id_A, motor.model.psi_q(t.id_A[:, None], t.iq_A[None, :]), strict=True):
        for q, psi_q in zip(t.iq_A, row, strict=True):
            if d <= 0 and math.hypot(d, q) <= motor.config.machine.i_max_A:
                assert math.hypot(float(motor.model.psi_d(d, q)), psi_q) < b.flux_Vs
    assert motor.solver.torque_top_Nm < b.torque_Nm
    assert motor.derived.v_max_V < b.voltage_V


def test_the_over_current_trip_lies_above_i_max_and_below_80_percent_of_full_scale(motor):
    c = members(motor_tables_c(motor))
    assert c["i_max"] < c["i_trip"] < 0.8 * 32768


def test_current_control_gains_come_from_the_delay(motor):
    """T_d = 150 us: sigma = 1/(2 T_d) = 3333 rad/s; closed loop w_c = b sigma, zero a = (1 - b) sigma."""
    c = members(motor_tables_c(motor))
    sigma = c["sigma_q24"] / 2**24 * motor.bases.omega_rad_s
    assert sigma == pytest.approx(10000 / 3, rel=1e-4)
    b = c["setpoint_weight"] / 32768
    ratio = c["integral_gain"] / 32768 / (c["sigma_q24"] / 2**24)
    # a_i = w_c a T_s/sigma with w_c = b sigma, a = (1 - b) sigma; sigma T_s = 1/3.
    assert ratio == pytest.approx(b * (1 - b) / 3, rel=0.002)


def test_identification_gains_in_the_c_file_mean_what_motor_toml_says(motor):
    c, b, control = members(motor_tables_c(motor)), motor.bases, motor.config.control
    one = 2.0**31
    assert c["r0"] / one * b.resistance_ohm == pytest.approx(motor.config.machine.r_ohm, rel=1e-7)
    assert c["pole_gain"] / c["r0"] == pytest.approx(control.observer_m * 4, rel=1e-7)
    assert c["flux_gain"] / one * b.omega_rad_s / 2 == pytest.approx(control.flux_bandwidth_rad_s, rel=1e-6)
    assert c["resistance_gain"] / one * b.omega_rad_s / 2 == pytest.approx(control.resistance_bandwidth_rad_s, rel=1e-6)
    assert c["turn_to_pu"] / 65536 * (b.omega_rad_s * b.period_s / (2 * math.pi)) == pytest.approx(0.5, rel=1e-5)


def test_the_twins_file_has_the_same_numbers_unquantised(motor):
    c, b = members(motor_si_c(motor)), motor.bases
    assert c["i_base_A"] == b.current_A and c["v_base_V"] == b.voltage_V
    assert c["torque_step_Nm"] / b.torque_Nm == pytest.approx(2.0**motor.references.shift / 32768, rel=1e-12)
    assert c["did_A"] / b.current_A == pytest.approx(2.0**motor.tables.shift / 32768, rel=1e-12)
    assert c["id0_A"] == pytest.approx(-motor.config.machine.i_max_A, rel=1e-12)


def test_options_reach_the_tables(write):
    motor = load_motor(write(
        control={"torque_slew_Nm_per_s": 1000.0, "dead_time_compensation": 0.5, "torque_authority": 0.2},
        inverter={"device_drop_V": 1.75, "min_pulse_s": 4e-6}))  # fmt: skip
    c = members(motor_tables_c(motor))
    # Dead time: (0.02 + 1.75/350) half compensated.
    assert c["dead_time_q16"] / 65536 == pytest.approx(0.0125, abs=2**-15)
    # A pulse of 4 us in 100 us is 0.04: 0.5 less the whole pulse, and less half of it.
    assert c["longest_q31"] / 2**31 == pytest.approx(0.46, abs=2**-15)
    assert c["nearer_rail_q31"] / 2**31 == pytest.approx(0.48, abs=2**-15)
    assert c["torque_slew"] / 32768 * motor.bases.torque_Nm == pytest.approx(1.0, rel=0.01)
    assert c["authority"] / 32768 == pytest.approx(0.2, abs=2**-15)
    assert "Q15_MAX, /* open */" in motor_tables_c(load_motor(write(control={"torque_slew_Nm_per_s": 0.0})))


def test_without_a_slew_limit_given_all_the_torque_takes_ten_milliseconds(write):
    motor = load_motor(write())
    step_Nm = members(motor_tables_c(motor))["torque_slew"] / 32768 * motor.bases.torque_Nm
    assert 10 * step_Nm == pytest.approx(motor.config.machine.torque_max_Nm, rel=0.01)


def test_the_monitors_allow_for_the_spread_of_the_dead_time_at_every_frequency():
    """hsm1 at 40 kHz: 0.5 * 4/pi * (350 V * 2 us * 40 kHz + 1 V) = 18.462 V; at 10 kHz 5.1 V are below 2 % of 350 V."""
    fast = load_motor(MOTORS.parents[1] / "tests" / "motors" / "hsm1_40kHz").derived
    assert fast.monitor_V == pytest.approx(18.4620, abs=1e-4)
    assert fast.frozen_V == pytest.approx(18.4620 / 4.0, abs=1e-4)
    assert load_motor(MOTORS / "hsm1").derived.monitor_V == pytest.approx(7.0, rel=1e-12)
