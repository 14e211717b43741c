# SPDX-License-Identifier: Apache-2.0
"""The times that the tests of this folder read from a run are right at any PWM frequency."""

import math

import numpy as np
import pytest
from rig import ANGLE, NAMES, TORQUE, Rig, Trace

from fluxtrue_tools.sim.motor import Motor


@pytest.mark.parametrize("pwm_hz", [5e3, 10e3, 22.5e3])
def test_times_are_those_of_the_recorded_periods(pwm_hz: float) -> None:
    rows = np.zeros((round(0.1 * pwm_hz), len(NAMES)))
    rows[round(0.04 * pwm_hz) :, NAMES.index("fault_word")] = ANGLE
    trace = Trace(rows, 1.0 / pwm_hz)
    assert trace.fault_ms(ANGLE) == pytest.approx(40.0)
    assert math.isnan(trace.fault_ms(TORQUE))
    assert trace.row(40.0) == round(0.04 * pwm_hz)
    assert trace["fault_word"][trace.row(-60.0) :].min() == ANGLE


def test_a_run_has_the_period_of_its_plant(hsm1: Motor) -> None:
    rig = Rig(hsm1, 0.0, enable=False)
    assert rig.loop.period_s == pytest.approx(1.0 / hsm1.plant["pwm_hz"])
    trace = rig.run(0.005)
    assert trace.row(5.0) == rig.periods(5.0) == len(trace.torque)
