# SPDX-License-Identifier: Apache-2.0
"""libfluxtrue_sil.so by ctypes, with prototypes written from the header alone."""

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("FLUXTRUE_BUILD_DIR", ROOT / "build" / "host"))
OK, UNKNOWN_NAME, OUT_OF_RANGE, READ_ONLY = 0, -1, -2, -3


def library_path(motor: str) -> Path:
    """The library of a shipped motor."""
    return BUILD / "motors" / motor / "libfluxtrue_sil.so"


def load(motor: str) -> ctypes.CDLL:
    """Load the library of a shipped motor."""
    return load_library(library_path(motor))


def load_library(path: Path) -> ctypes.CDLL:
    """Load a library and declare the prototypes of the header."""
    library = ctypes.CDLL(str(path))
    pointer, text, number = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double
    library.fluxtrue_create.restype = pointer
    library.fluxtrue_create.argtypes = []
    library.fluxtrue_destroy.restype = None
    library.fluxtrue_destroy.argtypes = [pointer]
    library.fluxtrue_set.argtypes = [pointer, text, number]
    library.fluxtrue_get.restype = number
    library.fluxtrue_get.argtypes = [pointer, text]
    library.fluxtrue_name.restype = text
    library.fluxtrue_name.argtypes = [ctypes.c_int]
    library.fluxtrue_step.restype = None
    library.fluxtrue_step.argtypes = [pointer, number * 6, number * 4]
    return library


class Drive:
    """One instance of the drive."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library = library
        self.handle = library.fluxtrue_create()
        assert self.handle

    def close(self) -> None:
        """Destroy the instance."""
        self.library.fluxtrue_destroy(self.handle)
        self.handle = None

    def set(self, name: str, value: float) -> int:
        """Set a value; the return code of the library."""
        return int(self.library.fluxtrue_set(self.handle, name.encode(), value))

    def get(self, name: str) -> float:
        """Read a value; NaN for an unknown name."""
        return float(self.library.fluxtrue_get(self.handle, name.encode()))

    def step(self, sample: Sequence[float]) -> tuple[float, float, float, float]:
        """One PWM period."""
        out = (ctypes.c_double * 4)(9.0, 9.0, 9.0, 9.0)
        self.library.fluxtrue_step(self.handle, (ctypes.c_double * 6)(*sample), out)
        return tuple(out)


def names(library: ctypes.CDLL) -> list[str]:
    """As fluxtrue_name() enumerates them."""
    found: list[str] = []
    while (name := library.fluxtrue_name(len(found))) is not None:
        found.append(name.decode())
        assert len(found) < 1000
    return found
