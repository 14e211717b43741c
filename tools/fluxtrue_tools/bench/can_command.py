# SPDX-License-Identifier: Apache-2.0
"""The vehicle's part on the bus: the torque command, in the scale of the motor's DBC and protected as it says."""

from __future__ import annotations

import ctypes

from fluxtrue_tools.bus.interface import COMMAND, Interface, read_interface
from fluxtrue_tools.bus.protect import Protector


class Frame(ctypes.Structure):
    """The C type can_port_frame_t."""

    _fields_ = (("id", ctypes.c_uint32), ("extended", ctypes.c_bool), ("length", ctypes.c_uint8),
                ("data", ctypes.c_uint8 * 8))  # fmt: skip


class Command:
    """The cyclic torque command and its counter."""

    def __init__(self, interface: Interface | None = None) -> None:
        """Without an interface: in the standard scale."""
        interface = interface or read_interface()
        self._message = interface.message(COMMAND)
        self._protector = Protector(interface.data_id(COMMAND))
        self.values: dict[str, float | str] = {
            "Enable": 0, "FaultReset": 0, "Mode": "off", "TorqueRequested": 0.0,
            **{name: interface.largest(COMMAND, name) for name in ("TorqueLimitDrive", "TorqueLimitRegen")},
        }  # fmt: skip

    def frame(self) -> Frame:
        """The next frame."""
        raw = self._protector.protect(self._message.encode({"Crc": 0, "Counter": 0, **self.values}))
        return Frame(self._message.frame_id, False, len(raw), (ctypes.c_uint8 * 8)(*raw))
