# SPDX-License-Identifier: Apache-2.0
"""The whole ECU in simulated milliseconds: valid commands take effect, bad ones do not."""

import math

import pytest
from ecu import COMMAND, LIMITS, Ecu
from protection import protect

TORQUE = "torque_commanded_Nm"


@pytest.fixture
def ecu():
    """An ECU on a bus, not yet powered up."""
    made = Ecu()
    yield made
    made.close()


@pytest.fixture
def running(ecu: Ecu) -> Ecu:
    """In state run, without torque, rolling slowly."""
    ecu.power_up()
    for _ in range(60):
        ecu.speed_rad_s += 0.5
        ecu.run(1)
    assert ecu.state == "run"
    return ecu


def at_40_Nm(ecu: Ecu) -> None:
    """A steady torque."""
    ecu.run(100, TorqueRequested=40.0)
    assert ecu.get(TORQUE) == pytest.approx(40.0, abs=0.02)


def test_power_up_passes_through_all_states_in_order(ecu: Ecu) -> None:
    seen: list[str] = []
    for step in range(600):
        if step == 100:
            ecu.command["Mode"] = "torque"
        if step == 400:
            ecu.command["Enable"] = 1
        ecu.run(1)
        if "INV_Status" in ecu.last and seen[-1:] != [ecu.state]:
            seen.append(ecu.state)
    assert seen == ["init", "standby", "precharge", "ready", "run"]
    assert ecu.get("run_state") == 1.0


# The resolution on the bus is 0.1 N·m; one count of the control is 9 mN·m on this machine.
@pytest.mark.parametrize("torque_Nm", [40.0, -40.0, 0.3, 132.0])
def test_a_command_reaches_the_torque_path_with_its_sign(running: Ecu, torque_Nm: float) -> None:
    running.run(200, TorqueRequested=torque_Nm)
    assert running.get(TORQUE) == pytest.approx(torque_Nm, abs=0.02)


def test_no_torque_exceeds_what_the_machine_may_give(running: Ecu) -> None:
    running.run(300, TorqueRequested=1000.0)
    assert running.get(TORQUE) == pytest.approx(132.0, abs=0.02)


# Speed of the rotor in rad/s, requested torque, torque wanted: drive limit 30 N·m, regeneration limit 20 N·m.
@pytest.mark.parametrize(("speed", "torque_Nm", "wanted"), [
    (100.0, 80.0, 30.0), (100.0, -80.0, -20.0), (-100.0, 80.0, 20.0), (-100.0, -80.0, -30.0)])  # fmt: skip
def test_drive_and_regen_limits_hold_in_four_quadrants(
    running: Ecu, speed: float, torque_Nm: float, wanted: float
) -> None:
    for _ in range(100):
        running.speed_rad_s += speed / 100.0
        running.run(1)
    running.run(100, TorqueLimitDrive=30.0, TorqueLimitRegen=20.0)
    running.run(60, TorqueRequested=torque_Nm)
    assert running.state == "run"
    assert running.get(TORQUE) == pytest.approx(wanted, abs=0.02)


# The last good frame is at t = 0; 30 ms later the command times out, and a ramp of 15 ms takes full torque to zero.
def test_a_lost_command_ends_full_torque_within_50_ms_of_the_last_good_frame(running: Ecu) -> None:
    running.run(300, TorqueRequested=1000.0)
    while running.time_ms % 10 != 1:
        running.run(1)
    running.talking = False  # the frame before this millisecond was the last
    torque = []
    for _ in range(60):
        running.run(1)
        torque.append(running.get(TORQUE))
    assert all(t == pytest.approx(132.0, abs=0.02) for t in torque[:27])
    assert torque[28] > 0.0
    gone = next(k for k, t in enumerate(torque) if t == 0.0)
    assert gone + 2 <= 50
    assert running.state == "ready"
    assert running.get("run_state") != 1.0
    running.run(50)
    assert running.last["INV_DiagReceive"]["TimeOuts"] == 1


def test_after_a_time_out_torque_returns_only_after_enable_was_off_and_the_request_zero(running: Ecu) -> None:
    at_40_Nm(running)
    running.talking = False
    running.run(100)
    running.talking = True
    running.run(100)
    assert running.state == "ready"
    running.run(30, Enable=0)
    running.run(30, Enable=1)
    assert running.last["INV_DcLink"]["RefusedReason"] == "torque_request_not_zero"
    running.run(30, Enable=0, TorqueRequested=0.0)
    running.run(30, Enable=1)
    assert running.state == "run"


def bad_crc(data: bytes) -> bytes:
    """One bit wrong."""
    return bytes([data[0] ^ 1]) + data[1:]


# Three bad ones of the last ten frames are the limit.
def test_three_bad_of_ten_end_the_torque_and_are_a_latched_fault(running: Ecu) -> None:
    at_40_Nm(running)
    frame_id = running.dbc.get_message_by_name(COMMAND).frame_id
    for _ in range(2):
        running.put(frame_id, bad_crc(running.encode(COMMAND, running.command)))
    running.counters[COMMAND] = (running.counters[COMMAND] - 2) % 15
    running.run(1)
    running.run(30)
    assert running.state == "run"
    running.put(frame_id, bad_crc(running.encode(COMMAND, running.command)))
    running.counters[COMMAND] = (running.counters[COMMAND] - 1) % 15
    running.run(40)
    assert running.state == "fault"
    assert running.get(TORQUE) == 0.0
    running.run(100)
    faults = running.last["INV_Faults"]
    assert (faults["EcuFaults"], faults["FirstFault"], faults["DriveFaults"]) == (1, "ecu_protection", 0)
    assert running.last["INV_DiagProtection"]["CrcErrors"] == 3


def test_a_fault_is_left_by_a_reset_with_enable_off_and_a_new_power_up(running: Ecu) -> None:
    test_three_bad_of_ten_end_the_torque_and_are_a_latched_fault(running)
    running.run(30, FaultReset=1)
    assert running.state == "fault"
    assert running.last["INV_DcLink"]["RefusedReason"] == "reset_while_enabled"
    running.run(30, FaultReset=0, Enable=0, TorqueRequested=0.0)
    running.run(100, FaultReset=1)
    assert running.state == "ready"  # through standby and precharge at once, because the dc link is still charged
    assert running.last["INV_Faults"]["EcuFaults"] == 0
    running.run(30, FaultReset=0, Enable=1)
    assert running.state == "run"


def test_a_request_beyond_the_machine_comes_down_as_fast_as_any(running: Ecu) -> None:
    running.run(300, TorqueRequested=1000.0)
    running.run(100, TorqueRequested=0.0)
    assert running.get(TORQUE) == 0.0


def test_a_trip_reaches_the_bus_as_safe_state_with_its_first_fault(running: Ecu) -> None:
    at_40_Nm(running)
    running.set("current_offset_A_a", 390.0)  # beyond the trip of 300 A
    running.run(200)
    assert running.state == "fault"  # the machine is slow, so the safe state need not be held
    assert running.last["INV_Faults"]["FirstFault"] == "over_current"
    assert int(running.last["INV_Faults"]["DriveFaults"]) & 1
    assert running.get("run_state") != 1.0


def test_the_safe_state_is_held_while_the_machine_turns_fast(running: Ecu) -> None:
    for _ in range(300):
        running.speed_rad_s += 2.0
        running.run(1)
    running.set("current_offset_A_a", 390.0)
    running.run(3)
    running.set("current_offset_A_a", 0.0)
    running.run(200)
    assert running.state == "safe_state"
    while running.speed_rad_s > 0.0:  # a sudden stop would be an angle fault, after which the speed is unknown
        running.speed_rad_s = max(running.speed_rad_s - 2.0, 0.0)
        running.run(1)
    running.run(300)
    assert running.state == "fault"


# Each of these frames requests 60.1 N·m, a large change; none may take effect.
@pytest.mark.parametrize(("kind", "counter"), [
    ("CrcErrors", "INV_DiagProtection"), ("Repeated", "INV_DiagProtection"), ("Jumps", "INV_DiagProtection"),
    ("LengthErrors", "INV_DiagProtection"), ("RangeErrors", "INV_DiagReceive"), ("IdErrors", "INV_DiagReceive"),
])  # fmt: skip
def test_one_violation_is_counted_by_its_kind_and_not_obeyed(running: Ecu, kind: str, counter: str) -> None:
    at_40_Nm(running)
    while running.time_ms % 10 != 5:
        running.run(1)
    message = running.dbc.get_message_by_name(COMMAND)
    following = running.counters[COMMAND]
    values = {**running.command, "TorqueRequested": 60.1, "Crc": 0, "Counter": following}
    if kind == "RangeErrors":
        values["TorqueRequested"] = 1000.1
    if kind == "Repeated":
        values["Counter"] = (following - 1) % 15
    if kind == "Jumps":
        values["Counter"] = (following + 5) % 15
    data_id = 0x1111 if kind == "IdErrors" else 0x1101
    data = protect(data_id, bytearray(message.encode(values, strict=False)))
    if kind == "CrcErrors":
        data = bad_crc(data)
    if kind == "LengthErrors":
        data = data[:7]
    running.put(message.frame_id, data)
    highest = 0.0
    for _ in range(4):
        running.run(1)
        highest = max(highest, running.get(TORQUE))
    assert highest == pytest.approx(40.0, abs=0.02)
    running.run(100)
    assert running.last[counter][kind] >= 1
    others = {name: value for frame in ("INV_DiagProtection", "INV_DiagReceive")
              for name, value in running.last[frame].items() if name not in (kind, "Accepted")}  # fmt: skip
    # after a jump the next frame of the true sender is a jump or a repetition, too
    allowed = {"Jumps": ("Repeated",), "RangeErrors": ("Repeated",)}.get(kind, ())
    assert all(value == 0 for name, value in others.items() if name not in allowed)


def test_an_unprotected_command_is_never_obeyed(ecu: Ecu) -> None:
    ecu.talking = False
    ecu.set("vdc_V", 350.0)
    message = ecu.dbc.get_message_by_name(COMMAND)
    for counter in range(200):
        data = message.encode({**ecu.command, "Mode": "torque", "Enable": 1, "Crc": 0, "Counter": counter % 15})
        ecu.put(message.frame_id, data)
        ecu.run(10)
    assert ecu.state in ("standby", "fault")
    assert ecu.last["INV_DiagReceive"]["Accepted"] == 0


def test_lost_battery_limits_take_the_torque_away_and_tell_why(running: Ecu) -> None:
    limits = {"PowerLimitDrive": 100.0, "PowerLimitRegen": 50.0}
    for _ in range(5):
        running.send(LIMITS, limits)
        running.run(100, TorqueRequested=40.0)
    assert running.get(TORQUE) == pytest.approx(40.0, abs=0.02)
    assert running.last["INV_DcLink"]["DeratingReason"] == "none"
    running.run(300)
    assert running.state == "derate"
    assert running.get(TORQUE) == 0.0
    assert running.last["INV_DcLink"]["DeratingReason"] == "battery_limits_lost"
    for _ in range(3):
        running.send(LIMITS, limits)
        running.run(50)
    assert running.state == "run"
    assert running.get(TORQUE) == pytest.approx(40.0, abs=0.02)


# At 210 rad/s 5 kW are 24 N·m without losses, so less at the shaft. The limits are sent every 100 ms.
def test_battery_power_limits_hold_in_both_directions_and_tell_why(running: Ecu) -> None:
    for _ in range(360):
        running.speed_rad_s += 0.5
        running.run(1)
    for torque_Nm, power_kW in ((60.0, 5.0), (-60.0, -3.0)):
        for _ in range(10):
            running.send(LIMITS, {"PowerLimitDrive": 5.0, "PowerLimitRegen": 3.0})
            running.run(100, TorqueRequested=torque_Nm)
        electrical_kW = running.truth("idc_A") * running.truth("vdc_V") / 1000.0
        assert electrical_kW == pytest.approx(power_kW, abs=0.25)
        assert abs(electrical_kW) <= abs(power_kW) + 0.1
        assert running.state == "derate"
        assert running.last["INV_DcLink"]["DeratingReason"] == "battery_power"


def test_mode_off_opens_the_contactor_and_discharges(running: Ecu) -> None:
    running.run(30, Enable=0)
    running.run(20, Mode="off")
    assert running.state == "discharge"
    assert running.truth("vdc_V") > 60.0
    running.run(200)  # 350 V exp(-t/0.1 s) are 60 V after 176 ms
    assert running.state == "standby"
    assert running.truth("vdc_V") < 60.0


@pytest.mark.parametrize(("speed_rpm", "command", "limit", "torque_Nm"), [
    (1000.0, {"TorqueRequested": 60.0}, "none", 60.0),
    (1000.0, {"TorqueRequested": 900.0}, "rated_torque", 132.0),
    (1000.0, {"TorqueRequested": -900.0}, "rated_torque", -132.0),
    (1000.0, {"TorqueRequested": 100.0, "TorqueLimitDrive": 50.0}, "vehicle_limit", 50.0),
    (1000.0, {"TorqueRequested": 50.0, "TorqueLimitDrive": 50.0}, "none", 50.0),
    (1000.0, {"TorqueRequested": 100.0, "TorqueLimitRegen": 50.0}, "none", 100.0),
    (1000.0, {"TorqueRequested": -100.0, "TorqueLimitRegen": 50.0}, "vehicle_limit", -50.0),
    (7500.0, {"TorqueRequested": 132.0}, "reach", None),
])  # fmt: skip
def test_a_request_beyond_a_limit_is_told(
    running: Ecu, speed_rpm: float, command: dict, limit: str, torque_Nm: float | None
) -> None:
    step_rad_s = (speed_rpm * math.pi / 30.0 - running.speed_rad_s) / 500
    for _ in range(500):
        running.speed_rad_s += step_rad_s
        running.run(1)
    running.run(500, **command)
    told = running.last["INV_Limits"]
    assert str(told["RequestLimit"]) == limit
    wanted = told["TorqueMax"] if torque_Nm is None else torque_Nm
    assert running.last["INV_Status"]["TorqueCommanded"] == pytest.approx(wanted, abs=0.03 * abs(wanted))


def test_the_locked_commissioning_mode_is_refused(running: Ecu) -> None:
    running.run(30, Enable=0)
    running.run(30, Enable=1, Mode="current_locked")
    assert running.state == "ready"
    assert running.last["INV_DcLink"]["RefusedReason"] == "mode_locked"


def test_what_is_sent_is_what_the_drive_has(running: Ecu) -> None:
    running.set("winding_C", 63.4)
    running.run(300, TorqueRequested=25.0)
    status, dc_link = running.last["INV_Status"], running.last["INV_DcLink"]
    assert status["TorqueCommanded"] == pytest.approx(25.0, abs=0.05)
    assert dc_link["DcVoltage"] == pytest.approx(350.0, abs=0.3)  # one count of the converter is 0.13 V
    assert running.last["INV_Temperatures"]["Winding"] == pytest.approx(63.4, abs=0.05)
    assert running.last["INV_Temperatures"]["WindingValid"] == "yes"
    assert running.run_until("INV_Currents")["IqRef"] == pytest.approx(running.get("iq_ref_A"), abs=0.051)
    psi_mVs = running.run_until("INV_Identification")["PsiF"]
    assert psi_mVs == pytest.approx(1e3 * running.get("psi_f_Vs"), abs=0.006)
    assert running.last["INV_Version"]["Minor"] == 1


# 2200 rpm and 40 N·m are 9.2 kW at the shaft. The dc current on the bus is an estimate without the losses of the bridge
# (dead time), which the plant's true current contains.
def test_torque_speed_and_dc_current_are_those_of_the_plant(running: Ecu) -> None:
    for _ in range(400):
        running.speed_rad_s += 0.5
        running.run(1)
    for torque_Nm in (40.0, -40.0):
        running.run(1000, TorqueRequested=torque_Nm)
        assert running.state == "run"
        status = running.last["INV_Status"]
        assert status["TorqueEstimated"] == pytest.approx(running.truth("torque_mean_Nm"), abs=0.4)
        assert status["Speed"] == pytest.approx(running.truth("speed_rpm"), abs=3.0)
        assert running.last["INV_DcLink"]["DcCurrent"] == pytest.approx(running.truth("idc_A"), abs=2.0)


# The plant's L_q is 8 % above the tables: the identified scale approaches 108 %, in the drive and on the bus.
def test_a_wrong_table_shows_in_the_table_scale(running: Ecu) -> None:
    running.set("lq_scale", 1.08)
    for _ in range(600):
        running.speed_rad_s += 0.5
        running.run(1)
    for torque_Nm in (30.0, 60.0, -40.0, 80.0, 20.0, 50.0) * 3:
        running.run(300, TorqueRequested=torque_Nm)
    assert running.state == "run"
    assert running.last["INV_Identification"]["TableScale"] == pytest.approx(108.0, abs=2.0)


def test_speed_is_told_in_revolutions_per_minute_with_its_sign(ecu: Ecu) -> None:
    for speed_rad_s in (100.0, -100.0):
        ecu.speed_rad_s = speed_rad_s
        ecu.run(300)
        assert ecu.last["INV_Status"]["Speed"] == pytest.approx(speed_rad_s * 30.0 / math.pi, abs=2.0)


# The queue of the receive interrupt holds 64 frames. The command of that millisecond is lost, too.
def test_a_flood_of_frames_between_two_tasks_is_counted_and_harms_nothing(running: Ecu) -> None:
    at_40_Nm(running)
    for k in range(1000):
        running.put(0x300 + k % 256, bytes(8))
    running.run(100)
    assert running.state == "run"
    assert running.last["INV_DiagBus"]["LostFrames"] == 1001 - 64
    assert running.last["INV_DiagBus"]["Ignored"] == 64
