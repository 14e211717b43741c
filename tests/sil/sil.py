# SPDX-License-Identifier: Apache-2.0
"""libfluxtrue_sil.so by ctypes, with prototypes written from the header alone."""

import ctypes
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("FLUXTRUE_BUILD_DIR", ROOT / "build" / "host"))
OK, UNKNOWN_NAME, OUT_OF_RANGE, READ_ONLY, NO_STATE = 0, -1, -2, -3, -4
NUMBER, SWITCH, COUNT, CHOICE, BITS = range(5)
DOUBLES, INTS = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int)


class Info(ctypes.Structure):
    """fluxtrue_info_t."""

    _fields_ = (
        ("name", ctypes.c_char_p), ("unit", ctypes.c_char_p), ("help", ctypes.c_char_p),
        ("lo", ctypes.c_double), ("hi", ctypes.c_double), ("least", ctypes.c_double), ("initial", ctypes.c_double),
        ("kind", ctypes.c_int), ("writable", ctypes.c_int),
    )  # fmt: skip


class Batch(ctypes.Structure):
    """fluxtrue_batch_t; `samples` is its member `in`, which is a word of Python."""

    _fields_ = (
        ("periods", ctypes.c_int), ("samples", DOUBLES), ("out", DOUBLES),
        ("sets", ctypes.c_int), ("set", INTS), ("set_values", DOUBLES),
        ("gets", ctypes.c_int), ("get", INTS), ("get_values", DOUBLES),
    )  # fmt: skip


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
    library.fluxtrue_motor.restype = text
    library.fluxtrue_period_s.restype = number
    library.fluxtrue_reset.restype = None
    library.fluxtrue_reset.argtypes = [pointer]
    library.fluxtrue_handle.argtypes = [text]
    library.fluxtrue_set_by.argtypes = [pointer, ctypes.c_int, number]
    library.fluxtrue_get_by.restype = number
    library.fluxtrue_get_by.argtypes = [pointer, ctypes.c_int]
    library.fluxtrue_info.argtypes = [ctypes.c_int, ctypes.POINTER(Info), ctypes.c_int]
    library.fluxtrue_run.argtypes = [pointer, ctypes.POINTER(Batch)]
    library.fluxtrue_state_save.argtypes = [pointer, text, ctypes.c_int]
    library.fluxtrue_state_restore.argtypes = [pointer, text, ctypes.c_int]
    library.fluxtrue_memory_read.argtypes = [pointer, text, ctypes.c_int]
    library.fluxtrue_memory_write.argtypes = [pointer, text, ctypes.c_int]
    library.fluxtrue_word.argtypes = [text, ctypes.c_int, text, ctypes.c_int]
    library.fluxtrue_explanation.restype = text
    library.fluxtrue_explanation.argtypes = [text, ctypes.c_int]
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

    def reset(self) -> None:
        """Reset the drive to the state after fluxtrue_create()."""
        self.library.fluxtrue_reset(self.handle)

    def run(
        self,
        samples: NDArray[np.float64],
        sets: Mapping[str, NDArray[np.float64]] | None = None,
        gets: Sequence[str] = (),
    ) -> tuple[int, NDArray[np.float64], NDArray[np.float64]]:
        """A batch: the library's code, the outputs, and the values read."""
        rows, given = len(samples), dict(sets or {})
        samples = np.ascontiguousarray(samples, dtype=np.float64)
        out, values = np.full((rows, 4), 9.0), np.full((rows, len(gets)), 9.0)
        handles = [np.array([self.library.fluxtrue_handle(n.encode()) for n in x], np.int32) for x in (given, gets)]
        columns = np.column_stack(list(given.values())).astype(np.float64) if given else np.zeros((rows, 0))
        columns = np.ascontiguousarray(columns)
        batch = Batch(rows, *(pointer(x) for x in (samples, out)), len(given), pointer(handles[0]), pointer(columns),
                      len(gets), pointer(handles[1]), pointer(values))  # fmt: skip
        return int(self.library.fluxtrue_run(self.handle, ctypes.byref(batch))), out, values

    def save(self) -> bytes:
        """The state."""
        state = ctypes.create_string_buffer(self.library.fluxtrue_state_size())
        assert self.library.fluxtrue_state_save(self.handle, state, len(state)) == OK
        return state.raw

    def restore(self, state: bytes) -> int:
        """The library's code."""
        return int(self.library.fluxtrue_state_restore(self.handle, state, len(state)))

    def memory(self) -> bytes:
        """The flash."""
        flash = ctypes.create_string_buffer(4096)
        assert self.library.fluxtrue_memory_read(self.handle, flash, len(flash)) == OK
        return flash.raw


def pointer(values: NDArray[Any]) -> Any:
    """A pointer to the first element."""
    return values.ctypes.data_as(INTS if values.dtype == np.int32 else DOUBLES)


def info(library: ctypes.CDLL, handle: int) -> Info:
    """The description of a name."""
    found = Info()
    assert library.fluxtrue_info(handle, ctypes.byref(found), ctypes.sizeof(found)) == OK
    return found


def names(library: ctypes.CDLL) -> list[str]:
    """All names, as fluxtrue_name() enumerates them."""
    found: list[str] = []
    while (name := library.fluxtrue_name(len(found))) is not None:
        found.append(name.decode())
        assert len(found) < 1000
    return found
