# SPDX-License-Identifier: Apache-2.0
"""Errors that the end-to-end protection detects: calculated for every pattern, and tested on the firmware."""

import itertools

import numpy as np
import pytest
from ecu import COMMAND, Ecu
from protection import crc8, crc_of, protect

FRAME_BITS = 64
DATA_ID = 0x1101


# The check value of this polynomial with start 0 and no inversion, as catalogues list it (CRC-8/GSM-A).
def test_the_independent_crc_has_the_catalogues_check_value() -> None:
    assert crc8(b"123456789") == 0x37


def syndromes() -> np.ndarray:
    """Change of (received CRC xor computed CRC) for each bit of a frame that is flipped."""
    effect = []
    for bit in range(FRAME_BITS):
        error = (1 << bit).to_bytes(8, "big")
        effect.append(error[0] ^ crc8(b"\0\0" + error[1:]))
    return np.array(effect, dtype=np.uint8)


def undetected(weight: int) -> tuple[int, int]:
    """Number of patterns with so many flipped bits that the CRC does not detect, and number of all such patterns."""
    effect = syndromes()
    if weight == 4:  # by pairs: faster than 635376 tuples in Python
        pairs = np.array([effect[i] ^ effect[j] for i, j in itertools.combinations(range(FRAME_BITS), 2)])
        counts = np.bincount(pairs, minlength=256)
        # An undetected set of four bits divides in three ways into two pairs with the same syndrome. Pairs that share a
        # bit cannot have the same syndrome, because the syndromes of all bits differ.
        return int((counts * (counts - 1) // 2).sum() // 3), 635376
    flipped = np.array(list(itertools.combinations(range(FRAME_BITS), weight)))
    return int((np.bitwise_xor.reduce(effect[flipped], axis=1) == 0).sum()), len(flipped)


# The polynomial is primitive, of period 255, and the code word of 10 bytes has 80 bits: no two bits have the same
# syndrome, none has syndrome 0. Three bits may cancel: Hamming distance 3.
def test_every_one_and_two_bit_error_is_detected_and_few_of_three_and_four_are_not() -> None:
    assert undetected(1) == (0, 64)
    assert undetected(2) == (0, 2016)
    assert undetected(3) == (198, 41664)  # 0.48 %, as the documentation states
    assert undetected(4) == (2453, 635376)  # 0.39 %


# A burst of at most 8 bits is a polynomial of degree below 8 times x^n, which is never a multiple of the generator, as
# long as the bits are sent in the order of the division. The CRC is sent before the data but divided after them, so a
# burst across their border is not one in that order: a few of those pass, and only the CRC-15 of CAN detects them.
def test_every_burst_of_up_to_eight_bits_is_detected_but_a_few_across_the_border_of_crc_and_data() -> None:
    effect = syndromes()[::-1]  # in the order of the wire
    missed = bursts = 0
    for start in range(FRAME_BITS):
        for pattern in range(1, 256, 2):  # the first bit is wrong
            bits = [start + k for k in range(8) if pattern >> k & 1]
            if bits[-1] >= FRAME_BITS:
                continue
            passes = np.bitwise_xor.reduce(effect[bits]) == 0
            across = bits[0] < 8 <= bits[-1]
            assert across or not passes
            missed += int(passes)
            bursts += int(across)
    assert (missed, bursts) == (5, 769)  # a random 8-bit CRC would let one of 256 pass: 3


@pytest.fixture
def ecu():
    """An ECU on a bus, powered up and running."""
    made = Ecu()
    made.power_up()
    yield made
    made.close()


# With a Hamming distance of 3 none of them may be accepted. The requested torque is large, so that an accepted frame
# would also show in the torque.
def test_the_firmware_accepts_no_command_with_one_or_two_bits_wrong_at_any_counter(ecu: Ecu) -> None:
    message = ecu.dbc.get_message_by_name(COMMAND)
    patterns = [(1 << k) for k in range(FRAME_BITS)]
    patterns += [1 << i | 1 << j for i, j in itertools.combinations(range(FRAME_BITS), 2)]
    values = {"Crc": 0, "Enable": 1, "FaultReset": 0, "Mode": "torque", "TorqueRequested": 120.0,
              "TorqueLimitDrive": 1000.0, "TorqueLimitRegen": 1000.0}  # fmt: skip
    ecu.talking = False
    frames = 0
    ecu.run(100)
    accepted = ecu.last["INV_DiagReceive"]["Accepted"]
    for counter in range(15):
        good = int.from_bytes(protect(DATA_ID, bytearray(message.encode({**values, "Counter": counter}))), "big")
        for pattern in patterns:
            assert ecu.put(message.frame_id, (good ^ pattern).to_bytes(8, "big"))
            frames += 1
            if frames % 30 == 0:
                ecu.step_ms()
    ecu.run(100)
    assert frames == 15 * (64 + 2016)
    assert ecu.last["INV_DiagReceive"]["Accepted"] == accepted
    assert ecu.get("torque_commanded_Nm") == 0.0
    diagnostics = ecu.last["INV_DiagProtection"]
    refused = diagnostics["CrcErrors"] + ecu.last["INV_DiagReceive"]["IdErrors"]
    assert refused == frames


def test_the_status_frame_passes_the_independent_check(ecu: Ecu) -> None:
    ecu.sent.clear()
    ecu.run(500)
    status = [data for _, identifier, data in ecu.sent if identifier == 0x210]
    assert len(status) == 50
    assert all(data[0] == crc_of(0x2101, data) for data in status)
    counters = [data[1] & 15 for data in status]
    assert all((b - a) % 15 == 1 for a, b in itertools.pairwise(counters))
