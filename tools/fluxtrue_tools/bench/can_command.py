# SPDX-License-Identifier: Apache-2.0
"""The vehicle's part on the bus: the torque command, protected as firmware/comm/fluxtrue.dbc says."""

from __future__ import annotations

import ctypes

import cantools
from cantools.database.can import Database

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.errors import FluxtrueError

COMMAND = "VCU_TorqueRequest"


class Frame(ctypes.Structure):
    """The C type can_port_frame_t."""

    _fields_ = (("id", ctypes.c_uint32), ("extended", ctypes.c_bool), ("length", ctypes.c_uint8),
                ("data", ctypes.c_uint8 * 8))  # fmt: skip


class Command:
    """The cyclic torque command and its counter."""

    def __init__(self) -> None:
        database = cantools.database.load_file(DBC)
        if not isinstance(database, Database):
            raise FluxtrueError(f"{DBC}: no CAN database")
        self._message = database.get_message_by_name(COMMAND)
        data_id = int(self._message.dbc.attributes["E2EDataId"].value)  # type: ignore[union-attr]
        self._protector = Protector(data_id)
        self.values: dict[str, float | str] = {
            "Enable": 0, "FaultReset": 0, "Mode": "off", "TorqueRequested": 0.0,
            "TorqueLimitDrive": 1000.0, "TorqueLimitRegen": 1000.0,
        }  # fmt: skip

    def frame(self) -> Frame:
        """The next frame."""
        raw = self._protector.protect(self._message.encode({"Crc": 0, "Counter": 0, **self.values}))
        return Frame(self._message.frame_id, False, len(raw), (ctypes.c_uint8 * 8)(*raw))
