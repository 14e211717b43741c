# SPDX-License-Identifier: Apache-2.0
"""The values drawn for a case lie in their ranges, fill them, and do not depend on the caller."""

import math

import numpy as np
import pytest

from fluxtrue_tools.campaign.case import make_plan
from fluxtrue_tools.campaign.drive import PHASES, STEP_S, make_profile
from fluxtrue_tools.campaign.envelope import NOTHING_WRONG, make_envelope
from fluxtrue_tools.campaign.machine import Machine, make_machine
from fluxtrue_tools.campaign.sample import draws, sample
from fluxtrue_tools.campaign.spec import Campaign, Nominal, Windows
from fluxtrue_tools.campaign.windows import plan

CASES = 300
FULL = Windows()


@pytest.fixture(scope="module")
def drawn(small: Campaign, machine: Machine) -> list[dict[str, float]]:
    return [sample(small, machine, draws(small.seed, case)).factors for case in range(CASES)]


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("lq_scale", 0.9, 1.1), ("ld_slope_scale", 0.9, 1.1), ("cross_saturation_scale", 0.8, 1.2),
        ("magnet_scale", 0.8, 1.05), ("resistance_scale", 0.9, 1.7), ("winding_error_C", -5.0, 5.0),
        ("dead_time_scale", 0.8, 1.2), ("device_drop_error_V", -0.5, 0.5), ("vdc_gain", 0.995, 1.005),
        ("current_gain_a", 0.995, 1.005), ("current_gain_c", 0.995, 1.005), ("current_offset_share_b", -0.002, 0.002),
        ("angle_offset_deg", -0.5, 0.5), ("angle_h1_deg", 0.0, 1.0), ("angle_h2_deg", 0.0, 1.0),
        ("iron_loss_scale", 0.7, 1.3), ("theta_m_rad", 0.0, 2.0 * math.pi),
    ],
)  # fmt: skip
def test_every_quantity_is_uniform_over_its_range(
    drawn: list[dict[str, float]], name: str, low: float, high: float
) -> None:
    share = (np.array([factors[name] for factors in drawn]) - low) / (high - low)
    assert share.min() >= 0.0
    assert share.max() <= 1.0
    # Kolmogorov's distance of 300 uniform draws stays below 1.95/sqrt(300) in 999 of 1000 seeds; this seed is fixed.
    steps = np.arange(1, CASES + 1) / CASES
    assert np.abs(np.sort(share) - steps).max() < 1.95 / math.sqrt(CASES)


def test_no_two_quantities_share_their_draws(drawn: list[dict[str, float]]) -> None:
    table = np.array([list(factors.values()) for factors in drawn])
    correlation = np.corrcoef(table.T) - np.eye(table.shape[1])
    # Of 325 pairs the largest of independent ones lies near 3.5/sqrt(300) = 0.2.
    assert np.abs(correlation).max() < 0.25


def test_a_case_is_the_same_in_a_campaign_of_any_size_and_another_one_in_another_campaign(
    small: Campaign, machine: Machine
) -> None:
    larger = small.model_copy(update={"cases": 999})
    assert make_plan(small, machine, 3).sample == make_plan(larger, machine, 3).sample
    assert make_plan(small, machine, 3).windows == make_plan(larger, machine, 3).windows
    other = small.model_copy(update={"seed": 8})
    assert make_plan(small, machine, 3).sample.factors != make_plan(other, machine, 3).sample.factors


def test_the_true_resistance_follows_the_scale_and_the_thermometer_its_error(small: Campaign, machine: Machine) -> None:
    for case in range(20):
        got = sample(small, machine, draws(small.seed, case))
        plant, factors = got.plant, got.factors
        at_told = plant["r_ohm_20"] * (1.0 + 0.00393 * (plant["winding_C"] - 20.0))
        assert at_told == pytest.approx(0.018 * factors["resistance_scale"], rel=1e-12)
        true_C = 20.0 + (factors["resistance_scale"] - 1.0) / 0.00393
        assert plant["winding_C"] == pytest.approx(true_C + factors["winding_error_C"])


def test_what_the_plant_gets_is_the_nominal_value_times_its_factor(small: Campaign, machine: Machine) -> None:
    got = sample(small, machine, draws(small.seed, 1))
    plant, factors = got.plant, got.factors
    assert plant["dead_time_s"] == pytest.approx(2e-6 * factors["dead_time_scale"])
    assert plant["device_drop_V"] == pytest.approx(machine.nominal.device_drop_V + factors["device_drop_error_V"])
    assert plant["current_offset_A_b"] == pytest.approx(400.0 * factors["current_offset_share_b"])
    assert plant["current_noise_A_rms"] == pytest.approx(0.8)
    assert plant["iron_k_e"] == pytest.approx(machine.nominal.iron_k_e * factors["iron_loss_scale"])
    assert plant["angle_h2_rad"] == pytest.approx(math.radians(factors["angle_h2_deg"]))
    assert plant.get("viscous_Nms", 0.0) == 0.0  # friction is not in the truth


def test_the_motors_own_nominal_values_go_before_those_of_the_campaign(small: Campaign, machine: Machine) -> None:
    # hsm1's motor.toml has all three; values in a campaign are for motors without them.
    assert (machine.nominal.device_drop_V, machine.nominal.iron_k_h, machine.nominal.iron_k_e) == (1.0, 13.0, 0.0103)
    other = small.model_copy(update={"nominal": Nominal(device_drop_V=3.0, iron_k_h=1.0)})
    assert make_machine(machine.motor.folder, other, "c.toml").nominal == machine.nominal


def test_the_windows_cover_four_quadrants_within_what_the_plant_can_give(machine: Machine) -> None:
    weak = NOTHING_WRONG | {"magnet_scale": 0.8, "lq_scale": 0.9}
    envelope = make_envelope(machine, weak)
    windows = plan(FULL, envelope, np.random.default_rng(1))
    assert len(windows) == 4 * (8 + 4 + 2)
    for window in windows:
        assert 10.0 <= abs(window.torque_Nm) <= envelope.at(window.speed_rpm)
        assert window.measure_s >= 0.2
        turns = window.measure_s * abs(window.speed_rpm) / 60.0
        assert turns == pytest.approx(round(turns), abs=1e-9)
    for direction in (1.0, -1.0):
        for sign in (1.0, -1.0):
            here = [w for w in windows if w.speed_rpm * direction > 0.0 and w.torque_Nm * sign > 0.0]
            assert len(here) == 14
            assert sum(300.0 <= abs(w.speed_rpm) <= 5000.0 for w in here) == 8
            assert sum(5000.0 < abs(w.speed_rpm) <= 10000.0 for w in here) == 4


def test_the_tour_of_the_windows_jumps_no_further_than_two_strata(machine: Machine) -> None:
    windows = plan(FULL, make_envelope(machine, NOTHING_WRONG), np.random.default_rng(2))
    speeds = [0.0] + [w.speed_rpm for w in windows]
    assert np.abs(np.diff(speeds)).max() < 3000.0


def test_a_weak_magnet_shrinks_the_envelope_and_a_strong_one_never_exceeds_what_the_firmware_plans(
    machine: Machine,
) -> None:
    nominal = make_envelope(machine, NOTHING_WRONG)
    weak = make_envelope(machine, NOTHING_WRONG | {"magnet_scale": 0.8})
    strong = make_envelope(machine, NOTHING_WRONG | {"magnet_scale": 1.05})
    # The largest torque at 250 A is 132.3 N·m; 3 % are kept as a margin.
    assert nominal.at(0.0) == pytest.approx(0.97 * 132.3, rel=2e-3)
    assert (weak.torque_Nm < nominal.torque_Nm).all()
    assert (strong.torque_Nm <= nominal.torque_Nm).all()
    assert (np.diff(nominal.torque_Nm) <= 1e-9).all()


def test_the_drive_lasts_as_asked_starts_and_ends_at_rest_and_reaches_the_cycles_top_speed(
    small: Campaign, machine: Machine
) -> None:
    drive = small.drive.model_copy(update={"duration_s": 60.0})
    envelope = make_envelope(machine, NOTHING_WRONG)
    profile = make_profile(drive, envelope, np.random.default_rng(3))
    assert profile.speed_rad_s.size == 60.0 / STEP_S + 1
    assert profile.speed_rad_s[0] == profile.speed_rad_s[-1] == 0.0
    # 131.3 km/h at 0.32 m and 9:1 are 1025.7 rad/s; random traffic and the time steps move it a little.
    assert profile.speed_rad_s.max() == pytest.approx(131.3 / 3.6 / 0.32 * 9.0, rel=0.03)
    speed_rpm = profile.speed_rad_s * 60.0 / (2.0 * math.pi)
    assert all(abs(t) <= envelope.at(n) + 1e-9 for t, n in zip(profile.torque_Nm, speed_rpm, strict=True))
    # Four trips: four times at rest between motion.
    moving = profile.speed_rad_s > 1.0
    assert np.count_nonzero(np.diff(moving.astype(int)) == 1) == len(PHASES)


def test_cruising_takes_the_road_load_and_accelerating_the_mass_on_top(small: Campaign) -> None:
    from fluxtrue_tools.campaign.drive import _torque

    vehicle = small.drive.vehicle
    # 20 m/s: 130 N + 0.4·400 N = 290 N; times 0.32 m / 9 = 10.31 N·m.
    assert _torque(np.full(50, 20.0), vehicle)[25] == pytest.approx(290.0 * 0.32 / 9.0, rel=1e-6)
    # + 1600 kg · 1 m/s² = 1600 N: 67.2 N·m at the instant of 20 m/s.
    rising = 20.0 + (np.arange(50) - 25) * STEP_S * 1.0
    assert _torque(rising, vehicle)[25] == pytest.approx(1890.0 * 0.32 / 9.0, rel=1e-6)
