# SPDX-License-Identifier: Apache-2.0
"""The frames that an emulated image sends."""

from __future__ import annotations

import ctypes

import cantools.database

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.emulate.core import Core


class _Frame(ctypes.Structure):
    """can_port_frame_t of tests/target/emulator/can_port.h."""

    _fields_ = (("id", ctypes.c_uint32), ("extended", ctypes.c_bool), ("length", ctypes.c_uint8),
                ("data", ctypes.c_uint8 * 8))  # fmt: skip


_SENT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.POINTER(_Frame), ctypes.c_uint64)


class _Port(ctypes.Structure):
    """can_port_t of tests/target/emulator/can_port.h."""

    _fields_ = (("sent", _SENT), ("user", ctypes.c_void_p))


class Listener:
    """`last`: the last frame of each message that the image has sent, decoded with the standard scale."""

    def __init__(self, core: Core) -> None:
        """Listen from now on; the listener must live as long as the emulation runs."""
        self.last: dict[str, dict[str, object]] = {}
        self._database = cantools.database.load_file(DBC)
        self._port = _Port(_SENT(self._sent), None)
        core._library.emu_can_port(ctypes.c_void_p(core._handle), ctypes.byref(self._port))

    def _sent(self, _: int, frame: ctypes._Pointer[_Frame], _now: int) -> None:
        try:
            message = self._database.get_message_by_frame_id(frame[0].id)
        except KeyError:
            return  # the calibration protocol's, which no message describes
        self.last[message.name] = message.decode(bytes(frame[0].data))
