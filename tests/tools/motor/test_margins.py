# SPDX-License-Identifier: Apache-2.0
"""Margins of both laws of current control, computed from the generator's constants: docs/theory/current-control.md."""

import math

import numpy as np
import pytest
from conftest import MOTORS, ROOT

from fluxtrue_tools.motor.config import ANGLE_PER_PERIOD_MAX, ANGLE_TURNING
from fluxtrue_tools.motor.current_loop import INTEGRAL, SIGMA, CurrentLoop, current_loop, turning, usual
from fluxtrue_tools.motor.derived import (
    CLOSED_LOOP_SHARE,
    LOOP_MISSING_PERIODS,
    MEASURED_SHARE,
    TURNING_APPROACH,
    TURNING_FEEDBACK,
    TURNING_INTEGRAL,
    frozen_settle_s,
)
from fluxtrue_tools.motor.emit_c import knee_turns_q27
from fluxtrue_tools.motor.loop_report import PHASE_MARGIN_MIN_DEG, lowest_margins, model_lines
from fluxtrue_tools.motor.motor import load_motor

INVENTED = ROOT / "tests" / "motors"
SLOPES = (1 / 1.25, 1.0, 1 / 0.75)  # tables over machine: inductances of 125, 100 and 75 % of the data
LOSSES = (0.0, 0.02, 0.1)  # decay of the flux on the resistance per period
DRIVES = {folder.name: folder for folder in (*sorted(MOTORS.iterdir()), *sorted(INVENTED.iterdir()))
          if (folder / "motor.toml").exists()}  # fmt: skip
TURNING_RPM = 0.5 * 10000.0 * 60 / (2 * math.pi * 4)  # half a radian per period with four pole pairs at 10 kHz
# As in the document: phase margins of both, largest sensitivity, largest table slope over the true one.
TABLE = {0.0: (52, 57, 1.50, 3.5), 0.2: (30, 48, 1.57, 3.3), 0.4: (17, 44, 1.63, 3.2), 0.6: (9, 48, 1.63, 3.1),
         0.8: (4, 57, 1.68, 2.5), 1.0: (None, 56, 1.76, 2.3), 1.2: (None, 57, 1.77, 2.3)}  # fmt: skip


def test_the_phase_margin_of_the_law_for_turning_fields_is_40_degrees_and_more_at_every_speed() -> None:
    for theta in np.arange(-ANGLE_PER_PERIOD_MAX, ANGLE_PER_PERIOD_MAX + 0.01, 0.02):
        margin, sensitivity = turning(theta).margins()
        assert margin >= PHASE_MARGIN_MIN_DEG, theta
        assert sensitivity < 1.8, theta
        assert turning(theta).largest_pole() < 0.952, theta


def test_inductances_wrong_by_half_in_either_direction_keep_the_loop_stable() -> None:
    for theta in np.arange(0.0, ANGLE_PER_PERIOD_MAX + 0.01, 0.05):
        assert all(turning(theta, slope).largest_pole() < 0.995 for slope in (0.5, 0.75, 1.25, 1.5, 2.0)), theta


@pytest.mark.parametrize("theta", TABLE)
def test_the_documents_table(theta: float) -> None:
    before, margin, sensitivity, slope = TABLE[theta]
    law = usual(theta, share=1.0)
    if before is None:
        assert law.largest_pole() > 1.0
    else:
        assert law.margins()[0] == pytest.approx(before, abs=0.6)
    assert turning(theta).margins() == (pytest.approx(margin, abs=1.0), pytest.approx(sensitivity, abs=0.01))
    assert turning(theta, slope).largest_pole() < 1.0 < turning(theta, slope + 0.15).largest_pole()


@pytest.mark.parametrize("slope", SLOPES)
def test_either_law_keeps_40_degrees_where_it_is_used_with_inductances_25_percent_off(slope: float) -> None:
    """At every speed and for every machine: the resistance alone differs between machines."""
    for law, last in ((usual, ANGLE_TURNING), (turning, ANGLE_PER_PERIOD_MAX)):
        for theta in np.arange(0.0, last + 0.005, 0.01 if law is usual else 0.05):
            for loss in LOSSES:
                for direction in (-1.0, 1.0):
                    loop = law(direction * theta, slope=slope, loss=loss)
                    assert loop.margins(4001)[0] >= PHASE_MARGIN_MIN_DEG, (law.__name__, theta, loss)
                    assert loop.largest_pole() < 0.97, (law.__name__, theta, loss)


@pytest.mark.parametrize("name", DRIVES)
def test_every_machine_keeps_40_degrees_over_speed_and_inductance(name: str) -> None:
    found = lowest_margins(load_motor(DRIVES[name]))
    assert found is not None
    print(f"{name}: {found}")
    assert found.phase_deg >= PHASE_MARGIN_MIN_DEG
    assert found.gain_dB >= 4.5


def test_the_report_names_the_lowest_margin() -> None:
    assert model_lines(load_motor(MOTORS / "hsm1"))[-1] == (
        "  lowest             43° (10000 rpm, L -25 %), 6.2 dB, over speed, L ±25 % and all four quadrants; "
        "40° are demanded"
    )


# As in the document, all of the rotational voltage by the measured flux and the law's share of it: phase margins with
# the data's inductances and with 25 % less; overshoot, and movement of the other axis, with 20 % less, in %.
FALL = {0.0: ((52, 45, 4.6, 0.0), (52, 45, 4.6, 0.0)), 0.1: ((40, 33, 4.9, 10.4), (51, 45, 5.2, 6.7)),
        0.2: ((30, 22, 8.2, 20.6), (49, 43, 7.1, 13.1)), 0.314: ((21, 12, 18.8, 35.7), (47, 42, 11.1, 19.4)),
        0.35: ((19, 9, 22.4, 41.6), (46, 41, 12.3, 21.1))}  # fmt: skip


def usual_step(theta: float, share: float, slope: float) -> tuple[float, float]:
    """Of a step of psi_q within one period by section 3: overshoot and largest change of psi_d, in %."""
    rest = (1.0 - share) * theta
    weight = CLOSED_LOOP_SHARE if share < 1.0 else 1.0
    psi = acts = s = 0.0j
    moved = []
    for _ in range(150):
        seen = slope * psi
        u = SIGMA * (CLOSED_LOOP_SHARE * 1j - seen) + s + 1j * (share * theta * seen + rest * weight * 1j)
        s += INTEGRAL * (SIGMA + 1j * rest) * (1j - seen)
        psi, acts = np.exp(-1j * theta) * psi + np.exp(-0.5j * theta) * acts, u
        moved.append(slope * psi)
    return 100 * max(x.imag for x in moved) - 100, 100 * max(abs(x.real) for x in moved)


@pytest.mark.parametrize("theta", FALL)
def test_the_documents_table_of_the_usual_law(theta: float) -> None:
    for share, (margin, smaller, overshoot_percent, moved) in zip((1.0, MEASURED_SHARE), FALL[theta], strict=True):
        assert usual(theta, share).margins()[0] == pytest.approx(margin, abs=0.6)
        assert usual(theta, share, slope=1 / 0.75).margins()[0] == pytest.approx(smaller, abs=0.6)
        assert usual_step(theta, share, 1.25) == (pytest.approx(overshoot_percent, abs=0.1),
                                                  pytest.approx(moved, abs=0.1))  # fmt: skip
    assert usual(theta).largest_pole() == pytest.approx(0.9355, abs=0.001)
    assert usual_step(theta, MEASURED_SHARE, 1.0)[0] < 0.2


def test_no_gain_keeps_the_margin_while_all_of_the_feed_forward_follows_the_measured_flux() -> None:
    """Gain scheduling alone: at 0.314 rad and with 25 % less inductance."""
    laws = [usual(0.314, 1.0, sigma=sigma, slope=1 / 0.75) for sigma in np.arange(0.02, 0.6, 0.02)]
    assert max(law.margins(2001)[0] for law in laws if law.largest_pole() < 1.0) == pytest.approx(12.0, abs=0.2)


def test_the_firmware_has_the_share_of_the_model() -> None:
    source = (ROOT / "firmware" / "control" / "current" / "current_control.h").read_text(encoding="utf-8")
    assert f"#define MEASURED_SHARE_Q5 {32 * MEASURED_SHARE:g} " in source


def test_with_all_of_the_feed_forward_from_the_measured_flux_the_loop_would_end_before_one_radian() -> None:
    assert usual(0.8, share=1.0).largest_pole() < 1.0 < usual(0.9, share=1.0).largest_pole()


def test_no_share_of_the_feed_forward_and_no_advance_replace_the_other_law() -> None:
    for share in np.arange(0.0, 1.01, 0.1):
        for advance in np.arange(-1.5, 1.01, 0.25):
            for sigma in (SIGMA, 0.28, 0.22):
                laws = [usual(theta, share, advance, sigma) for theta in (0.0, 0.4, 0.8, 1.2)]
                assert min(law.margins(2001)[0] if law.largest_pole() < 1.0 else 0.0 for law in laws) < 35.0


def test_a_motor_has_the_law_that_its_firmware_has() -> None:
    hsm1 = load_motor(MOTORS / "hsm1")
    top = hsm1.config.omega_max_rad_s / hsm1.config.inverter.pwm_hz
    assert not hsm1.config.is_turning
    at_top = current_loop(hsm1, hsm1.config.machine.speed_max_rpm).margins()
    assert at_top == pytest.approx(usual(top).margins(), rel=0.1)  # the difference is the resistance
    assert current_loop(hsm1, 0.0, 0.75).margins()[0] < current_loop(hsm1, 0.0, 1.25).margins()[0]


def test_the_resistance_damps_and_the_drop_that_is_added_undoes_it() -> None:
    assert usual(0.0, loss=0.02).largest_pole() == pytest.approx(0.940, abs=0.001)  # (CC-9), rho = 0.06
    lossy = CurrentLoop(0.3, SIGMA, 0.01, loss=0.05)
    assert lossy.gain(np.array([1.0 + 1e-6])) == pytest.approx(
        (1 - math.exp(-0.05)) / 0.05 * (SIGMA + 1e4) / (1.0 - np.exp(-0.3j - 0.05)), rel=1e-4
    )
    assert turning(0.3, loss=0.01).margins()[0] == pytest.approx(turning(0.3).margins()[0], abs=1.0)


def overshoot(theta: float, slope: float) -> float:
    """Of a step of psi_q within one period, by section 8 with R = 0."""
    half, k = np.exp(0.5j * theta), TURNING_FEEDBACK * np.exp(-1.5j * theta)
    psi = acts = s = now = coming = largest = 0.0j
    for _ in range(150):
        deviation = now - psi
        after = coming + TURNING_APPROACH * (1j - coming)
        u = half * after - coming / half + k * deviation + s
        s += TURNING_INTEGRAL * (k + 2j * math.sin(0.5 * theta)) * deviation
        now, coming = coming, after
        psi, acts = (psi / half + slope * acts) / half, u
        largest = max(largest.real, psi.imag)
    return largest - 1.0


def test_inductances_20_percent_too_small_overshoot_by_less_than_5_percent() -> None:
    for theta in np.arange(-ANGLE_PER_PERIOD_MAX, ANGLE_PER_PERIOD_MAX + 0.01, 0.05):
        assert overshoot(theta, 1.0) < 0.001
        assert overshoot(theta, 1.25) < 0.045, theta


def test_where_the_field_turns_far_the_compensation_feeds_a_deviation_back_by_less_than_the_law(write) -> None:
    """(MO-12) with 0.2 mH and an error of 8 V: what is turned by 1.5 theta is fed back by k_0 or less."""
    motor = load_motor(write(machine={"speed_max_rpm": TURNING_RPM}, inverter={"device_drop_V": 1.0}))
    assert motor.config.is_turning
    assert motor.derived.knee_A == pytest.approx(4 * 800.0 / 4096)
    gain = knee_turns_q27(motor)
    for theta in (0.1, 0.35, 0.5):
        knee_A = 2**17 * motor.bases.current_A / (gain / (theta / (2 * math.pi) * 1024))
        assert 1.5 * theta * 8.0 * 1e-4 / (knee_A * 0.2e-3) == pytest.approx(TURNING_FEEDBACK, rel=1e-6)


def test_without_an_error_of_the_inverter_the_knee_stays_as_it_is(write) -> None:
    motor = load_motor(write(machine={"speed_max_rpm": TURNING_RPM}, inverter={"dead_time_s": 0.0}))
    assert knee_turns_q27(motor) == 2**31 - 1


def test_the_monitor_of_a_frozen_angle_waits_for_the_slower_answer(write) -> None:
    """At 5 kHz five times 2.5 ms and, with 300 rad/s of a heavy rotor, five times 3.33 ms of the tracked speed."""
    turning_rpm = TURNING_RPM / 2.0
    heavy = {"inertia_kgm2": 10.0}
    waits = [
        frozen_settle_s(load_motor(write(machine=heavy | {"speed_max_rpm": rpm}, inverter={"pwm_hz": pwm_hz})).config)
        for rpm, pwm_hz in ((TURNING_RPM, 10000.0), (turning_rpm, 5000.0), (0.5 * turning_rpm, 5000.0))
    ]
    assert waits == [0.01, pytest.approx(0.0125 + 5.0 / 300.0), 0.01]


def test_planned_voltage_and_trim_stay_in_the_linear_range(write) -> None:
    derived = load_motor(write()).derived
    assert derived.ref_v_ratio + derived.trim_max_ratio == pytest.approx(1 / math.sqrt(3))


def test_the_torque_loop_and_the_monitor_of_the_current_know_the_slower_answer(write) -> None:
    usual_motor = load_motor(write())
    turning_motor = load_motor(write(machine={"speed_max_rpm": TURNING_RPM}))
    for drive, periods in ((usual_motor, LOOP_MISSING_PERIODS), (turning_motor, 13.5)):
        period_ms = 1e3 * drive.bases.period_s
        step_ms = 1e3 * drive.bases.step_s
        derived = drive.derived
        missing_ms = periods * period_ms + 0.291667
        assert derived.torque_model_rate == pytest.approx(step_ms / (step_ms + missing_ms), rel=1e-4)
    assert usual_motor.derived.answer_rate == 1.0
    assert turning_motor.derived.answer_rate == pytest.approx(1.0 - 0.92**10)
