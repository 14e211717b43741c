# SPDX-License-Identifier: Apache-2.0
"""End-to-end protection: corrupted commands, repetitions, jumps, and valid frames with values out of range.

Why no corruption of one or two bits can be taken for a good frame: the CRC is linear, so a corruption e(x) of the 64
bits of a frame (7 bytes of data, then the CRC) goes unnoticed if and only if p(x) = x^8 + x^4 + x^3 + x^2 + 1 divides
e(x). p is primitive: x has order 255 modulo p, a fact test_the_proof_holds() computes. One bit is e = x^i, which p
never divides; two are e = x^i (x^k + 1) with 1 <= k <= 63 < 255, and p divides x^k + 1 only if 255 divides k. The data
id is the same in both CRCs and cancels. A corruption of three or more bits passes with a probability of about 2^-8;
after the CRC the counter and the ranges are checked.
"""

from collections.abc import Callable
from itertools import combinations

import e2e
import numpy as np
import pytest
from crccheck.crc import Crc8Base
from rig import COMMAND, MS, Rig

BITS = 64
PER_COMMAND = 15  # corrupted frames between two good ones; with them the load of the bus is 60 %


class _J1850(Crc8Base):  # type: ignore[misc]
    _poly, _initvalue, _reflect_input, _reflect_output, _xor_output = 0x1D, 0x00, False, False, 0x00


def flipped(frame: bytes, bits: tuple[int, ...]) -> bytes:
    """The frame with these bits wrong; bit 0 is the first on the wire."""
    value = int.from_bytes(frame, "big")
    for bit in bits:
        value ^= 1 << (BITS - 1 - bit)
    return value.to_bytes(8, "big")


def test_the_crc_agrees_with_a_published_example_and_with_a_library() -> None:
    # AUTOSAR PRS_E2EProtocol, profile 11, data-id mode BOTH, data id 0x123, no data: CRC 0xCC, with counter 1 0x91.
    assert e2e.crc(0x123, bytes(8)) == 0xCC
    assert e2e.crc(0x123, bytes([0, 1, 0, 0, 0, 0, 0, 0])) == 0x91
    rng = np.random.default_rng(1)
    for _ in range(1000):
        data = rng.bytes(8)
        assert e2e.crc(0x1101, data) == _J1850.calc(bytes([0x01, 0x11]) + data[1:])


def test_the_proof_holds() -> None:
    powers = [e2e.remainder(1 << k) for k in range(1, 256)]
    assert powers.index(1) == 254  # x^255 is the first power that is 1
    assert 0 not in powers


@pytest.mark.plant
def test_no_corruption_of_one_or_two_bits_is_accepted_with_any_counter(rig: Rig) -> None:
    """2080 corruptions of a dangerous command with each of 15 counters, sent while that counter is the expected one."""
    rig.expected.faults = rig.expected.frames = rig.expected.load = True
    rig.expected.counters |= {"CrcErrors", "IdErrors", "TimeOuts"}  # TimeOuts before and after the frames
    corruptions = [(i,) for i in range(BITS)] + list(combinations(range(BITS), 2))
    todo = {counter: list(corruptions) for counter in range(e2e.COUNTERS)}
    command_id, data_id = rig.by_name[COMMAND].frame_id, rig.data_id(COMMAND)
    rig.is_sending = False
    rig.keep_frames = False
    rig.ask(mode="torque", enable=True, torque_Nm=100.0)
    dangerous = rig.encode(rig.command)
    rig.ask(mode="off", enable=False, torque_Nm=0.0)
    harmless = rig.encode(rig.command)
    rig.advance(0.31)
    accepted = rig.signal("INV_DiagReceive", "Accepted")
    refused = rig.signal("INV_DiagProtection", "CrcErrors") + rig.signal("INV_DiagReceive", "IdErrors")
    sent = good = 0
    counter = int(e2e.counter_of(rig.next_command()))
    while any(todo.values()):
        rig.send(command_id, e2e.protect(data_id, harmless, counter))
        good += 1
        counter = (counter + 1) % e2e.COUNTERS
        frame = e2e.protect(data_id, dangerous, counter)
        for _ in range(PER_COMMAND):
            if todo[counter]:
                rig.send(command_id, flipped(frame, todo[counter].pop()))
                sent += 1
        rig.advance(10 * MS)
        assert rig.signal("INV_Status", "TorqueCommanded") == 0.0
    rig.advance(0.11)
    assert sent == 31200
    now = rig.signal("INV_DiagProtection", "CrcErrors") + rig.signal("INV_DiagReceive", "IdErrors")
    assert now - refused == sent
    # Every good frame was accepted except the first one, which only synchronises the counter.
    assert (rig.signal("INV_DiagReceive", "Accepted") - accepted) % 65536 == good - 1
    assert rig.state in ("standby", "fault")
    rig.skip_counters(counter - 1)


def test_every_kind_of_violation_has_its_counter(rig: Rig) -> None:
    rig.expected.counters |= {"CrcErrors", "Repeated", "Jumps", "LengthErrors", "IdErrors", "SkippedCommands"}
    rig.expected.faults = True
    rig.advance(0.5)
    command_id = rig.by_name[COMMAND].frame_id
    data = rig.encode(rig.command)

    def violations() -> dict[str, float]:
        rig.advance(0.21)
        names = {"INV_DiagProtection": ("CrcErrors", "Repeated", "Jumps", "LengthErrors"),
                 "INV_DiagReceive": ("IdErrors",)}  # fmt: skip
        return {s: rig.signal(m, s) for m, signals in names.items() for s in signals}

    def counted(send: Callable[[], object]) -> dict[str, float]:
        before = violations()
        send()
        after = violations()
        return {name: after[name] - before[name] for name in after if after[name] != before[name]}

    good = rig.next_command
    assert counted(lambda: rig.send(command_id, flipped(good(), (20,)))) == {"CrcErrors": 1.0}
    assert counted(lambda: (rig.send(command_id, frame := good()), rig.send(command_id, frame))) == {"Repeated": 1.0}
    assert counted(lambda: rig.send(command_id, good()[:7])) == {"LengthErrors": 1.0}
    other = e2e.protect(rig.data_id("VCU_BatteryLimits"), data, 0)
    assert counted(lambda: rig.send(command_id, other)) == {"IdErrors": 1.0}


@pytest.mark.plant
def test_a_jump_of_the_counter_is_refused_once_and_then_followed(rig: Rig) -> None:
    rig.expected.counters |= {"Jumps", "SkippedCommands"}
    rig.start(10.0)
    rig.advance(0.3)
    rig.skip_counters(5)
    rig.advance(0.3)
    assert rig.state == "run"
    assert rig.signal("INV_DiagProtection", "Jumps") == 1.0


@pytest.mark.plant
def test_three_bad_commands_of_ten_end_in_fault_without_torque(rig: Rig) -> None:
    rig.expected.faults = True
    rig.expected.counters |= {"CrcErrors"}
    rig.start(60.0)
    rig.advance(0.5)
    command_id = rig.by_name[COMMAND].frame_id
    for _ in range(3):
        rig.send(command_id, bytes(8))
        rig.advance(10 * MS)
    rig.wait_for("fault", 0.2)
    assert abs(rig.stand.get("truth.torque_mean_Nm")[0]) < 1.0
    rig.advance(0.1)
    assert int(rig.signal("INV_Faults", "EcuFaults")) == 1


@pytest.mark.plant
@pytest.mark.parametrize("signal", ["torque", "limit_drive", "limit_regen", "mode"])
def test_a_request_out_of_range_never_reaches_the_torque_path(rig: Rig, signal: str) -> None:
    rig.expected.faults = True
    rig.expected.counters |= {"RangeErrors", "TimeOuts", "SkippedCommands"}
    rig.start(10.0)
    rig.advance(0.3)
    command_id, data_id = rig.by_name[COMMAND].frame_id, rig.data_id(COMMAND)
    frame = bytearray(rig.next_command())
    if signal == "mode":
        frame[1] |= 0xC0  # 3: reserved
    else:
        at = {"torque": 2, "limit_drive": 4, "limit_regen": 6}[signal]
        frame[at : at + 2] = (0x7FFF if signal == "torque" else 0xFFFF).to_bytes(2, "little")
    rig.send(command_id, e2e.protect(data_id, bytes(frame), frame[1] & 0xF))
    since_s = rig.now_s
    rig.advance(0.2)
    assert rig.signal("INV_DiagReceive", "RangeErrors") == 1.0
    asked = rig.series("INV_Status", "TorqueCommanded", since_s)[1]
    assert np.abs(asked - 10.0).max() <= 0.1
