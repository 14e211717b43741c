# SPDX-License-Identifier: Apache-2.0
"""The robust identification on drives with many deviations at once. The torque is that of the plant."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

RPM = 2.0 * math.pi / 60.0
ROW_S = 1e-3
RATED_NM = 132.0
COLUMNS = ("truth.torque_mean_Nm", "torque_estimated_Nm", "psi_f_Vs", "torque_confidence", "torque_correction",
           "voltage_limited", "fault_word")  # fmt: skip
TORQUE, ESTIMATE, PSI, CONFIDENCE, CORRECTION, LIMITED, FAULT = range(len(COLUMNS))

# Two drives with opposite deviations of tables, magnet, winding, inverter, sensors and iron loss.
SOFT = {"lq_scale": 0.92, "ld_slope_scale": 1.08, "cross_saturation_scale": 1.15, "magnet_scale": 0.85,
        "winding_C": 110.0, "r_ohm_20": 0.0183, "dead_time_s": 2.3e-6, "device_drop_V": 1.3, "vdc_gain": 1.003,
        "current_gain_a": 1.004, "current_gain_c": 0.998, "current_offset_A_b": 0.5, "current_noise_A_rms": 0.8,
        "angle_offset_rad": 0.006, "angle_h1_rad": 0.008, "iron_k_h": 16.0, "iron_k_e": 0.0127}  # fmt: skip
STIFF = {"lq_scale": 1.08, "ld_slope_scale": 0.93, "cross_saturation_scale": 0.85, "magnet_scale": 1.03,
         "winding_C": 30.0, "r_ohm_20": 0.0177, "dead_time_s": 1.7e-6, "device_drop_V": 0.6, "vdc_gain": 0.997,
         "current_gain_b": 0.997, "current_offset_A_a": -0.5, "current_noise_A_rms": 0.8,
         "angle_offset_rad": -0.006, "angle_h2_rad": 0.008, "iron_k_h": 10.0, "iron_k_e": 0.0078}  # fmt: skip


class Drive:
    """A simulated drive at imposed speeds and requested torques."""

    def __init__(self, motor: Motor, plant: dict[str, float]) -> None:
        self.loop = Loop(motor.library, motor.plant | {"imposed_speed": 1.0} | plant, motor.flux_map)
        self.loop.set("enable", 1.0)
        self.loop.record(COLUMNS, round(ROW_S / self.loop.period_s))
        self.speed, self.torque = 0.0, 0.0

    def to(self, rpm: float, torque_Nm: float, seconds: float) -> NDArray[np.float64]:
        """Ramp speed and torque linearly; a row for each millisecond."""
        ramps = {"plant.speed_rad_s": (self.speed, rpm * RPM), "torque_requested_Nm": (self.torque, torque_Nm)}
        rows = self.loop.run(round(seconds / self.loop.period_s), ramps)
        self.speed, self.torque = rpm * RPM, torque_Nm
        assert rows[:, FAULT].max() == 0.0
        return rows

    def warm_up(self) -> "Drive":
        """Half a minute of driving at low and medium speed."""
        for rpm, torque in ((1500, 50), (2500, 20), (600, -40), (3000, 70), (4500, 30), (1200, -60), (5000, 60),
                            (6500, 25), (7000, 10), (3000, -50), (800, 30), (2000, 90)):  # fmt: skip
            self.to(rpm, torque, 1.0)
            self.to(rpm, torque * 0.5, 1.5)
        return self


@pytest.fixture(params=[SOFT, STIFF], ids=["soft", "stiff"])
def driven(request: pytest.FixtureRequest, hsm1: Motor) -> Iterator[Drive]:
    drive = Drive(hsm1, request.param).warm_up()
    with drive.loop:
        yield drive


def test_after_a_drive_torque_is_right_at_every_speed_in_every_quadrant(driven: Drive) -> None:
    # The campaign evaluates the distribution; here no point may exceed its 99th percentile. Where the voltage limit
    # decides the torque, only the estimate must be right.
    for rpm, torque, percent in ((150, 40, 2.5), (400, -30, 2.5), (800, 100, 2.5), (1500, -60, 2.5), (3000, 15, 2.5),
                                 (4500, -70, 2.5), (6000, 40, 3.0), (8000, -25, 3.0), (-2500, 60, 2.5)):  # fmt: skip
        driven.to(rpm, torque, max(0.3, abs(rpm * RPM - driven.speed) / 1000.0))
        rows = driven.to(rpm, torque, 0.25 + 60.0 / abs(rpm))
        true, estimate, limited = rows[250:, [TORQUE, ESTIMATE, LIMITED]].mean(axis=0)
        allowed = percent / 100.0 * max(abs(torque), 0.1 * RATED_NM)
        assert abs(estimate - true) <= allowed, (rpm, torque, true, estimate)
        assert limited > 0.05 or abs(true - torque) <= allowed, (rpm, torque, true)


def test_a_torque_step_moves_the_flux_by_less_than_a_percent(driven: Drive) -> None:
    # At 8000 rpm the voltage does not allow 80 % of the rated torque: the step then ends at the limit.
    for rpm in (500, 1500, 3000, 5000, 8000):
        for torque in (0.8 * RATED_NM, -0.8 * RATED_NM):
            driven.to(rpm, 0, max(0.5, abs(rpm * RPM - driven.speed) / 1000.0))
            before = driven.to(rpm, 0, 0.2)[:, PSI].mean()
            driven.torque = torque
            rows = driven.to(rpm, torque, 0.5)
            assert np.abs(rows[:, PSI] - before).max() <= 0.01 * 0.0717, (rpm, torque)


def test_a_speed_ramp_through_the_speed_thresholds_makes_no_step_of_torque(driven: Drive) -> None:
    for torque in (40, -40):
        driven.to(0, torque, 1.0)
        rows = driven.to(2000, torque, 2.0)
        rows = np.concatenate([rows, driven.to(-500, torque, 2.0)])
        # Means of 20 ms, so that ripple from the sensors does not count; a step may be 1 % of rated torque.
        smooth = rows[:, TORQUE].reshape(-1, 20).mean(axis=1)
        assert np.abs(np.diff(smooth)).max() <= 0.01 * RATED_NM, torque


def test_before_anything_is_identified_the_torque_is_that_of_the_tables(hsm1: Motor) -> None:
    drive = Drive(hsm1, SOFT)
    with drive.loop:
        drive.to(100, 40, 0.5)
        rows = drive.to(100, 40, 0.5)
        assert rows[:, CONFIDENCE].max() == 0.0
        assert rows[:, CORRECTION].max() == 0.0


@pytest.mark.parametrize("plant", [SOFT, STIFF], ids=["soft", "stiff"])
def test_at_low_speed_the_torque_is_that_of_the_tables_after_little_torque(
    hsm1: Motor, plant: dict[str, float]
) -> None:
    drive = Drive(hsm1, plant)
    with drive.loop:
        drive.to(0, 0, 1.0)
        drive.to(500, 5, 6.0)
        rows = drive.to(500, 20, 10.0)
        assert rows[:, CONFIDENCE].max() == 0.0
        assert np.abs(rows[:, CORRECTION]).max() == 0.0


@pytest.mark.parametrize("little", [0.5, -0.5])
def test_after_coasting_an_offset_of_the_torque_does_not_become_a_factor_of_the_next_torque(
    driven: Drive, little: float
) -> None:
    driven.to(4000, little, 1.0)
    driven.to(4000, little, 2.0)
    driven.torque = 60.0
    rows = driven.to(4000, 60, 0.1)
    # Overshoot of the current control and ripple from the sensors are 5 %. When an offset of 0.3 N·m was taken for a
    # ratio, the error was 27 %.
    assert abs(rows[5:25, TORQUE].mean() / 60.0 - 1.0) <= 0.08


@pytest.mark.parametrize("plant", [SOFT, STIFF], ids=["soft", "stiff"])
@pytest.mark.parametrize("rpm", [1500, 2500, 4000])
def test_from_1500_rpm_on_a_first_start_at_one_point_is_no_worse_than_the_tables(
    hsm1: Motor, plant: dict[str, float], rpm: float
) -> None:
    # Below 1500 rpm the two equations of a single point cannot separate inverter and magnet: docs/howto/tuning.md.
    errors = []
    for on in (0.0, 1.0):
        drive = Drive(hsm1, plant)
        with drive.loop:
            drive.loop.set("identification", on)
            drive.loop.set("torque_loop", on)
            drive.to(rpm, 20, 1.0)
            drive.to(rpm, 20, 20.0 * on + 0.5)
            errors.append(100.0 * (drive.to(rpm, 20, 0.5)[:, TORQUE].mean() / 20.0 - 1.0))
    tables, identified = errors
    print(f"{tables:+.1f} % tables, {identified:+.1f} % identified")
    assert abs(identified) <= abs(tables) + 0.5


def test_a_resolver_that_slips_on_the_shaft_makes_the_confidence_zero(driven: Drive) -> None:
    rows = driven.to(2000, 30, 1.0)
    assert rows[-1, CONFIDENCE] == 1.0
    driven.loop.set("machine_monitors", 0.0)  # they would trip first
    # Two steps of 10 degrees: each is below the 18 degrees from which the predicted angle is used.
    driven.loop.set("plant.angle_offset_rad", math.radians(10.0))
    driven.to(2000, 30, 0.01)
    driven.loop.set("plant.angle_offset_rad", math.radians(20.0))
    rows = driven.to(2000, 30, 1.5)
    assert rows[-1, CONFIDENCE] == 0.0
    assert abs(rows[-1, CORRECTION]) == 0.0
