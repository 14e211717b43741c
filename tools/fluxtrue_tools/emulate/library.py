# SPDX-License-Identifier: Apache-2.0
"""libfluxtrue_emu.so by ctypes: the closed-loop runner with an emulated S32K144 as its controller."""

import ctypes
from dataclasses import replace
from pathlib import Path
from typing import Final

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.motor import Motor

FAST: Final = 0
COUNTING: Final = 1
ERROR_SIZE: Final = 512
NAME: Final = "libfluxtrue_emu.so"

_SIGNATURES = {
    "sim_create_emulated": (
        ctypes.c_void_p,
        [ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_size_t],
    ),
    "sim_emulator": (ctypes.c_void_p, [ctypes.c_void_p]),
    "sim_shadow_difference": (ctypes.c_char_p, [ctypes.c_void_p]),
    "sim_shadow_disturb": (None, [ctypes.c_void_p]),
    "emu_error": (ctypes.c_char_p, [ctypes.c_void_p]),
    "emu_register": (ctypes.c_uint64, [ctypes.c_void_p, ctypes.c_char_p]),
}


def load(path: Path, image: Path, layout: Path, mode: int = FAST) -> ctypes.CDLL:
    """The runner's library; every simulation it creates runs the image, whatever controller is asked for."""
    library = lib.load(path)
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments

    def create(_controller: int) -> int:
        error = ctypes.create_string_buffer(ERROR_SIZE)
        sim = library.sim_create_emulated(bytes(image), bytes(layout), mode, error, ERROR_SIZE)
        if not sim:
            raise FluxtrueError(error.value.decode(errors="replace"))
        return int(sim)

    library.sim_create = create  # type: ignore[assignment]
    return library


def emulated(motor: Motor, image: Path, layout: Path, mode: int = FAST) -> Motor:
    """The same motor, its firmware on the emulated processor."""
    path = motor.folder.folder / NAME
    return replace(motor, library=load(path, image, layout, mode))
