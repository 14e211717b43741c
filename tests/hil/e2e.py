# SPDX-License-Identifier: Apache-2.0
"""AUTOSAR end-to-end profile 11A, written from the specification, without a table: independent of the firmware.

The CRC is the remainder of (data id low, data id high, bytes 1 ... n) x^8 divided by the SAE J1850 polynomial. The
profile cancels the start value and the final inversion of that standard: both are 0 here.
"""

from dataclasses import dataclass
from functools import cache

POLYNOMIAL = 0x11D  # x^8 + x^4 + x^3 + x^2 + 1
COUNTERS = 15  # 0 ... 14
COUNTER_MASK = 0x0F


def remainder(bits: int, polynomial: int = POLYNOMIAL) -> int:
    """Remainder of polynomial division over GF(2)."""
    degree = polynomial.bit_length() - 1
    while bits.bit_length() > degree:
        bits ^= polynomial << (bits.bit_length() - 1 - degree)
    return bits


@cache
def _share(byte: int, behind: int) -> int:
    """Contribution of a byte with `behind` bytes after it to the remainder; the division is linear."""
    return remainder(byte << 8 * (behind + 1))


def crc(data_id: int, data: bytes) -> int:
    """The value that byte 0 of the frame must have; byte 0 of `data` is ignored."""
    message = bytes([data_id & 0xFF, data_id >> 8]) + data[1:]
    found = 0
    for behind, byte in enumerate(reversed(message)):
        found ^= _share(byte, behind)
    return found


def protect(data_id: int, data: bytes, counter: int) -> bytes:
    """The frame with counter and CRC in place."""
    frame = bytearray(data)
    frame[1] = frame[1] & ~COUNTER_MASK & 0xFF | counter
    frame[0] = crc(data_id, bytes(frame))
    return bytes(frame)


def counter_of(data: bytes) -> int:
    """The counter a frame carries."""
    return data[1] & COUNTER_MASK


def is_intact(data_id: int, data: bytes) -> bool:
    """Whether the CRC is right."""
    return len(data) > 1 and crc(data_id, data) == data[0]


@dataclass
class Sender:
    """The sender of one message, with its counter."""

    data_id: int
    counter: int = 0

    def protect(self, data: bytes) -> bytes:
        """The next frame."""
        frame = protect(self.data_id, data, self.counter)
        self.counter = (self.counter + 1) % COUNTERS
        return frame


@dataclass
class Receiver:
    """Counts the errors in the frames of one message; a repetition or a gap is an error, too."""

    data_id: int
    counter: int | None = None
    wrong: int = 0

    def take(self, data: bytes) -> None:
        """Check one received frame."""
        if not is_intact(self.data_id, data):
            self.wrong += 1
            return
        now = counter_of(data)
        if self.counter is not None and now != (self.counter + 1) % COUNTERS:
            self.wrong += 1
        self.counter = now
