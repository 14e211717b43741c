# SPDX-License-Identifier: Apache-2.0
"""The S32K144's images with an analogue sine and cosine, and with a resolver's windings, at the converters on the
emulated processor: the angle is the one of the currents' sampling instant, a sample outside the band is an invalid
sample, and planted errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import resets
from planting import PlantedError, assert_found
from sensor_drive import ANGLE, TORQUE, driving, is_right, the_angle_is_that_of_the_sampling_instant

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim.library import Loop

TURN_PERIODS = 92  # at FAST_RPM
FLASHED_TORQUE = 15.0  # at 9500 rpm
OPEN, HIGH, MIDDLE = 1.0, 2.0, 3.0  # track_t of the emulator
TRACKS = ("sine", "cosine")


@pytest.fixture(scope="module")
def sincos() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", angle="sincos")


@pytest.fixture(scope="module")
def windings() -> Parts:
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    return build.prepare("hsm1", angle="windings")


def faults_after(loop: Loop, periods: int) -> int:
    loop.run(periods)
    return int(loop.get("fault_word"))


def errors_within_the_tolerances_leave_the_torque_true(parts: Parts) -> None:
    """Offsets of 0.7 % and amplitudes that differ by 1 % move the angle by up to 15 mrad of the shaft, which the angle
    correction identifies in 0.1 s; the noise is 4 counts. A common error of the amplitudes of 12 % changes nothing."""
    errors = {"sine_offset": 10.0, "cosine_offset": -10.0, "sine_amplitude": 0.885, "cosine_amplitude": 0.875,
              "sine_noise": 4.0, "cosine_noise": 4.0}  # fmt: skip
    with driving(parts, **errors) as loop:
        loop.run(1000)
        loop.record(("truth.torque_Nm",), 1)
        assert np.mean(loop.run(5 * TURN_PERIODS)) == pytest.approx(TORQUE, abs=0.2)
        assert loop.get("fault_word") == 0


def a_glitch_is_an_invalid_sample(parts: Parts) -> None:
    """One or two periods cost nothing, at speed: the rotor's movement replaces them. The third is the angle fault."""
    for track, fault in zip(TRACKS, (OPEN, HIGH), strict=True):
        with driving(parts) as loop:
            for periods in (1, 2):
                loop.set(f"emulator.{track}_fault", fault)
                loop.run(periods)
                loop.set(f"emulator.{track}_fault", 0.0)
                loop.run(50)
                assert is_right(loop)
            loop.set(f"emulator.{track}_fault", fault)
            assert faults_after(loop, 2) == 0
            assert faults_after(loop, 2) == ANGLE


def a_sensor_that_fails_is_found(parts: Parts) -> None:
    """An amplitude of 75 % of both tracks in three periods, whatever the angle; of one track, and a track that stays in
    the middle of its range, within half a turn: the other track alone is outside the band at its zero."""
    with driving(parts) as loop:
        for track in TRACKS:
            loop.set(f"emulator.{track}_amplitude", 0.75)
        assert faults_after(loop, 4) == ANGLE
    for track in TRACKS:
        for name, value in (("amplitude", 0.75), ("fault", MIDDLE)):
            with driving(parts) as loop:
                loop.set(f"emulator.{track}_{name}", value)
                assert faults_after(loop, TURN_PERIODS // 2) & ANGLE, (track, name)


def a_start_without_a_sensor_is_refused(parts: Parts) -> None:
    """No magnet, or an open wire, before the processor starts; the same with the sensor drives."""
    for name, value in (("fault", OPEN), ("fault", MIDDLE), ("fault", 0.0)):
        motor = parts.emulated()
        plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 350.0}
        with Loop(motor.library, plant, motor.flux_map) as loop:
            loop.run(10)
            for track in TRACKS:
                loop.set(f"emulator.{track}_{name}", value)
            loop.set("emulator.power_cycle", 1)
            loop.set("enable", 1)
            loop.run(100)
            assert loop.get("emulator.gates") == (value == 0.0)
            assert int(loop.get("fault_word")) == (ANGLE if value != 0.0 else 0)


def a_lost_excitation_is_found(parts: Parts) -> None:
    """In three periods: neither track has a voltage. 75 % of it too."""
    for share in (0.0, 0.75):
        with driving(parts) as loop:
            loop.set("emulator.excitation", share)
            assert faults_after(loop, 2) == 0
            assert faults_after(loop, 2) == ANGLE


Check = Callable[[Parts], None]
PORT = "angle_sincos.c"
PLANTED: dict[str, tuple[Check, PlantedError]] = {
    "the age of the sample is left out": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(PORT, " - travel_share(&sensor);", ";"),
    ),
    "the fast ISR comes before the tracks": (
        the_angle_is_that_of_the_sampling_instant,
        PlantedError(
            "sampling.c",
            "ADC_SC1_ADCH(1);\n    ADC0->SC1[SAMPLING_ANGLE] = ADC_SC1_ADCH(SINE_INPUT) | ADC_SC1_AIEN;\n",
            "ADC_SC1_ADCH(1) | ADC_SC1_AIEN;\n    ADC0->SC1[SAMPLING_ANGLE] = ADC_SC1_ADCH(SINE_INPUT);\n",
        ),
    ),
}  # fmt: skip
OF_WINDINGS: dict[str, tuple[Check, PlantedError]] = {
    "the windings have not settled when the drive starts": (
        a_start_without_a_sensor_is_refused,
        PlantedError(
            "excitation.c",
            "    for (uint32_t k = 1; k < SETTLING_PERIODS; k++) {\n        pulse(half, half);\n    }\n"
            "    pulse(half, half - SAMPLING_ANGLE_TICKS);\n",
            "",
        ),
    ),
}  # fmt: skip
CHECKS = (the_angle_is_that_of_the_sampling_instant, errors_within_the_tolerances_leave_the_torque_true,
          a_glitch_is_an_invalid_sample, a_sensor_that_fails_is_found, a_start_without_a_sensor_is_refused)  # fmt: skip


@pytest.mark.parametrize("check", CHECKS, ids=lambda c: c.__name__)
def test_the_sincos_image_passes_each_check(sincos: Parts, check: Check) -> None:
    check(sincos)


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_of_the_sincos_is_found(sincos: Parts, name: str, tmp_path: Path) -> None:
    check, error = PLANTED[name]
    assert_found(check, sincos, error, tmp_path)


WINDINGS_CHECKS = (the_angle_is_that_of_the_sampling_instant, a_lost_excitation_is_found,
                   a_start_without_a_sensor_is_refused)  # fmt: skip


@pytest.mark.parametrize("check", WINDINGS_CHECKS, ids=lambda c: c.__name__)
def test_the_windings_image_passes_each_check(windings: Parts, check: Check) -> None:
    check(windings)


@pytest.mark.parametrize("name", OF_WINDINGS)
def test_a_planted_error_of_the_windings_is_found(windings: Parts, name: str, tmp_path: Path) -> None:
    check, error = OF_WINDINGS[name]
    assert_found(check, windings, error, tmp_path)


@pytest.mark.parametrize("angle", ["sincos", "windings"])
def test_the_flashed_image_drives(angle: str) -> None:
    """By the vehicle's commands on the bus. The checks above run the images without it, whose requests are written."""
    if not have_arm_compiler():
        pytest.skip("the Arm compiler is not installed: no image is built")
    loop, stand = resets.powered_up(build.prepare("hsm1", angle=angle, flashed=True))
    with loop:
        loop.record(("truth.torque_Nm",), 1)
        for torque in (FLASHED_TORQUE, -FLASHED_TORQUE):
            stand.run(100, TorqueRequested=torque)
            mean = np.mean([stand.run_ms() for _ in range(20)])
            print(f"{angle}: {mean:.2f} of {torque} N.m")
            assert mean == pytest.approx(torque, abs=0.2)
            assert loop.get("fault_word") == 0
