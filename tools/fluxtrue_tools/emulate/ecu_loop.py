# SPDX-License-Identifier: Apache-2.0
"""The flashed image on its bus in closed loop with the plant: as sim/ecu_loop.py, on the emulated processor."""

import ctypes
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.bench.can_command import Frame
from fluxtrue_tools.emulate import library
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.ecu_loop import EcuLoop
from fluxtrue_tools.sim.members import as_value, members
from fluxtrue_tools.sim.motor import Motor

STATE: Final = "ecu"
# Symbol and type of an object of the image, by the first part of a member's name. Any other name is that of a member of
# ecu_t; "ecu." may precede it, as on the host.
OBJECTS: Final = {STATE: (STATE, "ecu_t"), "motor": ("motor", "motor_t")}
BOARD: Final = "board"
"""Only the port for the host keeps the board's state in memory."""
OTHER_NAMES: Final = {"inverter_C": "emulator.inverter_C"}


def is_possible(name: str) -> bool:
    """Whether the image has what a name of the fault campaign changes."""
    return not name.startswith(f"memory.{BOARD}.")


class EmulatedEcuLoop(EcuLoop):
    """An image with an absolute angle sensor; contactor, precharge, discharge and gate supply follow its outputs.

    Its motor data, named `motor.`, lie in the flash; a write changes the flash as a loss of its content does.
    """

    def __init__(self, image: Path, layout: Path, motor: Motor, plant: Mapping[str, float]) -> None:
        self._image = image
        super().__init__(library.emulated(motor, image, layout), plant)
        self.set("emulator.board", 1.0)

    def _create(self, controller: str) -> int | None:
        created: int = self._library.sim_create(controller)
        self._core = Core.of_simulation(self._library, created)
        self._library.can_frame_arrives.argtypes = [ctypes.c_void_p, ctypes.POINTER(Frame)]
        return created

    def set(self, name: str, value: float) -> None:
        """As on the host; a name of the board is replaced by the emulator's."""
        super().set(OTHER_NAMES.get(name, name), value)

    def get(self, name: str) -> float:
        """As set()."""
        return super().get(OTHER_NAMES.get(name, name))

    def run(self, periods: int, ramps: Mapping[str, tuple[float, float]] | None = None) -> NDArray[np.float64]:
        """As of the host, with these names."""
        return super().run(periods, {OTHER_NAMES.get(name, name): ends for name, ends in (ramps or {}).items()})

    def _place(self, member: str) -> tuple[int, Any]:
        """Address and type."""
        first, _, rest = member.partition(".")
        symbol, kind = OBJECTS.get(first, OBJECTS[STATE])
        offset, number = members(str(self._image), kind).place(rest if first in OBJECTS else member)
        return self._core.symbol(symbol) + offset, number

    def read(self, member: str) -> float:
        """A member of the image's state or of its motor data."""
        address, kind = self._place(member)
        return float(kind.from_buffer_copy(self._core.read(address, ctypes.sizeof(kind))).value)

    def write(self, member: str, value: float) -> None:
        """Changes it, as a fault of the memory would."""
        address, kind = self._place(member)
        self._core.write(address, bytes(kind(as_value(kind, value))))

    def _put(self, frame: Frame) -> None:
        self._library.can_frame_arrives(self._core._handle, ctypes.byref(frame))

    def _take_all(self) -> None:
        """The emulated bus acknowledges every frame, and keeps none."""
