# SPDX-License-Identifier: Apache-2.0
"""AUTOSAR E2E profile 11, variant 11A, written from the specification alone.

The CRC is calculated as the remainder of a polynomial division with Python's integers, so that it has nothing in common
with the firmware's code.
"""

GENERATOR = 0b1_0001_1101  # x^8 + x^4 + x^3 + x^2 + 1


def crc8(data: bytes) -> int:
    """Remainder of data x^8 modulo the generator: start value 0, no inversion."""
    rest = int.from_bytes(data, "big") << 8
    while rest.bit_length() > 8:
        rest ^= GENERATOR << (rest.bit_length() - 9)
    return rest


def crc_of(data_id: int, frame: bytes) -> int:
    """CRC over the data id, low byte first, and the bytes after the CRC."""
    return crc8(data_id.to_bytes(2, "little") + bytes(frame[1:]))


def protect(data_id: int, frame: bytearray) -> bytes:
    """The frame with its CRC; the counter is in place."""
    frame[0] = crc_of(data_id, frame)
    return bytes(frame)
