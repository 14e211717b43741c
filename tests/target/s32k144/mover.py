# SPDX-License-Identifier: Apache-2.0
"""The frames of an agreed movement of the shaft, beside the vehicle's command of an emulated image."""

from __future__ import annotations

import ctypes

from fluxtrue_tools.bench.can_command import Frame
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.bus.interface import COMMISSION, read_interface
from fluxtrue_tools.bus.protect import Protector

PERIOD_MS = 10


class Mover:
    """`values`: the content of VCU_Commission, in the names and words of the DBC."""

    def __init__(self, stand: Stand) -> None:
        interface = read_interface()
        self._stand = stand
        self._message = interface.message(COMMISSION)
        self._protector = Protector(interface.data_id(COMMISSION))
        self.values: dict[str, float | str] = {
            "Movement": "none", "Reversed": 0, "Damped": 0, "CurrentD": 0.0, "CurrentQ": 0.0, "PolePairs": 1,
            "Direction": "stand", "Pulses": 0, "Offset": 0.0,
        }  # fmt: skip

    def run(self, milliseconds: int, **command: float | str) -> None:
        """Let time pass with both messages; `command`: what changes in the vehicle's."""
        for _ in range(milliseconds // PERIOD_MS):
            raw = self._protector.protect(self._message.encode({"Crc": 0, "Counter": 0, **self.values}))
            frame = Frame(self._message.frame_id, False, len(raw), (ctypes.c_uint8 * 8)(*raw))
            self._stand.library.can_frame_arrives(self._stand.handle, ctypes.byref(frame))
            self._stand.run(PERIOD_MS, **command)

    def agree(self, movement: str) -> None:
        """Disable, and consent to this movement with currents of zero."""
        self.values |= {"Movement": "none", "CurrentD": 0.0, "CurrentQ": 0.0, "Direction": "stand"}
        self.run(50, Enable=0)
        self.values["Movement"] = movement
        self.run(20)
