# SPDX-License-Identifier: Apache-2.0
"""libfluxtrue_sim.so by ctypes: one `Loop` is one plant with one controller."""

import ctypes
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.strict import LARGEST

CONTROLLERS: Final = {"firmware": 0, "twin": 1}
UNKNOWN_NAME: Final = -1
OUT_OF_RANGE: Final = -2
READ_ONLY: Final = -3
FAILED: Final = -6
MEMORY_SIZE: Final = 4096
REASONS: Final = {
    UNKNOWN_NAME: "no such name",
    OUT_OF_RANGE: "out of range",
    READ_ONLY: "read only",
    -4: "the plant has not been started",
    -5: "too many",
}

_DOUBLES = ctypes.POINTER(ctypes.c_double)
_SIGNATURES = {
    "sim_create": (ctypes.c_void_p, [ctypes.c_int]),
    "sim_create_for": (ctypes.c_void_p, [ctypes.c_void_p, ctypes.c_uint]),
    "sim_destroy": (None, [ctypes.c_void_p]),
    "sim_map": (
        ctypes.c_int,
        [ctypes.c_void_p, _DOUBLES, ctypes.c_int, _DOUBLES, ctypes.c_int, _DOUBLES, _DOUBLES],
    ),
    "sim_start": (ctypes.c_char_p, [ctypes.c_void_p]),
    "sim_set": (ctypes.c_int, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double]),
    "sim_get": (ctypes.c_double, [ctypes.c_void_p, ctypes.c_char_p]),
    "sim_name": (ctypes.c_char_p, [ctypes.c_int]),
    "sim_record": (
        ctypes.c_int,
        [ctypes.c_void_p, ctypes.POINTER(ctypes.c_char_p), ctypes.c_int, ctypes.c_int],
    ),
    "sim_ramp": (
        ctypes.c_int,
        [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double, ctypes.c_double],
    ),
    "sim_failure": (ctypes.c_char_p, [ctypes.c_void_p]),
    "sim_run": (ctypes.c_int, [ctypes.c_void_p, ctypes.c_int, _DOUBLES, ctypes.c_int]),
    "sim_firmware": (ctypes.c_void_p, [ctypes.c_void_p]),
    "fluxtrue_memory_read": (ctypes.c_int, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]),
    "fluxtrue_memory_write": (ctypes.c_int, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]),
    "fluxtrue_name": (ctypes.c_char_p, [ctypes.c_int]),
    "fluxtrue_create": (ctypes.c_void_p, []),
    "fluxtrue_destroy": (None, [ctypes.c_void_p]),
    "sim_create_around": (ctypes.c_void_p, [ctypes.c_void_p]),
    "can_host_attach": (None, [ctypes.c_void_p]),
    "can_host_put": (ctypes.c_bool, [ctypes.c_void_p, ctypes.c_void_p]),
    "can_host_take": (ctypes.c_bool, [ctypes.c_void_p, ctypes.c_void_p]),
}


def load(path: Path) -> ctypes.CDLL:
    """The library with its prototypes."""
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:
        raise FluxtrueError(f"{path}: not a simulation library ({error})") from error
    return library


def _names(function: "ctypes._NamedFuncPointer") -> list[str]:
    names: list[str] = []
    while (name := function(len(names))) is not None:
        names.append(name.decode())
    return names


def plant_names(library: ctypes.CDLL) -> list[str]:
    """Every "plant." and "truth." name."""
    return _names(library.sim_name)


def controller_names(library: ctypes.CDLL) -> list[str]:
    """Every name of the controller."""
    return _names(library.fluxtrue_name)


def _pointer(values: NDArray[np.float64]) -> "ctypes._Pointer[ctypes.c_double]":
    return values.ctypes.data_as(_DOUBLES)


class LoopError(FluxtrueError):
    """A name or a value the simulation refuses."""

    def __init__(self, name: str, value: float | None, code: int) -> None:
        shown = "" if value is None else f" = {value:g}"
        super().__init__(f"{name}{shown}: {REASONS.get(code, f'error {code}')}")
        self.name, self.value, self.code = name, value, code

    def __reduce__(self) -> tuple[type["LoopError"], tuple[str, float | None, int]]:
        """A worker hands the error to its parent as these arguments; by default only the text would go."""
        return type(self), (self.name, self.value, self.code)


class Loop:
    """One simulated drive. Calls into the library release the GIL: one thread per Loop works."""

    def __init__(
        self,
        library: ctypes.CDLL,
        plant: Mapping[str, float],
        flux_map: "FluxMap | None" = None,
        controller: str = "firmware",
    ) -> None:
        self._library = library
        self._plant, self._flux_map, self._controller = dict(plant), flux_map, controller
        self._sim = self._create(controller)
        if not self._sim:
            raise MemoryError("sim_create")
        self._width = 0
        self._every = 1
        if flux_map is not None:
            flux_map.hand_over(library, self._sim)
        for name, value in plant.items():
            self.set(f"plant.{name}", value)
        bad = library.sim_start(self._sim)
        if bad is not None:
            field = bad.decode()
            raise LoopError(f"plant.{field}", plant.get(field), OUT_OF_RANGE)
        self.period_s = 1.0 / self.get("plant.pwm_hz")

    def _create(self, controller: str) -> int | None:
        """The simulation without its plant."""
        created: int | None = self._library.sim_create(CONTROLLERS[controller])
        return created

    def again(self, changes: Mapping[str, float]) -> "Loop":
        """Another simulation of the same drive from its start, with changes of the plant."""
        return Loop(self._library, self._plant | dict(changes), self._flux_map, self._controller)

    def close(self) -> None:
        """Release the memory; afterwards the object cannot be used."""
        if self._sim:
            self._library.sim_destroy(self._sim)
            self._sim = None

    def __enter__(self) -> "Loop":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_sim", None):
            self.close()

    def set(self, name: str, value: float) -> None:
        """A plant parameter ("plant.…") or one of the controller's names."""
        is_too_large = abs(value) > LARGEST and name != "plant.seed"  # the square of a quantity may overflow
        if is_too_large and not math.isnan(self.get(name)):  # an unknown name is told by the simulation
            raise LoopError(name, value, OUT_OF_RANGE)
        code = self._library.sim_set(self._sim, name.encode(), value)
        if code != 0:
            self._raise_if_failed(f"{name} = {value:g}: ")
            raise LoopError(name, value, code)

    def _raise_if_failed(self, before: str) -> None:
        """Tell why the simulation or the emulation cannot be continued, if it cannot."""
        failure: bytes | None = self._library.sim_failure(self._sim)
        if failure is not None:
            raise FluxtrueError(before + failure.decode(errors="replace"))

    def get(self, name: str) -> float:
        """The value now; NaN for an unknown name."""
        return float(self._library.sim_get(self._sim, name.encode()))

    def _firmware(self) -> int:
        firmware = self._library.sim_firmware(self._sim)
        if not firmware:
            raise FluxtrueError("memory: this controller has none, only the firmware on this computer")
        return int(firmware)

    def memory(self) -> bytes:
        """The firmware's flash as it would survive a power cycle now."""
        data = ctypes.create_string_buffer(MEMORY_SIZE)
        code = self._library.fluxtrue_memory_read(self._firmware(), data, MEMORY_SIZE)
        if code != 0:
            raise LoopError("memory", None, code)
        return data.raw

    def remember(self, memory: bytes) -> None:
        """Start with the flash of another power cycle; before the first period only."""
        code = self._library.fluxtrue_memory_write(self._firmware(), memory, len(memory))
        if code != 0:
            raise LoopError("memory", None, code)

    def record(self, names: Sequence[str], every: int = 1) -> None:
        """Choose the columns that run() returns, with one row for each `every` periods."""
        array = (ctypes.c_char_p * len(names))(*[name.encode() for name in names])
        code = self._library.sim_record(self._sim, array, len(names), every)
        if code != 0:
            unknown = [n for n in names if np.isnan(self.get(n))]
            raise LoopError(unknown[0] if unknown else "record", None, code)
        self._width, self._every = len(names), every

    def run(self, periods: int, ramps: Mapping[str, tuple[float, float]] | None = None) -> NDArray[np.float64]:
        """Run PWM periods; each ramp goes linearly from its first value to its second."""
        for name, (start, stop) in (ramps or {}).items():
            code = self._library.sim_ramp(self._sim, name.encode(), start, stop)
            if code != 0:
                raise LoopError(name, stop, code)
        capacity = periods // self._every + 1
        rows = np.empty((capacity, self._width))
        written = self._library.sim_run(self._sim, periods, _pointer(rows), capacity)
        if written == FAILED:
            self._raise_if_failed("")
        if written < 0:
            raise LoopError("run", None, written)
        return rows[:written]

    def run_s(self, seconds: float) -> NDArray[np.float64]:
        """Run for a time, rounded to whole periods."""
        return self.run(round(seconds / self.period_s))


class FluxMap:
    """A machine's flux map over the full plane, ψ as [i_d][i_q]."""

    def __init__(
        self,
        id_A: Sequence[float],
        iq_A: Sequence[float],
        psi_d_Vs: Sequence[Sequence[float]],
        psi_q_Vs: Sequence[Sequence[float]],
    ) -> None:
        def tidy(values: object) -> NDArray[np.float64]:
            return np.ascontiguousarray(values, dtype=np.float64)

        self.id_A, self.iq_A = tidy(id_A), tidy(iq_A)
        self.psi_d_Vs, self.psi_q_Vs = tidy(psi_d_Vs), tidy(psi_q_Vs)

    def hand_over(self, library: ctypes.CDLL, sim: int) -> None:
        """Copy the map into the plant."""
        code = library.sim_map(
            sim,
            _pointer(self.id_A),
            self.id_A.size,
            _pointer(self.iq_A),
            self.iq_A.size,
            _pointer(self.psi_d_Vs),
            _pointer(self.psi_q_Vs),
        )
        if code != 0:
            raise LoopError("the plant's flux map", None, code)
