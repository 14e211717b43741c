# SPDX-License-Identifier: Apache-2.0
"""A broken lead and a switch that never closes are found in time wherever they change the torque ((MN-2), (MN-11))."""

import itertools
import math

import pytest
from faulted import inject

from fluxtrue_tools.sim.motor import Motor

TORQUES = (-120, -40, -10, 20, 80)
ANGLES = (0.1, 0.8, 1.5)  # of the rotor at the start, in rad: they decide which phase carries the current
LEAD_MS, SWITCH_MS = 15.0, 50.0
# At 10,000 rpm two steps of the task are exactly one electrical turn.
SPEEDS = (0, 20, 100, 300, 1000, 3000, 6000, 10000, -600, -8000)


@pytest.mark.parametrize("rpm", SPEEDS)
def test_a_broken_lead_is_found_in_15_ms_from_the_first_torque_error(hsm1: Motor, rpm: float) -> None:
    for torque, angle in itertools.product(TORQUES, ANGLES):
        seconds = 0.2 if abs(rpm) > 50 else 0.6
        seen = inject(hsm1, rpm, torque, {"phase_open_b": 1.0}, seconds, theta_m_rad=angle)
        where = (rpm, torque, angle, seen)
        assert seen.error_ms == 0.0 or seen.moved_ms <= LEAD_MS, where


@pytest.mark.parametrize("rpm", SPEEDS)
@pytest.mark.parametrize("switch", ["upper_a", "lower_c"])
def test_an_open_switch_is_found_before_the_torque_has_been_wrong_for_50_ms(
    hsm1: Motor, switch: str, rpm: float
) -> None:
    # While the current flows in the other direction the open switch does not conduct anyway and changes no torque.
    for torque, angle in itertools.product(TORQUES, ANGLES):
        seconds = 0.2 if abs(rpm) > 50 else 0.6
        seen = inject(hsm1, rpm, torque, {f"switch_open_{switch}": 1.0}, seconds, theta_m_rad=angle)
        where = (rpm, torque, angle, seen)
        assert seen.error_ms <= SWITCH_MS, where
        assert seen.error_ms == 0.0 or not math.isnan(seen.found_ms), where
