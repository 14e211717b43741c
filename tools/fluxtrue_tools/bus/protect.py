# SPDX-License-Identifier: Apache-2.0
"""End-to-end protection of what the tools send: AUTOSAR profile 11, variant 11A.

Source   AUTOSAR_PRS_E2EProtocol; docs/howto/can.md
"""

from crccheck.crc import Crc8Base

COUNTERS = 15  # 0 ... 14
COUNTER_MASK = 0x0F


class _Crc(Crc8Base):  # type: ignore[misc]
    """SAE J1850's polynomial; the profile undoes the standard's start value and final inversion."""

    _poly = 0x1D
    _initvalue = 0x00
    _xor_output = 0x00


class Protector:
    """Counter and CRC for one message; its first two bytes are the protection's."""

    def __init__(self, data_id: int) -> None:
        self._prefix = data_id.to_bytes(2, "little")
        self._counter = 0

    def protect(self, data: bytes) -> bytes:
        """The next frame."""
        frame = bytearray(data)
        frame[1] = (frame[1] & ~COUNTER_MASK & 0xFF) | self._counter
        frame[0] = _Crc.calc(self._prefix + bytes(frame[1:]))
        self._counter = (self._counter + 1) % COUNTERS
        return bytes(frame)
