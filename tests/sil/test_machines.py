# SPDX-License-Identifier: Apache-2.0
"""The interface with machines at other PWM frequencies, which only some builds have (tests/motors)."""

import tomllib
from pathlib import Path

import pytest
from sil import NO_STATE, OK, OUT_OF_RANGE, Drive, load

MOTORS = Path(__file__).resolve().parents[1] / "motors"

PERIODS_S = {"hsm1": 1 / 10e3, "hsm1_5kHz": 1 / 5e3, "hsm1_16kHz": 1 / 16e3, "hsm1_22.5kHz": 1 / 22.5e3}


@pytest.mark.parametrize("motor", PERIODS_S)
def test_the_period_is_that_of_the_motor_file(motor: str) -> None:
    library = load(motor)
    assert library.fluxtrue_motor().decode() == motor
    assert library.fluxtrue_period_s() == PERIODS_S[motor]


@pytest.mark.parametrize("other", list(PERIODS_S)[1:])
def test_a_state_is_refused_by_the_same_machine_at_another_frequency(other: str) -> None:
    drive, stranger = Drive(load("hsm1")), Drive(load(other))
    state, before = drive.save(), stranger.save()
    assert len(state) == len(before)
    assert stranger.restore(state) == NO_STATE
    assert stranger.save() == before
    drive.close()
    stranger.close()


@pytest.mark.parametrize("motor", ["compressor", "servo"])
def test_the_largest_torque_of_the_motor_file_can_be_requested(motor: str) -> None:
    """Also 1.8 N·m, which as a double is more than as the float that the firmware has."""
    torque_max_Nm = tomllib.loads((MOTORS / motor / "motor.toml").read_text())["machine"]["torque_max_Nm"]
    drive = Drive(load(motor))
    for torque_Nm in (torque_max_Nm, -torque_max_Nm):
        assert drive.set("torque_requested_Nm", torque_Nm) == OK
        assert drive.set("torque_requested_Nm", 1.000001 * torque_Nm) == OUT_OF_RANGE
    drive.close()
