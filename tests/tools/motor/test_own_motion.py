# SPDX-License-Identifier: Apache-2.0
"""Numbers that follow from how the rotor moves, how finely its angle is known, and how noisy its currents are."""

import math
import re
from functools import cache
from pathlib import Path

import pytest

from fluxtrue_tools.motor.emit_c import motor_tables_c
from fluxtrue_tools.motor.motor import Motor, load_motor

ROOT = Path(__file__).resolve().parents[3]
CREEPING_DROP_V = {"ebike": 0.2006, "anaheim": 0.8382}


@cache
def named(name: str) -> Motor:
    return load_motor(next(ROOT / place / name for place in ("firmware/motors", "tests/motors")
                           if (ROOT / place / name).exists()))  # fmt: skip


def test_a_rotor_that_accelerates_slowly_needs_no_more_than_the_usual_tracker() -> None:
    """hsm1: 3·132 N·m/0.05 kg·m² and less is far below 0.6·2 pi/20·300² = 16,965 rad/s²."""
    derived = named("hsm1").derived
    assert (derived.tracker_bandwidth_rad_s, derived.tracker_jump_turns) == (300.0, 1 / 20)


def test_the_lag_of_a_rotor_with_all_its_torque_is_60_percent_of_a_jump() -> None:
    derived = named("servo").derived  # 160,000 rad/s²
    assert derived.tracker_bandwidth_rad_s == pytest.approx(921.3, abs=0.5)
    assert derived.tracker_jump_turns == 1 / 20
    lag = 160e3 / derived.tracker_bandwidth_rad_s**2 / (2.0 * math.pi)
    assert lag == pytest.approx(0.6 * derived.tracker_jump_turns, rel=1e-6)


@pytest.mark.parametrize(("inertia_kgm2", "jump_turns"), [(6e-3, 0.4 / 0.6 / (2.0 * math.pi)), (3e-3, 1 / 8)])
def test_a_faster_rotor_has_a_tracker_of_a_sixteenth_of_the_pwm_and_a_wider_jump(
    write, inertia_kgm2: float, jump_turns: float
) -> None:
    """4·150 N·m at 8 kHz, lags of 0.4 and 0.8 rad; the jump is the lag/0.6, at most an eighth of a turn."""
    motor = load_motor(write(machine={"inertia_kgm2": inertia_kgm2}, inverter={"pwm_hz": 8000.0}))
    assert motor.derived.tracker_bandwidth_rad_s == 500.0
    assert motor.derived.tracker_jump_turns == pytest.approx(jump_turns, rel=1e-9)


@pytest.mark.parametrize(("name", "v_theta", "v_inverter"), [("hsm1", 0.0, 0.7), ("ebike", 0.192, 0.096 + 0.1003)])
def test_the_launch_monitor_allows_for_the_resolution_of_the_angle(
    name: str, v_theta: float, v_inverter: float
) -> None:
    """(MN-34) by hand: 0.3·2 pi·3/4096·71.7 mV·s/1 ms is 0.099 V, less than 0.03 of V_0 = 7 V; with 20 pole pairs and
    24 mV·s it is 0.221 V, of which 0.03 of V_0 = 0.96 V leaves 0.192 V."""
    motor = named(name)
    emitted = int(re.search(r"\.v_1 = (\d+),", motor_tables_c(motor))[1])
    volts = emitted / motor.bases.periods_per_step / 2**15 * motor.bases.voltage_V
    half_a_count = 0.5 * motor.bases.voltage_V / 2**15
    assert volts - motor.derived.launch_V == pytest.approx(v_theta, abs=half_a_count + 0.001)
    assert motor.derived.launch_V == pytest.approx(v_inverter, abs=1e-3)


@pytest.mark.parametrize(("name", "noise_V"), [("hsm1", 0.0), ("pmsyrm", 1.08 * 9.34 - 2.7), ("ebike", 0.0)])
def test_the_monitors_of_a_slow_rotor_allow_for_noise_that_the_current_follows(name: str, noise_V: float) -> None:
    """(MN-35) by hand: 156 mH·0.002·30 A/1 ms = 9.34 V; V_0/4 = 0.5 % of 540 V."""
    derived = named(name).derived
    drop_V = CREEPING_DROP_V.get(name, 0.0)
    assert derived.monitor_noise_V == pytest.approx(noise_V, abs=0.02)
    assert derived.launch_V == pytest.approx(derived.monitor_V / 10.0 + noise_V + drop_V / 2.0, abs=0.02)
    assert derived.frozen_V == pytest.approx(derived.monitor_V / 4.0 + noise_V + drop_V, abs=0.02)


@pytest.mark.parametrize(("name", "drop_V"), [("hsm1", 0.0), ("servo", 0.0), *CREEPING_DROP_V.items()])
def test_the_monitors_of_a_slow_rotor_allow_for_a_reference_that_creeps(name: str, drop_V: float) -> None:
    """(MN-40) by hand, windings at their trip: sqrt(2)·60 mΩ·1.6288·2.32 A - 0.12 V, sqrt(2)·464 mΩ·1.8253·0.8 A -
    0.12 V."""
    derived = named(name).derived
    noise_V = derived.monitor_noise_V
    assert derived.frozen_V - derived.monitor_V / 4.0 - noise_V == pytest.approx(drop_V, abs=0.003)
    assert derived.launch_V - derived.monitor_V / 10.0 - noise_V == pytest.approx(drop_V / 2.0, abs=0.003)


@pytest.mark.parametrize(("name", "noise_V"), [("hsm1", 0.0), ("pmsyrm", 4.0 / 3.0 * 24.9 - 10.8), ("ebike", 0.0)])
def test_the_angle_monitor_allows_for_noise_that_current_control_amplifies(name: str, noise_V: float) -> None:
    """(MN-36) by hand: 8 kHz/3·156 mH·0.002·30 A = 24.9 V; V_0 = 2 % of 540 V."""
    assert named(name).derived.period_noise_V == pytest.approx(noise_V, abs=0.05)
