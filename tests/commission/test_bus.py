# SPDX-License-Identifier: Apache-2.0
"""Commissioning over CAN, on the virtual ECU with hidden machines."""

import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest
from bus_stand import COMMAND_ID, COMMISSION_ID, Stand, bus_stand

from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.bus.interface import COMMAND, read_interface
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission import on_the_bus
from fluxtrue_tools.commission.bursts import Burst, offset, record
from fluxtrue_tools.commission.bus import (
    FIELDS,
    PULSE_SET,
    PULSE_START,
    PULSE_STATE,
    STOPPED,
    USER,
    OverTheBus,
    pulsing,
)
from fluxtrue_tools.commission.drive import DONE, FAILED
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import balance_error, score
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope.xcp import XcpMaster, XcpRefused
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.vecu.process import VirtualEcu
from fluxtrue_tools.vecu.stepped import connect

NAME, SEED = "saturated", 12
R_SHARE, MAP_RMS, BALANCE = 0.01, 0.01, 0.002
SMALL = Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=4)
LONG = Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=1000, periods=2000)
TINY, TINY_BURSTS = Burst(0.15, 0.0, (-5.0, 5.0), (-5.0, 5.0), reversals=5), 5
START_DEG_S = 30.0  # electrical
OFFSETS_ALONG_Q = -0.8985  # of the rotor: the current of the sensors' offsets makes most torque
REFUSED = 1.0
LOCKED, OUT_OF_RANGE, SYNTAX = 0x25, 0x22, 0x21
OFF_S = 0.2  # command time-out 30 ms, ramp 15 ms
TIME_OUT_S = 0.05  # 30 ms after the last frame
READY_S = 5.0


@pytest.fixture
def whole(unknown: Motor, known: Nameplate, tmp_path: Path) -> Iterator[Stand]:
    """For a commissioning from its first step on."""
    with bus_stand(unknown, known, tmp_path, (NAME, SEED), connected=True) as made:
        yield made


@pytest.fixture
def stand(unknown: Motor, known: Nameplate, tmp_path: Path) -> Iterator[Stand]:
    """For single bursts and commands. No step has measured an offset of the dc-voltage sensor: it has none."""
    with bus_stand(unknown, known, tmp_path, (NAME, SEED), connected=True, vdc_offset_V=0.0) as made:
        yield made


def silence(stand: Stand) -> None:
    """The commands end, XCP goes on."""
    stand.clock.kept_back = frozenset({COMMAND_ID, COMMISSION_ID})


def during(drive: OverTheBus, action: Callable[[], None]) -> None:
    """Something happens when the pulses have begun."""
    ended = drive._until_ended

    def until_ended() -> float:
        action()
        return ended()

    drive._until_ended = until_ended  # type: ignore[method-assign]


def test_a_hidden_machine_is_measured_over_can(whole: Stand, unknown: Motor, known: Nameplate) -> None:
    found = run(whole.drive, chosen(("map",)), known, lambda _: None)
    assert found.surface is not None and found.resistance is not None and found.balance is not None
    reached = score(found.surface.model, whole.truth, known.i_max_A, whole.truth.psi_f_Vs)
    error = found.resistance.r_ohm / whole.truth.plant["r_ohm_20"] - 1.0
    print(f"map {reached}, R {100 * error:+.2f} %, largest current {found.largest_A:.1f} A, "
          f"{whole.stepped.now_s:.0f} s simulated")  # fmt: skip
    assert abs(error) <= R_SHARE
    assert reached.map_rms <= MAP_RMS
    assert balance_error(found.balance, whole.truth) <= BALANCE
    assert found.largest_A <= known.i_max_A
    whole.drive.switch_off()
    whole.line.pass_time(OFF_S)
    assert whole.line.state in ("standby", "discharge") and whole.drive.get("fault_word") == 0.0
    assert whole.drive.get("dead_time_compensation") == pytest.approx(1.0, abs=1e-3)


def test_a_light_rotor_stands_when_pulses_begin(small: Motor, plate: Nameplate, tmp_path: Path) -> None:
    """With the values set and the scope armed after the braking it turned with up to 47 degrees in a second, with the
    speed read as soon as the torque has ended with 43, and with torques shorter than a command's period with 66."""
    changed = {"theta_m_rad": OFFSETS_ALONG_Q, "vdc_offset_V": 0.0}
    with bus_stand(small, plate, tmp_path, ("hub", 103), connected=True, **changed) as stand:
        starts: list[float] = []
        offset_A, _ = offset(stand.drive)
        during(stand.drive, lambda: starts.append(plate.pole_pairs * stand.speed_rad_s()))
        stand.drive.set("enable", 1.0)
        for _ in range(TINY_BURSTS):
            record(stand.drive, TINY, replace(plate, offset_A=offset_A))
        print(np.round(np.degrees(starts)))
        assert len(starts) >= TINY_BURSTS
        assert np.degrees(max(starts)) <= START_DEG_S


def test_lost_commands_end_the_pulses_in_the_safe_state(stand: Stand, known: Nameplate) -> None:
    stand.drive.set("enable", 1.0)
    during(stand.drive, lambda: silence(stand))
    with pytest.raises(FluxtrueError, match="the inverter has stopped .state ready.: command timed out"):
        record(stand.drive, LONG, known)
    stand.line.pass_time(OFF_S)
    assert stand.drive.get("run_state") == 0.0 and stand.current_A() < 1.0


def agreed(stand: Stand) -> bool:
    return stand.drive._is_agreed_to_pulses()


def without_frames(stand: Stand) -> None:
    stand.clock.kept_back = frozenset({COMMISSION_ID})


def with_wrong_crc(stand: Stand) -> None:
    stand.line._moving_protector = Protector(COMMAND_ID)  # with the data id of none of the messages


def with_a_counter_that_stands(stand: Stand) -> None:
    protector = stand.line._moving_protector
    counter, protect = protector._counter, protector.protect

    def standing(data: bytes) -> bytes:
        protector._counter = counter
        return protect(data)

    protector.protect = standing  # type: ignore[method-assign]


def withdrawn(stand: Stand) -> None:
    stand.line.move(agrees_to_pulses=False)


ENDS = [without_frames, with_wrong_crc, with_a_counter_that_stands, withdrawn]


@pytest.mark.parametrize("end", ENDS)
def test_pulses_end_with_the_consent_and_the_drive_goes_on(
    end: Callable[[Stand], None], stand: Stand, known: Nameplate
) -> None:
    stand.drive.set("enable", 1.0)
    during(stand.drive, lambda: end(stand))
    with pytest.raises(FluxtrueError, match="^commission: voltage pulses without a consent"):
        record(stand.drive, LONG, known)
    stand.line.pass_time(OFF_S)
    assert stand.drive.get("run_state") == 1.0 and stand.drive.get("fault_word") == 0.0
    assert stand.current_A() < 1.0
    assert not agreed(stand)


@pytest.mark.parametrize("end", ENDS)
def test_a_start_after_the_consent_has_ended_is_refused_with_one_message(
    end: Callable[[Stand], None], stand: Stand, known: Nameplate
) -> None:
    stand.drive.set("enable", 1.0)
    end(stand)
    stand.drive.rest(TIME_OUT_S)
    with pytest.raises(FluxtrueError, match="^commission: voltage pulses without a consent"):
        record(stand.drive, SMALL, known)


def test_a_consent_is_not_given_in_run(stand: Stand, known: Nameplate) -> None:
    stand.drive.set("enable", 1.0)
    for is_agreed in (False, True):
        stand.line.move(agrees_to_pulses=is_agreed)
        stand.drive.rest(TIME_OUT_S)
        assert not agreed(stand)
    with pytest.raises(FluxtrueError, match="^commission: voltage pulses without a consent"):
        record(stand.drive, SMALL, known)
    stand.drive.set("enable", 0.0)
    stand.drive.set("enable", 1.0)
    assert record(stand.drive, SMALL, known).failure == ""


def test_a_consent_that_is_not_accepted_is_one_message(stand: Stand) -> None:
    without_frames(stand)
    with pytest.raises(FluxtrueError, match="no consent to voltage pulses .state ready."):
        stand.drive.set("enable", 1.0)


def test_a_consent_beside_a_torque_request_is_refused(stand: Stand) -> None:
    stand.line.ask(mode="torque", torque_Nm=5.0, limit_Nm=10.0)
    stand.line.wait_for(("ready",), READY_S, "test")
    for is_agreed in (False, True):
        stand.line.move(agrees_to_pulses=is_agreed)
        stand.line.pass_time(TIME_OUT_S)
    assert not agreed(stand)


def test_a_consent_lasts_without_pulses_and_ends_with_the_dc_link(stand: Stand) -> None:
    stand.drive.set("enable", 1.0)
    stand.drive.rest(1.0)
    assert agreed(stand)
    stand.line.ask(mode="off", enable=False)
    stand.line.pass_time(1.0)
    assert not agreed(stand)


def test_a_firmware_without_the_commands_for_pulses_is_refused(
    stand: Stand, known: Nameplate, unknown: Motor, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one of an earlier version."""
    monkeypatch.setattr("fluxtrue_tools.commission.bus.PULSE_STATE", 0x7F)
    with pytest.raises(FluxtrueError, match="this firmware has no commands for voltage pulses"):
        OverTheBus(stand.line, read(unknown.folder.vecu), known, unknown.plant["vdc_V"])


def test_a_capture_with_lost_samples_ends_the_step(stand: Stand, known: Nameplate) -> None:
    """The counter is set in what the tool reads: the virtual ECU loses none."""
    scope = stand.drive._scope
    header = scope._header
    scope._header = lambda: header() | {"lost": 1}  # type: ignore[method-assign]
    with pytest.raises(FluxtrueError, match="commission: the inverter lost samples once"):
        run(stand.drive, chosen(("resistance",)), known, lambda _: None)


def test_a_closed_connection_is_one_message(stand: Stand, known: Nameplate) -> None:
    during(stand.drive, lambda: (stand.ecu.stop(), None)[1])
    with pytest.raises(FluxtrueError, match="the connection to the inverter is closed"):
        run(stand.drive, chosen(("resistance",)), known, lambda _: None)


def test_pulses_with_a_torque_request_are_refused(stand: Stand) -> None:
    stand.channel.set(imposed_speed=1.0, speed_rad_s=0.0)  # standing, so that only the request is refused
    stand.drive.set("enable", 1.0)
    stand.drive.push(5j)
    stand.drive.rest(0.05)
    stand.drive.pulse(SMALL.values())
    assert (stand.drive.get("pulses"), stand.drive.get("pulses_failure")) == (FAILED, REFUSED)
    stand.drive.let_go()
    stand.drive.rest(0.05)
    stand.drive.pulse(SMALL.values())
    assert (stand.drive.get("pulses"), stand.drive.get("pulses_failure")) == (DONE, 0.0)


def test_a_torque_request_ends_the_pulses(stand: Stand) -> None:
    stand.channel.set(imposed_speed=1.0, speed_rad_s=0.0)
    stand.drive.set("enable", 1.0)
    during(stand.drive, lambda: stand.drive.push(5j))
    stand.drive.pulse(LONG.values())
    assert (stand.drive.get("pulses"), stand.drive.get("pulses_failure")) == (FAILED, STOPPED)


def test_the_rotor_can_be_braked_again_after_switching_off(stand: Stand) -> None:
    """The limits of the command allow the brake's torque, 2 % of the largest current, in every step."""
    for _ in range(2):
        stand.drive.set("enable", 1.0)
        stand.channel.set(imposed_speed=1.0, speed_rad_s=0.0)
        stand.drive.push(5j)
        stand.drive.rest(0.1)
        status = stand.line._values.message("INV_Status")
        assert status is not None and status["TorqueCommanded"] > 4.0
        stand.drive.let_go()
        stand.drive.rest(0.1)
        stand.drive.switch_off()


def test_another_commander_on_the_bus_is_refused(stand: Stand) -> None:
    frame = read_interface().message(COMMAND).frame_id
    other = connect(stand.ecu.can_port)
    try:
        other.send(can.Message(arbitration_id=frame, data=bytes(8), is_extended_id=False))
        with pytest.raises(FluxtrueError, match="something else on this bus commands the inverter"):
            for _ in range(100):
                stand.drive.rest(0.01)
    finally:
        other.shutdown()


@pytest.mark.parametrize(("bytes_", "code"), [
    ((PULSE_SET, 0, 0, 0), LOCKED), ((PULSE_START,), LOCKED),
])  # fmt: skip
def test_pulses_need_the_key(stand: Stand, bytes_: tuple[int, ...], code: int) -> None:
    locked = XcpMaster(stand.line)  # a new session
    with pytest.raises(XcpRefused) as refused:
        locked.command(USER, *bytes_)
    assert refused.value.code == code
    assert locked.command(USER, PULSE_STATE)[:2] == bytes((0, 0))


@pytest.mark.parametrize(("bytes_", "code"), [
    ((PULSE_SET, len(FIELDS), 0, 0), OUT_OF_RANGE), ((PULSE_SET, 0, 0), SYNTAX), ((PULSE_SET,), SYNTAX),
])  # fmt: skip
def test_wrong_values_of_pulses_are_refused(stand: Stand, bytes_: tuple[int, ...], code: int) -> None:
    with pytest.raises(XcpRefused) as refused:
        stand.drive._master.command(USER, *bytes_)
    assert refused.value.code == code


def test_pulses_are_found_among_the_voltages_of_current_control() -> None:
    rng = np.random.default_rng(1)
    u_d, u_q = rng.normal(0.0, 4.0, 300), rng.normal(0.0, 4.0, 300)
    u_d[100:180] = np.where(np.arange(80) // 10 % 2, -30.0, 30.0) * rng.normal(1.0, 0.002, 80)
    u_q[100:190] = 0.0
    u_q[120:190] = 50.0
    u_d[181:200] = u_q[191:200] = 0.0
    acts = pulsing(u_d, u_q, 0.1, 0.2)
    assert np.flatnonzero(acts)[[0, -1]].tolist() == [100, 199]
    assert pulsing(u_d, u_q, 0.1, 0.0)[100:180].all()


@pytest.mark.parametrize("text", [
    "", "plant.r_ohm_20", "plant.r_ohm_20 x", "plant.r_ohm_20 0.01\nmap 2", "plant.r_ohm_20 0.01\nmap 2 2 0 1 0 1 1",
    "plant.r_ohm_20 0.01\nmap 1 2 0 0 1 0 0 0 0",
])  # fmt: skip
def test_the_virtual_ecu_refuses_what_is_no_machine(text: str, unknown: Motor, tmp_path: Path) -> None:
    machine = tmp_path / "machine.txt"
    machine.write_text(text)
    done = subprocess.run([unknown.folder.vecu, "--fast", "--port", "0", "--bench-port", "0", "--machine", machine],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 2 and done.stderr.startswith(f"error: --machine {machine}: no machine")


def test_the_command_writes_a_folder(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found"
    options = ["--motor", str(folder), "--virtual-ecu", "--machine", NAME, "--seed", str(SEED), "--step",
               "offsets,resistance", "--out", str(out)]  # fmt: skip
    assert command(["commission", *options]) == 0, capsys.readouterr().err
    assert "resistance:" in (out / "commission.txt").read_text(encoding="utf-8")
    assert command(["motor", "check", str(out)]) == 0


def test_after_a_lost_connection_nothing_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[VirtualEcu] = []

    class Noted(VirtualEcu):
        def __init__(self, program: Path, machine: Path | None = None) -> None:
            super().__init__(program, machine=machine)
            started.append(self)

    monkeypatch.setattr(on_the_bus, "VirtualEcu", Noted)
    monkeypatch.setattr(OverTheBus, "_until_ended", lambda drive: (started[0].stop(), drive._state())[1])
    out = tmp_path / "found"
    options = ["--motor", str(folder), "--virtual-ecu", "--step", "resistance", "--out", str(out)]
    assert command(["commission", *options]) == 2
    said = capsys.readouterr().err
    assert said.count("error: ") == 1 and "the connection to the inverter is closed" in said
    assert not list(tmp_path.iterdir())
