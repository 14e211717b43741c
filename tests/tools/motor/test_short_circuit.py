# SPDX-License-Identifier: Apache-2.0
"""Currents and torque of the shorted machine, and what the report says about them."""

import math
import re

import numpy as np
import pytest
from conftest import GOOD, MOTORS

from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.report import report_text
from fluxtrue_tools.motor.short_circuit import short_circuit, used_from_rpm


def test_constant_inductances_give_the_closed_form(write):
    machine = GOOD["machine"]
    found = short_circuit(load_motor(write()))
    w = found.speed_rpm * machine["pole_pairs"] * 2 * math.pi / 60
    r, l_d, l_q, psi = (machine[key] for key in ("r_ohm", "ld_H", "lq_H", "psi_f_Vs"))
    below = r**2 + w**2 * l_d * l_q
    assert found.id_A == pytest.approx(-(w**2) * l_q * psi / below, abs=1e-6)
    assert found.iq_A == pytest.approx(-w * r * psi / below, abs=1e-6)


@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_the_braking_power_is_what_the_windings_take(name):
    motor = load_motor(MOTORS / name)
    found = short_circuit(motor)
    shaft = found.torque_Nm * found.speed_rpm * 2 * math.pi / 60
    assert shaft == pytest.approx(-1.5 * motor.config.machine.r_ohm * found.current_A**2, rel=1e-6, abs=1e-6)


def test_the_drive_shorts_the_phases_above_nine_tenths_of_the_dc_voltage():
    motor = load_motor(MOTORS / "hsm1")
    speed = used_from_rpm(motor)
    emf = math.sqrt(3) * motor.derived.psi_f_Vs * speed * motor.config.machine.pole_pairs * 2 * math.pi / 60
    assert emf == pytest.approx(0.9 * motor.config.inverter.vdc_V)


def test_a_short_circuit_that_brakes_harder_than_the_drive_is_said_with_its_speeds(write):
    # A weak drive for its machine: the current circle is small against the magnet.
    motor = load_motor(write(machine={"i_max_A": 60.0, "torque_max_Nm": 28.0}))
    found = short_circuit(motor)
    harder = found.speed_rpm[found.torque_Nm < -28.0]
    assert len(harder) > 10
    assert f"between {harder[0]:.0f} and {harder[-1]:.0f} rpm" in report_text(motor)
    assert "brakes harder" not in report_text(load_motor(write()))


def test_the_text_has_the_braking_torque_over_speed(write):
    """By the closed form of constant inductances: T = -1.5 p R i²/w_e."""
    text = report_text(load_motor(write()))
    line = re.search(r"over speed +(.*)", text)[1]
    found = {float(rpm): float(torque) for torque, rpm in re.findall(r"([\d.]+) N·m at (\d+) rpm", line)}
    assert list(found) == [300.0, 600.0, 1500.0, 3000.0, 4500.0, 6000.0]
    machine = GOOD["machine"]
    r, l_d, l_q, psi = (machine[key] for key in ("r_ohm", "ld_H", "lq_H", "psi_f_Vs"))
    for rpm, torque_Nm in found.items():
        w = rpm * machine["pole_pairs"] * 2 * math.pi / 60
        below = r**2 + w**2 * l_d * l_q
        i_squared = ((w**2 * l_q * psi) ** 2 + (w * r * psi) ** 2) / below**2
        assert torque_Nm == pytest.approx(1.5 * machine["pole_pairs"] * r * i_squared / w, rel=0.01)
    assert re.search(r"active short circuit: 4\d\d\.?\d* A at 6000 rpm", text)


def test_where_the_short_circuit_is_the_safe_state_although_it_brakes_hard_the_text_says_why(write):
    """A high resistance moves the largest braking torque to high speed: at R = w sqrt(L_d L_q)."""
    machine = {"r_ohm": 0.4, "i_max_A": 60.0, "torque_max_Nm": 20.0, "speed_max_rpm": 9000.0}
    motor = load_motor(write(machine=machine))
    used = used_from_rpm(motor)
    found = short_circuit(motor)
    assert found.torque_at(used) < -20.0
    text = report_text(motor)
    assert f"above {used:.0f} rpm a fault shorts the phases all the same" in text
    assert "all the same" not in report_text(load_motor(write(machine={"i_max_A": 60.0, "torque_max_Nm": 28.0})))


def test_a_machine_that_never_reaches_the_dc_voltage_is_not_shorted_at_speed(write):
    motor = load_motor(write(machine={"speed_max_rpm": 3000.0}))
    assert used_from_rpm(motor) > 3000.0
    text = report_text(motor)
    assert "only after a gate-driver fault, or an over-voltage while the machine charges the link" in text
    assert "up to speed_max_rpm the back-EMF stays below 1.06 vdc_V" in text
    assert np.all(np.diff(short_circuit(motor).speed_rpm) > 0)
