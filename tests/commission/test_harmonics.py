# SPDX-License-Identifier: Apache-2.0
"""Harmonics of the angle sensor from the smooth movement of a coasting shaft."""

import cmath
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fluxtrue_tools.commission import bus_turning, harmonics, hidden, report, spin, turning
from fluxtrue_tools.commission.bus import ANGLE_CORRECTION, UNKNOWN, OverTheBus
from fluxtrue_tools.commission.harmonics import Coasting, Harmonics
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import harmonics_deg, waves_rad
from fluxtrue_tools.commission.steps import Found, chosen, run
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.scope.xcp import XcpRefused
from fluxtrue_tools.sim.motor import Motor

PERIOD_S, WINDOW_S, BITS = 1e-4, 0.2, 14
DRAG = 0.3  # the speed falls by this share in a second, the drag with the speed
TORQUE_NM_PER_A, INERTIA_KGM2 = 0.5, 0.07
HARMONIC_DEG = 0.2  # the campaign's bound
FIT_DEG, FIT_SHARE = 0.005, 0.002  # without currents: the resolution of 14 bits, averaged


def window(begun_rad: float, speed_rad_s: float, waves: dict[int, complex], pole_pairs: int, noise_rad: float = 0.0,
           swing: tuple[complex, float] = (0j, 0.0)) -> Coasting:  # fmt: skip
    """A shaft that drag makes slower, with its sensor: waves by order, electrical, of the angle without them.

    swing   a current once per turn that makes torque, and the share of it that is true of TORQUE_NM_PER_A/INERTIA_KGM2
    """
    t = PERIOD_S * np.arange(round(WINDOW_S / PERIOD_S))
    shaft = begun_rad + speed_rad_s * (1.0 - np.exp(-DRAG * t)) / DRAG
    current = (swing[0] * np.exp(1j * shaft)).real
    shaft = shaft - swing[1] * TORQUE_NM_PER_A * current / (INERTIA_KGM2 * speed_rad_s**2)
    error: Array = sum(((wave * np.exp(1j * k * shaft)).real for k, wave in waves.items()), np.zeros(len(t)))
    rng = np.random.default_rng(1)
    shown = (shaft + error / pole_pairs + rng.normal(0.0, noise_rad, len(t))) / turning.TURN
    return Coasting(np.round(shown * 2**BITS) / 2**BITS, current, PERIOD_S)


def measured(speed_rad_s: float, waves: dict[int, complex], pole_pairs: int, **more: Any) -> Harmonics:
    """Both directions, three windows each, in which the shaft becomes slower."""
    found = []
    for sign in (1.0, -1.0):
        one = harmonics.fit([window(begun, sign * share * speed_rad_s, waves, pole_pairs, **more)
                             for begun, share in ((0.3, 1.0), (2.0, 0.8), (5.0, 0.6))])  # fmt: skip
        assert one is not None
        found.append(one)
    return harmonics.together(found, pole_pairs, TORQUE_NM_PER_A, INERTIA_KGM2)


def error_deg(found: Harmonics, waves: dict[int, complex]) -> float:
    pairs = ((found.first.value_rad, waves.get(1, 0j)), (found.second.value_rad, waves.get(2, 0j)))
    return max(math.degrees(abs(value - true)) for value, true in pairs)


@pytest.mark.parametrize("pole_pairs", [2, 8])
@pytest.mark.parametrize("speed_rad_s", [40.0, 100.0, 230.0, 900.0])
@pytest.mark.parametrize("degrees", [0.0, 0.1, 1.0, 6.0])
def test_amplitude_and_phase_at_every_speed(degrees: float, speed_rad_s: float, pole_pairs: int) -> None:
    """At 40 rad/s a window has less than one turn at its end; noise of half a step of the sensor."""
    waves = {1: cmath.rect(math.radians(degrees), 0.7), 2: cmath.rect(math.radians(0.6 * degrees), -2.0)}
    found = measured(speed_rad_s, waves, pole_pairs, noise_rad=0.5 * turning.TURN / 2**BITS)
    slow = 4.0 if speed_rad_s < 100.0 else 1.0  # a polynomial resembles a part of a turn
    within = slow * pole_pairs * FIT_DEG + FIT_SHARE * degrees
    assert error_deg(found, waves) < within
    assert math.degrees(abs(found.further.value_rad)) < within
    assert found.is_large == (degrees > 2.0)


def test_the_phase_is_where_the_sensor_shows_most_too_much() -> None:
    """0.5 degrees at 40 degrees of the turn, 0.2 degrees at 100 and 280 degrees."""
    waves = {1: cmath.rect(math.radians(0.5), -math.radians(40.0)),
             2: cmath.rect(math.radians(0.2), -math.radians(200.0))}  # fmt: skip
    found = measured(230.0, waves, 4)
    assert math.degrees(found.first.phase_rad) == pytest.approx(40.0, abs=1.0)
    assert math.degrees(found.second.phase_rad) == pytest.approx(200.0, abs=3.0)
    said = "\n".join(report._harmonics(found))
    assert "once per turn 0.50 ±" in said and "most 40 degrees" in said and "most 100 degrees" in said


def test_three_and_four_times_per_turn_are_not_taken_for_the_others() -> None:
    found = measured(230.0, {3: math.radians(0.8) + 0j, 4: 1j * math.radians(0.3)}, 4)
    assert error_deg(found, {}) < 0.01
    assert math.degrees(abs(found.further.value_rad)) == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize("lighter", [0.5, 1.0, 3.0, 12.0])
def test_a_swing_of_the_shaft_by_its_currents(lighter: float) -> None:
    """It is within the uncertainty whatever the nameplate's inertia is, and is taken away with the true one."""
    waves = {1: cmath.rect(math.radians(0.5), 0.7)}
    found = measured(120.0, waves, 6, swing=(0.2 + 0.15j, lighter))
    wrong_deg = error_deg(found, waves)
    assert wrong_deg > 0.01
    assert wrong_deg < math.degrees(found.first.sigma_rad)
    corrected = found.with_inertia(INERTIA_KGM2 / lighter)
    assert error_deg(corrected, waves) < harmonics.SWING_SHARE * wrong_deg + FIT_DEG


def test_a_light_shaft_that_swings_is_not_taken_for_a_badly_mounted_sensor() -> None:
    found = measured(120.0, {}, 6, swing=(1.0 + 1.0j, 12.0))
    assert abs(found.first.value_rad) > harmonics.LARGE_RAD
    assert not found.is_large
    assert not found.with_inertia(INERTIA_KGM2 / 12.0).is_large


def test_windows_of_less_than_seven_tenths_of_a_turn_are_not_evaluated() -> None:
    short, long = window(0.3, 20.0, {}, 4), window(0.3, 120.0, {}, 4)
    assert harmonics.fit([short, short]) is None
    one, both = harmonics.fit([long]), harmonics.fit([short, long])
    assert one is not None and both is not None
    assert np.array_equal(one.waves, both.waves)


def spun(unknown: Motor, known: Nameplate, name: str, seed: int, **changes: float) -> tuple[spin.Spun, hidden.Truth]:
    """The hidden machine after the step, with these parameters."""
    drive, truth = hidden.make(name, seed, unknown, known.i_max_A, connected=False, changed=changes)
    found = run(drive, chosen(("spin",)), known, lambda _: None).spun
    assert found is not None and found.harmonics is not None
    return found, truth


@pytest.mark.parametrize("reversed_", [0.0, 1.0])
def test_a_badly_mounted_sensor_of_a_hidden_machine_is_found_and_said(
    reversed_: float, unknown: Motor, known: Nameplate
) -> None:
    """Four and one electrical degrees; the offset of the angle stays within its bound."""
    found, truth = spun(unknown, known, "leaf", 104, angle_reversed=reversed_, angle_h1_rad=math.radians(4.0),
                        angle_h1_phase=1.0, angle_h2_rad=math.radians(1.0), angle_h2_phase=4.0)  # fmt: skip
    assert found.harmonics is not None
    assert abs(waves_rad(truth)[0]) == pytest.approx(math.radians(4.0))
    print(found.harmonics, harmonics_deg(found, truth))
    assert harmonics_deg(found, truth) < HARMONIC_DEG
    offset_deg = math.degrees(math.remainder(found.connection.offset_rad - truth.offset_rad, turning.TURN))
    assert abs(offset_deg) < 0.2
    said = report.text(Found(spun=found), known, None)
    assert "the angle sensor is uneven by more than 2 electrical degrees" in said and "check how it is mounted" in said


def test_a_report_without_a_measurement_says_so() -> None:
    assert report._harmonics(None) == ["  harmonics of the angle sensor: not measured"]


def test_a_firmware_that_does_not_tell_its_correction_leaves_the_harmonics_open(known: Nameplate) -> None:
    """As one of an earlier version: nothing else of the step depends on it."""

    def refuse(*command: int) -> bytes:
        raise XcpRefused(command[0], UNKNOWN)

    drive = OverTheBus.__new__(OverTheBus)
    drive._master = SimpleNamespace(command=refuse)  # type: ignore[assignment]
    drive.tells_angle_correction = drive._has_command(ANGLE_CORRECTION)
    assert not drive.tells_angle_correction
    connection = turning.Connection(4, False, 0.0)
    assert bus_turning._sensor(drive, known, 100.0, connection) is None
    wired = spin.Spun(connection, 0.1, 1e-4, 1e-4, 0.0, 500.0)
    seen = harmonics.fit([window(0.3, 100.0, {}, 4)])
    assert spin._harmonics([spin.Magnet(0.1 + 0j, 500.0, seen), spin.Magnet(0.1 + 0j, 500.0)], wired, known) is None
