# SPDX-License-Identifier: Apache-2.0
"""The state machine on the bus: from standby to torque and back, refused requests, faults and their reset."""

from typing import Any

import pytest
from rig import Rig

REFUSED = ("none", "torque_request_not_zero", "fault", "dc_voltage_out_of_range", "sensor_implausible", "not_ready",
           "mode_locked", "command_timed_out", "reset_while_enabled", "angle_not_absolute")  # fmt: skip
PROTECTION, PRECHARGE, DISCHARGE, GATE = 1 << 0, 1 << 1, 1 << 2, 1 << 3
OVER_CURRENT, OVER_VOLTAGE, UNDER_VOLTAGE, CURRENT_SUM = 1 << 0, 1 << 1, 1 << 2, 1 << 3
DRIVER = 1 << 15  # the same fault in the word of the drive, set by the interrupts


def refusal(rig: Rig) -> str:
    return REFUSED[int(rig.signal("INV_DcLink", "RefusedReason"))]


def faults(rig: Rig) -> tuple[int, int]:
    rig.advance(0.11)  # the cycle of the message and a margin
    return int(rig.signal("INV_Faults", "DriveFaults")), int(rig.signal("INV_Faults", "EcuFaults"))


def reset(rig: Rig) -> None:
    rig.ask(enable=False, mode="off", torque_Nm=0.0, reset=True)
    rig.advance(0.05)
    rig.ask(reset=False)
    rig.advance(0.05)


def test_the_way_to_torque_and_back_visits_every_state_in_order(rig: Rig) -> None:
    rig.start()
    rig.advance(0.1)
    rig.ask(enable=False)
    rig.wait_for("ready")
    rig.ask(mode="off")
    rig.wait_for("standby", 6.0)
    seen = rig.series("INV_Status", "State")[1]
    order = [int(state) for k, state in enumerate(seen) if k == 0 or state != seen[k - 1]]
    names = {0: "init", 1: "standby", 2: "precharge", 3: "ready", 4: "run", 8: "discharge"}
    assert [names[state] for state in order if state != 0] == [
        "standby", "precharge", "ready", "run", "ready", "discharge", "standby",
    ]  # fmt: skip


def test_enable_with_a_torque_request_is_refused(rig: Rig) -> None:
    rig.ask(mode="torque")
    rig.wait_for("ready")
    rig.ask(enable=True, torque_Nm=10.0)
    rig.advance(0.1)
    assert (rig.state, refusal(rig)) == ("ready", "torque_request_not_zero")
    assert rig.signal("INV_Status", "TorqueCommanded") == 0.0


def test_an_enable_that_was_refused_needs_a_new_edge(rig: Rig) -> None:
    rig.ask(mode="torque")
    rig.wait_for("ready")
    rig.ask(enable=True, torque_Nm=10.0)
    rig.advance(0.1)
    rig.ask(torque_Nm=0.0)
    rig.advance(0.1)
    assert rig.state == "ready"
    rig.ask(enable=False)
    rig.advance(0.05)
    rig.ask(enable=True)
    rig.wait_for("run")


def test_enable_before_the_dc_link_is_charged_is_refused(rig: Rig) -> None:
    rig.ask(enable=True)
    rig.advance(0.1)
    assert (rig.state, refusal(rig)) == ("standby", "not_ready")


def test_the_commissioning_mode_is_locked_on_the_bus(rig: Rig) -> None:
    rig.ask(mode="current_locked")
    rig.advance(0.1)
    rig.ask(enable=True)
    rig.advance(0.1)
    assert (rig.state, refusal(rig)) == ("standby", "mode_locked")


@pytest.mark.plant
def test_enable_before_the_angle_is_absolute_is_refused(rig: Rig) -> None:
    """An encoder counts, and its index has not passed: the state machine waits in ready, without switching."""
    rig.stand.set(board_angle_unknown=1.0)
    rig.ask(mode="torque")
    rig.wait_for("ready")
    rig.ask(enable=True)
    rig.advance(0.1)
    assert (rig.state, refusal(rig)) == ("ready", "angle_not_absolute")
    rig.stand.set(board_angle_unknown=0.0)
    rig.ask(enable=False)
    rig.advance(0.05)
    rig.ask(enable=True)
    rig.wait_for("run")


def test_disable_under_torque_ramps_to_zero_and_then_disables_switching(rig: Rig) -> None:
    rig.start(50.0)
    rig.advance(0.3)
    assert rig.signal("INV_Status", "TorqueCommanded") == pytest.approx(50.0, abs=0.1)
    rig.ask(enable=False)
    rig.wait_for("ready", 0.5)
    commands = rig.series("INV_Status", "TorqueCommanded", rig.now_s - 0.2)[1]
    assert commands.min() >= 0.0 and commands[-1] == 0.0


@pytest.mark.plant
@pytest.mark.parametrize("speed_rpm", [0.0, 3.0, 30.0, 300.0])
@pytest.mark.parametrize("noise_A", [0.0, 0.05, 0.2, 0.5, 1.0])
def test_a_healthy_drive_does_not_trip_however_slow_and_noisy(rig: Rig, noise_A: float, speed_rpm: float) -> None:
    """Near standstill a monitor that divides by the speed or waits for samples to change would trip first."""
    rig.stand.set(current_noise_A_rms=noise_A)
    rig.turn(speed_rpm)
    rig.start()
    for torque_Nm in (0.0, 5.0, 50.0, -50.0, 0.0):
        rig.ask(torque_Nm=torque_Nm)
        rig.advance(0.5)
        assert rig.state == "run", f"{torque_Nm:g} N·m: {rig.state}, faults {faults(rig)}"


@pytest.mark.plant
@pytest.mark.parametrize(
    ("cause", "drive", "ecu"),
    [
        ({"board_gate_fault": 1.0}, DRIVER, GATE),
        ({"vdc_V": 460.0}, OVER_VOLTAGE, 0),
        ({"current_offset_A_b": 60.0}, CURRENT_SUM, 0),
    ],
    ids=["gate_driver", "over_voltage", "current_sum"],
)
def test_a_fault_under_torque_ends_in_fault_with_no_torque_and_is_told(
    rig: Rig, cause: dict[str, Any], drive: int, ecu: int
) -> None:
    rig.expected.faults = True
    rig.start(40.0)
    rig.advance(0.2)
    rig.stand.set(**cause)
    rig.wait_for("fault", 0.5)
    assert faults(rig) == (drive, ecu)
    bit = (drive or ecu).bit_length()
    assert int(rig.signal("INV_Faults", "FirstFault")) == (bit if drive else 32 + bit)
    assert abs(rig.stand.get("truth.torque_mean_Nm")[0]) < 0.5
    # Without the cause, and with the dc link discharged, a reset clears the fault.
    rig.stand.set(**{name: {"vdc_V": 350.0}.get(name, 0.0) for name in cause})
    rig.ask(enable=False, mode="off", torque_Nm=0.0)
    rig.advance(1.0)
    reset(rig)
    rig.wait_for("standby", 6.0)
    assert faults(rig) == (0, 0)


@pytest.mark.plant
def test_a_reset_does_not_hide_a_fault_whose_cause_is_still_there(rig: Rig) -> None:
    rig.expected.faults = True
    rig.stand.set(board_gate_fault=1.0)
    rig.wait_for("fault")
    reset(rig)
    assert rig.state == "fault"
    assert faults(rig) == (0, GATE)


@pytest.mark.plant
def test_a_precharge_that_does_not_charge_ends_in_fault(rig: Rig) -> None:
    rig.expected.faults = True
    rig.stand.set(precharge_open=1.0)
    rig.ask(mode="torque")
    rig.wait_for("fault", 4.0)
    assert faults(rig) == (0, PRECHARGE)


@pytest.mark.plant
def test_a_discharge_that_does_not_discharge_ends_in_fault(rig: Rig) -> None:
    rig.expected.faults = True
    rig.ask(mode="torque")
    rig.wait_for("ready")
    rig.stand.set(discharge_open=1.0)
    rig.ask(mode="off")
    rig.wait_for("fault", 8.0)
    assert faults(rig) == (0, DISCHARGE)


@pytest.mark.plant
def test_a_battery_below_the_range_is_never_switched_on(rig: Rig) -> None:
    rig.expected.faults = True
    rig.stand.set(vdc_V=60.0)
    rig.ask(mode="torque")
    rig.wait_for("fault", 4.0)
    assert rig.stand.get("truth.vdc_V")[0] <= 60.0


def test_a_fault_reset_is_refused_while_enable_is_on(rig: Rig) -> None:
    rig.start()
    rig.ask(reset=True)
    rig.advance(0.05)
    assert (rig.state, refusal(rig)) == ("run", "reset_while_enabled")
    rig.ask(reset=False)
