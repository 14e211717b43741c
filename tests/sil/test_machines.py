# SPDX-License-Identifier: Apache-2.0
"""The interface with machines at other PWM frequencies, which only some builds have (tests/motors)."""

import pytest
from sil import NO_STATE, Drive, load

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
