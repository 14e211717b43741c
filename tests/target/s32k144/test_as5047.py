# SPDX-License-Identifier: Apache-2.0
"""The S32K144's image with an AS5047P encoder on the emulated processor: the angle is the one of the currents' sampling
instant, a disturbed frame is an invalid sample, and planted errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from planting import PlantedError, assert_found
from sensor_drive import ANGLE, driving, is_right, the_angle_is_that_of_the_sampling_instant

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop

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
          a_line_that_is_stuck_is_found, a_start_without_an_encoder_is_refused)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
def test_the_as5047_image_passes_each_check(as5047: Parts, check: Check) -> None:
    check(as5047)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_of_the_as5047_is_found(as5047: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED[name]
    assert_found(check, as5047, error, tmp_path)
