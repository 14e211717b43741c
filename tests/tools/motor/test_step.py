# SPDX-License-Identifier: Apache-2.0
"""The step of the 1 kHz task at other PWM frequencies: its length, and what is counted in it."""

import math
import re
import tomllib
from pathlib import Path

import pytest

from fluxtrue_tools.motor.bases import periods_per_step
from fluxtrue_tools.motor.emit_c import motor_si_c, motor_tables_c
from fluxtrue_tools.motor.motor import load_motor

ROOT = Path(__file__).resolve().parents[3]
HSM1 = ROOT / "firmware" / "motors" / "hsm1"
SLEW = {"control": {"torque_slew_Nm_per_s": 1000.0, "torque_loop_bandwidth_rad_s": 40.0}}


def literals(text):
    """{member: literal} of the generated struct; the first of equal names."""
    return dict(reversed(re.findall(r"\.(\w+) = (-?[0-9][0-9.e+-]*)[fu]?,", text)))


@pytest.fixture
def generated(write):
    """Members of both files, for a machine that is accepted at every frequency."""

    def _generated(pwm_hz, **changes):
        inverter = {"pwm_hz": pwm_hz, "current_full_scale_A": 1200.0, "dead_time_s": 1e-6}
        motor = load_motor(write(machine={"speed_max_rpm": 3000.0}, inverter=inverter, **changes))
        return literals(motor_tables_c(motor)), literals(motor_si_c(motor)), motor

    return _generated


@pytest.mark.parametrize("pwm_hz", [4000.0, 4400.0, 4600.0, 5000.0, 7777.0, 10000.0, 22500.0, 33333.0, 40000.0])
def test_a_step_is_the_number_of_periods_nearest_to_a_millisecond(pwm_hz):
    n = periods_per_step(pwm_hz)
    assert 4 <= n <= 40
    assert all(abs(n / pwm_hz - 1e-3) <= abs(k / pwm_hz - 1e-3) for k in range(1, 100))


def test_every_length_of_a_step_is_within_an_eighth_of_a_millisecond():
    steps = [periods_per_step(pwm_hz) / pwm_hz for pwm_hz in range(4000, 40001)]
    assert min(steps) == pytest.approx(4 / 4499, rel=2e-2)
    assert 0.888e-3 < min(steps) < max(steps) < 1.125e-3 + 1e-9


# 22.5 and 4.5 periods per millisecond lie in the middle between two whole numbers: the larger one is taken.
@pytest.mark.parametrize(("pwm_hz", "n", "step_s"), [(22500.0, 23, 23 / 22500), (4500.0, 5, 5 / 4500),
                                                      (8000.0, 8, 1e-3)])  # fmt: skip
def test_rates_and_gains_are_those_of_the_true_step(generated, pwm_hz, n, step_s):
    """Slew 1000 N·m/s, torque loop 40 rad/s, loss filter 20 ms, quality 50 ms, local flux error 20 ms, leaks per s."""
    c, si, motor = generated(pwm_hz, **SLEW)
    b = motor.bases
    assert (int(c["periods_per_step"]), float(c["step_s"])) == (n, pytest.approx(step_s, rel=1e-7))
    assert (int(si["periods_per_step"]), float(si["step_s"])) == (n, pytest.approx(step_s, rel=1e-12))
    assert int(c["torque_slew"]) == pytest.approx(1000.0 * step_s / b.torque_Nm * 2**15, abs=0.51)
    assert int(c["ki"]) == pytest.approx(40.0 * step_s * 2**15, abs=0.51)
    assert int(c["loss_rate"]) == pytest.approx((1 - math.exp(-step_s / 0.02)) * 2**15, abs=0.51)
    assert int(c["quality_rate"]) == pytest.approx((1 - math.exp(-step_s / 0.05)) * 2**15, abs=0.51)
    assert int(c["local_rate"]) == pytest.approx((1 - math.exp(-step_s / 0.02)) * 2**31, abs=0.51)
    assert int(c["confidence_rate"]) == pytest.approx(10 * step_s / 0.5 * 2**15, abs=0.51)
    assert motor.derived.identify.leak == pytest.approx([x * 10 * step_s for x in (0.02, 0.02, 0.01, *[0.003] * 4)])
    assert int(c["mean_gain_q32"]) == pytest.approx(2**32 / (2 * n), abs=0.51)
    assert int(c["limited_noise"]) == pytest.approx(5 / n * 2**16, abs=0.51)
    # a quarter and a tenth, in 1 and 10 ms
    assert int(c["mean_rate"]) == pytest.approx((1 - 0.75 ** (1e3 * step_s)) * 2**15, abs=0.51)
    assert int(c["mismatch_rate"]) == pytest.approx((1 - 0.9 ** (1e3 * step_s)) * 2**15, abs=0.51)


# 30 ms are 33.7 steps of 0.889 ms: 34.
@pytest.mark.parametrize(("pwm_hz", "step_s"), [(4499.0, 4 / 4499), (4500.0, 5 / 4500), (10000.0, 1e-3),
                                                (16400.0, 16 / 16400)])  # fmt: skip
def test_debouncing_counts_cover_their_times_and_no_step_more(generated, pwm_hz, step_s):
    """The times in ms are those of docs/theory/monitors.md and commissioning.md."""
    c, _, motor = generated(pwm_hz)
    times_ms = {"deviation": 100, "lost": 8, "ripple": 20, "equal": 20, "fast": 5, "hot": 110, "torque": 20,
                "angle": 5, "settle": 5, "gate_exceeded": 70, "measure": 64, "trim": 1000}  # fmt: skip
    for name, ms in times_ms.items():
        count = int(c[f"{name}_steps"])
        assert ms - 1e-3 <= 1e3 * count * step_s < ms + 1e3 * step_s, name
    periods = int(c["measure_steps"]) * motor.bases.periods_per_step
    assert int(c["mean_gain_q31"]) == pytest.approx(2**31 / periods, abs=0.51)


def test_at_10_kHz_the_counts_are_the_milliseconds(generated):
    c, _, _ = generated(10000.0)
    names = ("deviation", "lost", "equal", "fast", "hot", "torque", "angle", "settle", "measure", "trim")
    assert [int(c[f"{name}_steps"]) for name in names] == [100, 8, 20, 5, 110, 20, 5, 5, 64, 1000]
    assert (int(c["mean_gain_q32"]), int(c["mean_gain_q31"])) == (214748365, 3355443)


@pytest.mark.parametrize("pwm_hz", [4000.0, 4499.0, 40000.0])
def test_a_slow_machine_with_much_flux_keeps_its_rate_of_flux_in_32_bits(write, pwm_hz):
    """0.45 * 48 V/0.33 Vs = 65 rad/s would be the speed base: 1/(omega_b T) = 15 in Q28 needs 33 bits."""
    machine = {"speed_max_rpm": 20.0, "psi_f_Vs": 0.3, "r_ohm": 0.002, "torque_max_Nm": 300.0}
    inverter = {"pwm_hz": pwm_hz, "current_full_scale_A": 1200.0, "dead_time_s": 1e-6, "vdc_V": 48.0}
    motor = load_motor(write(machine=machine, inverter=inverter))
    c = literals(motor_tables_c(motor))
    assert 0 < int(c["rate_gain_q28"]) < 2**31
    assert int(c["rate_gain_q28"]) == pytest.approx(2**28 / (motor.bases.omega_rad_s * motor.bases.step_s), abs=0.51)


def test_the_fastest_machine_keeps_its_turns_in_a_step_in_32_bits(write):
    """1.19 rad per period at 40 kHz are 7.58 turns in a step: Q29, no sign, holds 8, so the speed reserve is 5 %."""
    machine = {"speed_max_rpm": 1.19 * 40000.0 * 60 / (2 * math.pi * 4), "psi_f_Vs": 0.005, "torque_max_Nm": 5.0}
    inverter = {"pwm_hz": 40000.0, "dead_time_s": 1e-6, "current_full_scale_A": 500.0}
    motor = load_motor(write(machine=machine, inverter=inverter))
    c = literals(motor_tables_c(motor))
    turns = motor.bases.omega_rad_s * motor.bases.step_s / (2 * math.pi)
    assert 7.9 < turns < 8.0
    assert 2**31 < int(c["window_turns_q29"]) < 2**32
    assert int(c["window_turns_q29"]) == pytest.approx(2**29 * turns, abs=0.51)


def test_the_model_of_the_torque_loop_waits_for_the_current_loop_of_its_own_frequency(generated):
    """(TL-11): 1/rate = 1 + (3.75 periods + 0.2917 ms)/T; 0.6 at 10 kHz."""
    for pwm_hz, missing_ms in ((5000.0, 3.75 / 5 + 0.291667), (10000.0, 0.666667), (40000.0, 3.75 / 40 + 0.291667)):
        c, _, _ = generated(pwm_hz)
        assert int(c["model_rate"]) == pytest.approx(2**15 / (1.0 + missing_ms), abs=0.6)


@pytest.mark.parametrize("khz", ["5", "8", "16", "20", "22.5", "40"])
def test_the_machines_at_other_frequencies_are_hsm1_in_everything_else(khz):

    def flat(path):
        tables = tomllib.loads(path.read_text(encoding="utf-8")).values()
        return {key: value for table in tables for key, value in table.items()}

    machine = flat(ROOT / "tests" / "motors" / f"hsm1_{khz}kHz" / "motor.toml")
    assert (ROOT / "tests/motors/hsm1_5kHz" / machine["flux_map"]).resolve() == HSM1 / "flux_map.csv"
    expected = flat(HSM1 / "motor.toml") | {
        "name": f"hsm1_{khz}kHz",
        "pwm_hz": 1e3 * float(khz),
        "flux_map": machine["flux_map"],
    }
    assert machine == expected
