# SPDX-License-Identifier: Apache-2.0
"""A motor in simulation before anything has been built for it: the firmware of a shipped motor with other motor data.

The firmware is the same for every machine: only the struct `motor` differs. It is compiled here on its own, in a
fraction of a second, and handed to the simulation library of a shipped motor.
"""

import ctypes
import json
import os
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.emit_c import motor_tables_c
from fluxtrue_tools.motor.emit_json import motor_json
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.sim.build import ROOT, prepare
from fluxtrue_tools.sim.library import FluxMap, Loop, load
from fluxtrue_tools.sim.motor import flux_map_of, plant_parameters

LIBRARY_OF = "hsm1"
SIZE = "\nextern const unsigned motor_size;\nconst unsigned motor_size = sizeof motor;\n"


@dataclass(frozen=True)
class Simulated:
    """A motor's data as the firmware takes them, and the machine that fits them."""

    library: ctypes.CDLL
    data: ctypes.CDLL
    plant: dict[str, float]
    flux_map: FluxMap | None

    def loop(self, plant: Mapping[str, float]) -> "DataLoop":
        """The drive of the data sheet with changes."""
        return DataLoop(self, plant)


class DataLoop(Loop):
    """A simulated drive whose firmware has the motor's data."""

    def __init__(self, motor: Simulated, plant: Mapping[str, float]) -> None:
        self._motor, self._data = motor, motor.data
        self.periods = 0  # since the start
        super().__init__(motor.library, motor.plant | dict(plant), motor.flux_map)

    def _create(self, controller: str) -> int | None:
        address = ctypes.addressof(ctypes.c_char.in_dll(self._data, "motor"))
        size = ctypes.c_uint.in_dll(self._data, "motor_size").value
        created: int | None = self._library.sim_create_for(address, size)
        if not created:
            raise FluxtrueError(f"the simulation library of {LIBRARY_OF} was built from another source")
        return created

    def again(self, changes: Mapping[str, float]) -> "DataLoop":
        """With the same data."""
        return DataLoop(self._motor, self._plant | dict(changes))

    def run(self, periods: int, ramps: Mapping[str, tuple[float, float]] | None = None) -> Array:
        """Counts them: the 1 kHz task runs at the end of every periods_per_step-th."""
        self.periods += periods
        return super().run(periods, ramps)


def _compile(tables: str, folder: Path) -> ctypes.CDLL:
    source, library = folder / "motor.c", folder / "motor.so"
    source.write_text(tables + SIZE, encoding="utf-8")
    compiler = os.environ.get("CC", "cc")
    command = [compiler, "-std=c11", "-shared", "-fPIC", f"-I{ROOT / 'firmware'}", str(source), "-o", str(library)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"{compiler}: {done.stderr.strip()}")
    return ctypes.CDLL(str(library))


def simulated(motor: Motor, folder: Path) -> Simulated:
    """Compile the motor's data in a scratch folder, and load the simulation; it is built if need be."""
    data: dict[str, Any] = json.loads(motor_json(motor))
    return Simulated(
        load(prepare(LIBRARY_OF).library),
        _compile(motor_tables_c(motor), folder),
        plant_parameters(data["machine"], data["inverter"]),
        flux_map_of(data),
    )
