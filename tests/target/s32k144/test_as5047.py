# SPDX-License-Identifier: Apache-2.0
"""The S32K144's image with an AS5047P encoder on the emulated processor: the angle is the one of the currents' sampling
instant, a disturbed frame is an invalid sample, and planted errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from planting import PlantedError, assert_found
from sensor_drive import ANGLE, FAST_RPM, RAD_S, driving, is_right, the_angle_is_that_of_the_sampling_instant

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.library import Loop

CLOCKED = 3 << 3  # FTM0.SC
BOOT_PERIODS = 1000
PARITY, ERROR_FLAG, LOW, HIGH, WEAK_FIELD = 1.0, 2.0, 3.0, 4.0, 5.0  # emu_encoder_fault_t


@pytest.fixture(scope="module")
def as5047() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", angle="as5047")


def a_disturbed_frame_is_an_invalid_sample(parts: Parts) -> None:
    """One or two frames cost nothing, at speed: the rotor's movement replaces them. The third is the angle fault. That
    the movement is the right one shows in tests/unit/s32k144/test_as5047.c: here the tracker would mend a wrong one."""
    for disturbance in (PARITY, ERROR_FLAG, HIGH):
        with driving(parts) as loop:
            for periods in (1, 2):
                loop.set("emulator.encoder_fault", disturbance)
                loop.run(periods)
                loop.set("emulator.encoder_fault", 0.0)
                loop.run(50)
                assert is_right(loop)
            loop.set("emulator.encoder_fault", disturbance)
            loop.run(4)
            assert int(loop.get("fault_word")) == ANGLE


def a_line_that_is_stuck_is_found(parts: Parts) -> None:
    """Low is a valid frame of angle 0: the tracker finds that no rotor turns that way."""
    for disturbance in (LOW, HIGH):
        with driving(parts) as loop:
            loop.set("emulator.encoder_fault", disturbance)
            loop.run(200)
            assert int(loop.get("fault_word")) & ANGLE


def a_start_without_an_encoder_is_refused(parts: Parts) -> None:
    """No magnet, or a line that is stuck, before the processor starts."""
    for disturbance in (WEAK_FIELD, LOW, HIGH):
        motor = parts.emulated()
        plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 350.0}
        with Loop(motor.library, plant, motor.flux_map) as loop:
            loop.run(10)
            loop.set("emulator.encoder_fault", disturbance)
            loop.set("emulator.power_cycle", 1)
            loop.set("enable", 1)
            loop.run(100)
            assert loop.get("emulator.gates") == 0
            assert int(loop.get("fault_word")) & ANGLE


def _reset_at(parts: Parts, share: float) -> tuple[Loop, float]:
    """A fast shaft, and a reset after that share of a step of the plant; how much of a step had passed when the PWM
    started again."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 350.0}
    loop = Loop(motor.library, plant, motor.flux_map)
    loop.run(3000, {"plant.speed_rad_s": (0.0, FAST_RPM * RAD_S)})
    core = Core.of_simulation(motor.library, loop._sim)
    loop.set("emulator.reset_share", share)
    loop.set("emulator.reset", 1)
    loop.run(1)
    for _ in range(BOOT_PERIODS):
        begun_s = core.now_s
        loop.run(1)
        if core.register("FTM0.SC") & CLOCKED:
            return loop, (core.now_s - begun_s) / loop.period_s
    raise AssertionError("the PWM does not start")


def a_start_at_speed_has_the_right_speed_at_once(parts: Parts) -> None:
    """The plant advances by whole steps, and its next one begins with the PWM: the shaft jumps by what is left of the
    step (docs/howto/emulate.md). The first speed has twice that share as its error, in the angle and in the travel.
    Therefore the reset comes when next to nothing will be left. The encoder's counts and the time of the start-up's
    code add less than 1 %."""
    loop, passed = _reset_at(parts, 0.0)
    loop.close()
    loop, passed = _reset_at(parts, (0.985 - passed) % 1.0)
    with loop:
        assert 0.98 < passed < 1.0
        loop.run(2)
        error = loop.get("speed_rpm") / FAST_RPM - 1.0
        assert abs(error) < 2.0 * (1.0 - passed) + 0.01
        loop.run(200)
        assert loop.get("fault_word") == 0


Check = Callable[[Parts], None]
PORT = "angle_as5047.c"
PLANTED: dict[str, tuple[Check, PlantedError]] = {
    "the angle of the period before": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, "return encoder.last + (uint32_t)encoder.travel", "return encoder.last"),
    ),
    "the age of the sample is left out": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, " - travel_share(&encoder);", ";"),
    ),
    "faster than the encoder allows": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, ".bit = 4, .select = 10,", ".bit = 2, .select = 10,"),
    ),
    "selected for too short a time": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, ".bit = 4, .select = 10,", ".bit = 4, .select = 4,"),
    ),
    "the frames of the start are less than a period apart": (
        a_start_at_speed_has_the_right_speed_at_once,
        PlantedError(PORT, "core_pass(period_ticks - SAMPLED_TICKS - UNTIL_PWM_TICKS)", "core_pass(period_ticks / 2U)"),
    ),
    "the errors of the power-up are not read": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, "(AS5047_READ_ERRORS); /* clears", "(AS5047_READ_ANGLE); /* clears"),
    ),
    "the parity is not checked": (
        a_disturbed_frame_is_an_invalid_sample,
        PlantedError(PORT, "as5047_is_valid(frame)) {", "(frame & AS5047_ERROR) == 0U) {"),
    ),
    "the error flag is not checked": (
        a_disturbed_frame_is_an_invalid_sample,
        PlantedError(PORT, "as5047_is_valid(frame)) {", "as5047_is_even(frame)) {"),
    ),
    "the encoder's state is not asked at the start": (
        a_start_without_an_encoder_is_refused,
        PlantedError(PORT, "as5047_is_healthy(diagnostics) && as5047_is_valid(angle)", "diagnostics != angle"),
    ),
}  # fmt: skip
CHECKS = (the_angle_is_that_of_the_sampling_instant, a_disturbed_frame_is_an_invalid_sample,
          a_line_that_is_stuck_is_found, a_start_without_an_encoder_is_refused,
          a_start_at_speed_has_the_right_speed_at_once)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
def test_the_as5047_image_passes_each_check(as5047: Parts, check: Check) -> None:
    check(as5047)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_of_the_as5047_is_found(as5047: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED[name]
    assert_found(check, as5047, error, tmp_path)
