# SPDX-License-Identifier: Apache-2.0
"""The vehicle's part on the bus: the torque command, protected as firmware/comm/fluxtrue.dbc says."""

from __future__ import annotations

import ctypes
from pathlib import Path

import cantools
from cantools.database.can import Database

from fluxtrue_tools.errors import FluxtrueError

DBC = Path(__file__).resolve().parents[3] / "firmware" / "comm" / "fluxtrue.dbc"
COMMAND = "VCU_TorqueCommand"
COUNTER_END = 15
CRC_GENERATOR = 0x11D  # x^8 + x^4 + x^3 + x^2 + 1: AUTOSAR E2E profile 11, variant 11A


class Frame(ctypes.Structure):
    """can_port_frame_t."""

    _fields_ = (("id", ctypes.c_uint32), ("extended", ctypes.c_bool), ("length", ctypes.c_uint8),
                ("data", ctypes.c_uint8 * 8))  # fmt: skip


def crc8(data: bytes) -> int:
    """Remainder of data x^8."""
    rest = int.from_bytes(data, "big") << 8
    while rest.bit_length() > 8:
        rest ^= CRC_GENERATOR << (rest.bit_length() - 9)
    return rest


class Command:
    """The cyclic torque command and its counter."""

    def __init__(self) -> None:
        database = cantools.database.load_file(DBC)
        if not isinstance(database, Database):
            raise FluxtrueError(f"{DBC}: no CAN database")
        self._message = database.get_message_by_name(COMMAND)
        self._data_id = int(self._message.dbc.attributes["E2EDataId"].value)  # type: ignore[union-attr]
        self._counter = 0
        self.values: dict[str, float | str] = {
            "Enable": 0, "FaultReset": 0, "Mode": "off", "TorqueRequest": 0.0,
            "TorqueLimitDrive": 1000.0, "TorqueLimitRegen": 1000.0,
        }  # fmt: skip

    def frame(self) -> Frame:
        """The next one."""
        raw = bytearray(self._message.encode({"Crc": 0, "Counter": self._counter, **self.values}))
        raw[0] = crc8(self._data_id.to_bytes(2, "little") + bytes(raw[1:]))
        self._counter = (self._counter + 1) % COUNTER_END
        return Frame(self._message.frame_id, False, len(raw), (ctypes.c_uint8 * 8)(*raw))
