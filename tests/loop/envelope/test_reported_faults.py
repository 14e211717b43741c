# SPDX-License-Identifier: Apache-2.0
"""Situations in which users of other drives reported a fault or damage."""

import math

import numpy as np
import pytest
from rig import (
    ANGLE,
    ANGLE_OFFSET,
    CURRENT_STUCK,
    CURRENT_SUM,
    FAULTED,
    OVER_CURRENT,
    OVER_VOLTAGE,
    PHASE_LOST,
    Rig,
)

from fluxtrue_tools.sim.motor import Motor


@pytest.mark.parametrize("magnet", [0.85, 1.0, 1.05])
def test_braking_out_of_field_weakening_feeds_no_surge_into_the_battery(hsm1: Motor, magnet: float) -> None:
    """Braking from top speed to below base speed: no step of the torque, no more regenerated power than requested."""
    rig = Rig(hsm1, 9500.0, magnet_scale=magnet)
    rig.run(0.3)
    rig.set(torque_requested_Nm=-40.0).run(0.1)
    trace = rig.run(1.0, plant_speed_rad_s=(9500.0 * math.pi / 30.0, 500.0 * math.pi / 30.0))
    assert trace.faults == 0
    assert np.abs(trace.torque + 40.0).max() <= 3.0  # at 9000 rpm/s
    back_W = -trace["truth.idc_A"] * trace["truth.vdc_V"]
    assert back_W.max() <= 1.05 * 40.0 * 9500.0 * math.pi / 30.0


@pytest.mark.parametrize("magnet", [0.8, 1.0, 1.1])
@pytest.mark.parametrize("torque", [132.0, 30.0])
def test_throttle_release_at_high_speed_does_not_brake_the_car(hsm1: Motor, torque: float, magnet: float) -> None:
    rig = Rig(hsm1, 9500.0, torque, magnet_scale=magnet)
    driving = rig.run(0.4)
    before = driving.settled()
    trace = rig.set(torque_requested_Nm=0.0).run(0.3)
    assert trace.faults == 0
    assert trace.torque.min() >= -2.0
    assert trace.torque.max() <= before + 3.0
    # The slew of 13.2 N·m/ms starts at the torque that was made, not at the requested torque.
    released_ms = trace.first_ms(trace.torque < 0.1 * before)
    assert released_ms <= before / 13.2 + 3.0


@pytest.mark.parametrize("degrees", [30.0, -30.0])
@pytest.mark.parametrize("rpm", [2000.0, 3000.0, 5000.0, 8000.0])
@pytest.mark.parametrize("torque", [0.0, 20.0, 80.0, -80.0])
def test_a_resolver_mounted_30_degrees_off_is_found(hsm1: Motor, torque: float, rpm: float, degrees: float) -> None:
    """Enabled while the machine turns: 5 ms of settling and 5 ms of confirmation, 30 ms in the worst case. At high
    speed the over-current trip is faster."""
    rig = Rig(hsm1, rpm, torque, enable=False, angle_offset_rad=math.radians(degrees))
    rig.run(0.02)
    trace = rig.set(enable=1.0).run(0.1)
    found = trace.fault_ms(ANGLE_OFFSET | OVER_CURRENT)
    assert found <= 30.0
    if rpm <= 3000.0:
        assert trace.faults == ANGLE_OFFSET


def test_a_resolver_that_jumps_by_30_degrees_while_running_is_found_and_not_followed(hsm1: Motor) -> None:
    """Confirmed after 66 samples; until then the predicted angle is used and the torque stays."""
    rig = Rig(hsm1, 3000.0, 40.0)
    before = rig.run(0.2).settled()
    trace = rig.set(plant_angle_offset_rad=math.radians(30.0)).run(0.02)
    found_ms = trace.fault_ms(ANGLE)
    assert found_ms <= 6.7
    assert np.abs(trace.torque[: trace.row(found_ms)] - before).max() <= 5.0


@pytest.mark.parametrize("rpm", [6000.0, 10000.0])
def test_back_driven_beyond_what_the_dc_link_can_hold_the_current_stays_in_the_machine(hsm1: Motor, rpm: float) -> None:
    """The dc voltage collapses while the machine is driven from outside: the back-EMF is above the dc voltage."""
    rig = Rig(hsm1, rpm, 0.0)
    rig.run(0.3)
    rig.set(plant_vdc_V=120.0)  # the under-voltage trip is at 140 V
    trace = rig.run(0.3)
    assert np.abs(trace["truth.i_d_A"]).max() <= 560.0  # (SS-4): 2.1 times psi_f/L_d
    assert abs(trace.settled()) <= 5.0
    assert abs(trace.settled("truth.idc_A")) <= 5.0  # the machine does not charge the link


@pytest.mark.parametrize("rpm", [3000.0, 9000.0])
def test_a_battery_disconnected_while_generating_does_not_damage_the_inverter(hsm1: Motor, rpm: float) -> None:
    """Only the 500 µF of the dc link remain. This plant does not model a dc link; its voltage is integrated here."""
    rig = Rig(hsm1, rpm, -50.0)
    rig.run(0.3)
    volts, highest, trace = 350.0, 350.0, None
    period_s = rig.loop.period_s
    for _ in range(rig.periods(50.0)):
        trace = rig.set(plant_vdc_V=volts).run(period_s)
        volts = max(volts - trace["truth.idc_A"][-1] * period_s / 500e-6, 1.0)
        highest = max(highest, volts)
    assert trace is not None
    assert trace.faults & OVER_VOLTAGE
    assert highest <= 500.0  # 437.5 V trips, 450 V and more are usual ratings for 500 V capacitors
    assert trace["run_state"][-1] == FAULTED


@pytest.mark.parametrize("torque", [0.0, 132.0, -132.0])
def test_a_fault_at_top_speed_does_not_brake_by_rectifying(hsm1: Motor, torque: float) -> None:
    rig = Rig(hsm1, 10000.0, torque)
    rig.run(0.2)
    trace = rig.set(plant_current_open_a=1.0).run(0.2)
    assert trace.faults & (OVER_CURRENT | CURRENT_SUM)
    assert abs(trace.settled()) <= 5.0  # switching disabled: -53 N·m
    assert abs(trace.settled("truth.idc_A")) <= 2.0
    assert trace["truth.i_d_A"].min() >= -560.0  # (SS-4)


def test_switched_off_at_top_speed_it_holds_no_torque_and_opens_when_the_speed_has_gone(hsm1: Motor) -> None:
    rig = Rig(hsm1, 10000.0)
    rig.run(0.2)
    trace = rig.set(enable=0.0).run(0.2)
    assert np.abs(trace.torque).max() <= 5.0
    assert -60.0 <= trace.settled("truth.i_d_A") <= -10.0  # field weakening: the diodes do not conduct
    down = rig.run(0.3, plant_speed_rad_s=(10000.0 * math.pi / 30.0, 5000.0 * math.pi / 30.0))
    assert abs(down["truth.i_d_A"][-1]) <= 1.0
    assert abs(down.torque[-1]) <= 1.0  # iron loss


@pytest.mark.parametrize("phase", ["a", "b", "c"])
@pytest.mark.parametrize("rpm", [300.0, 1500.0, 6000.0])
def test_a_broken_motor_lead_is_found_within_20_ms_or_an_electrical_turn(hsm1: Motor, rpm: float, phase: str) -> None:
    rig = Rig(hsm1, rpm, 60.0)
    rig.run(0.2)
    trace = rig.set(**{f"plant_phase_open_{phase}": 1.0}).run(0.15)
    turn_ms = 60e3 / (3.0 * rpm)
    found = trace.fault_ms(-1)
    assert found <= max(turn_ms, 20.0)
    if rpm < 1000.0:  # above, the monitor of the back-EMF may be faster
        assert trace.faults & PHASE_LOST


@pytest.mark.parametrize("phase", ["a", "b", "c"])
def test_a_current_sensor_that_repeats_itself_is_found_within_30_ms(hsm1: Motor, phase: str) -> None:
    rig = Rig(hsm1, 1000.0, 3.0)  # so little torque that the sum of the currents stays within its tolerance
    rig.run(0.2)
    trace = rig.set(**{f"plant_current_stuck_{phase}": 1.0}).run(0.1)
    assert trace.fault_ms(CURRENT_STUCK | CURRENT_SUM | OVER_CURRENT) <= 30.0
