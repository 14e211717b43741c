# SPDX-License-Identifier: Apache-2.0
"""The flashed image in closed loop on the emulated processor: what each run of each interrupt executes.

The virtual vehicle powers the inverter up over CAN, asks for torque of both signs at 3000 rpm, for more than the
machine's tables and its current limit give, drives into field weakening, and lets the dc voltage drop. The plant is
that of the simulation: measured map, dead time, noise, quantised sensors.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.bench import cycles, memory
from fluxtrue_tools.bench.can_command import Command, Frame
from fluxtrue_tools.bench.disassembly import Function
from fluxtrue_tools.emulate import library as emulation
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop

FAST, MRAI, CAN, TASK, GATE = 16 + 39, 16 + 69, 16 + 81, 16 + 48, 16 + 103
CODE: Final = ((0, 0x80000), (0x1FFF_8000, 0xF000))  # flash and RAM
CODE_SIZE: Final = sum(size for _, size in CODE)
STACK_PATTERN: Final = b"\xc5" * 4
SPANS_MAX: Final = 4096
V_DC: Final = 350.0
RPM: Final = 2 * math.pi / 60
PERIODS_PER_MS: Final = 10
WARM_UP_MS: Final = 20
# What a drive reacts to, while it makes torque: over-voltage, one phase current beyond the trip, and an interrupt.
FAULTS: Final = {"plant.vdc_V": 520.0, "plant.current_gain_a": 20.0}
GATE_DRIVER: Final = "the gate driver"
FAULT_TORQUE, FAULT_RPM = 80.0, 8000.0
FAULT_RAMP_MS: Final = 100
REACTION_MS: Final = 5
# Milliseconds, requested torque, speed in rpm at the end, dc voltage.
Course = tuple[tuple[int, float, float, float], ...]
DRIVE: Final[Course] = (
    (50, 80.0, 3000.0, V_DC), (50, -60.0, 3000.0, V_DC), (30, 5.0, 3000.0, V_DC),
    (60, 400.0, 3000.0, V_DC), (80, -400.0, 3000.0, V_DC), (40, 0.0, 3000.0, V_DC),
    (80, 60.0, 8000.0, V_DC), (20, 60.0, 8000.0, 300.0), (40, -40.0, 8000.0, 300.0), (10, 0.0, 8000.0, 200.0),
    (15, 0.0, 8000.0, 150.0),
)  # fmt: skip


class Watch(Protocol):
    """Records what the core executes while it is profiled."""

    def begin(self, stand: Stand) -> None: ...

    def end(self, stand: Stand) -> None: ...


class _Span(ctypes.Structure):
    _fields_ = (("vector", ctypes.c_uint32), ("instructions", ctypes.c_uint32), ("cost", ctypes.c_uint32),
                ("waited", ctypes.c_uint32 * 2))  # fmt: skip


def declare(library: ctypes.CDLL) -> None:
    """Prototypes of the profile's functions."""
    library.emu_profile_start.restype = ctypes.c_bool
    library.emu_profile_start.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint32, ctypes.c_uint32]
    library.emu_profile_memories.restype = ctypes.c_bool
    library.emu_profile_memories.argtypes = [ctypes.c_void_p, ctypes.POINTER(memory.Costs)]
    library.emu_profile_take.restype = ctypes.c_uint32
    library.emu_profile_take.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Span), ctypes.c_uint32]


def take_waits(library: ctypes.CDLL, handle: int) -> Iterator[tuple[int, int, int, int, int]]:
    """Vector, instructions, cost, and the least and the most cycles waited for memories, of each run that has finished
    since the last time."""
    spans = (_Span * SPANS_MAX)()
    while count := library.emu_profile_take(handle, spans, SPANS_MAX):
        yield from ((s.vector, s.instructions, s.cost, *s.waited) for s in spans[:count])


def take(library: ctypes.CDLL, handle: int) -> Iterator[tuple[int, int, int]]:
    """The first three of them."""
    return (span[:3] for span in take_waits(library, handle))


@dataclass
class Recording:
    """Rows of vector, instructions, and cycles without waiting, with the least and with the most waiting for memories;
    those of the drive, and those while it reacted to faults. And the events of the drive."""

    spans: NDArray[np.int64]
    reacting: NDArray[np.int64]
    periods: int
    limited: int
    clamped: int
    weakened: int
    stack_bytes: int

    def of(self, vector: int) -> NDArray[np.int64]:
        return self.spans[self.spans[:, 0] == vector, 1:]

    def reactions_of(self, vector: int) -> NDArray[np.int64]:
        return self.reacting[self.reacting[:, 0] == vector, 1:]


@dataclass
class Stand:
    """The image, its plant and the vehicle."""

    loop: Loop
    command: Command = field(default_factory=Command)
    periods_per_ms: int = PERIODS_PER_MS

    def __post_init__(self) -> None:
        library = self.library = self.loop._library
        self.core = Core.of_simulation(library, self.loop._sim)  # type: ignore[arg-type]
        self.handle = self.core._handle
        library.can_frame_arrives.argtypes = [ctypes.c_void_p, ctypes.POINTER(Frame)]
        declare(library)
        self.time_ms = 0

    def run_ms(self, ramps: dict[str, tuple[float, float]] | None = None) -> NDArray[np.float64]:
        """Run one millisecond; send a command in every tenth."""
        if self.time_ms % 10 == 0:
            self.library.can_frame_arrives(self.handle, ctypes.byref(self.command.frame()))
        self.time_ms += 1
        return self.loop.run(self.periods_per_ms, ramps)

    def run(self, milliseconds: int, **values: float | str) -> None:
        self.command.values.update(values)
        for _ in range(milliseconds):
            self.run_ms()

    def power_up(self) -> None:
        """Bring the inverter to the state run with the vehicle's commands."""
        self.run(100)
        self.run(20, Mode="torque")
        self.loop.set("plant.vdc_V", V_DC)
        self.run(100)
        self.run(30, Enable=1)

    def profile(self, functions: list[Function], memories: bool = False) -> None:
        costs = cycles.image_costs(functions, CODE)
        if not self.library.emu_profile_start(self.handle, costs, len(costs), cycles.PIPELINE):
            raise FluxtrueError("the emulation is not in counting mode")
        if memories and not self.library.emu_profile_memories(self.handle, (memory.Costs * 2)(*memory.BOTH)):
            raise FluxtrueError("the emulator refuses the memories of the profile")

    def take(self) -> Iterator[tuple[int, int, int]]:
        """The runs that have finished since the last call."""
        return take(self.library, self.handle)

    def rows(self) -> list[tuple[int, ...]]:
        """The same as rows of a Recording."""
        own = cycles.ENTRY + cycles.RETURN
        return [(vector, instructions, cost + own, cost + own + least, cost + own + most)
                for vector, instructions, cost, least, most in take_waits(self.library, self.handle)]  # fmt: skip

    def stack_used(self) -> int:
        bottom, top = self.core.symbol("stack_bottom"), self.core.symbol("stack_top")
        content = self.core.read(bottom, top - bottom)
        unused = 0
        while content[unused : unused + 4] == STACK_PATTERN:
            unused += 4
        return top - bottom - unused


@contextmanager
def _powered(parts: Parts, mode: int) -> Iterator[Stand]:
    """The image with its plant, in the state run; `mode`: identification_mode."""
    motor = parts.emulated(emulation.COUNTING)
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 0.0, "vdc_V": 1.0, "current_noise_A_rms": 0.5,
                           "seed": 1.0}  # fmt: skip
    with Loop(motor.library, plant, motor.flux_map) as loop:
        stand = Stand(loop)
        loop.set("identification_mode", mode)
        stand.power_up()
        yield stand


def _drive(stand: Stand, spans: list[tuple[int, ...]], course: Course) -> NDArray[np.float64]:
    """The whole drive; returns the recorded columns of each period."""
    rows: list[NDArray[np.float64]] = []
    speed = 0.0
    for milliseconds, torque, rpm, v_dc in course:
        stand.command.values["TorqueRequested"] = torque
        stand.loop.set("plant.vdc_V", v_dc)
        for k in range(milliseconds):
            start, stop = (speed + (rpm - speed) * (k + j) / milliseconds for j in (0, 1))
            rows.append(stand.run_ms({"plant.speed_rad_s": (start * RPM, stop * RPM)}))
            spans += stand.rows()
        speed = rpm
    return np.concatenate(rows)


def _reaction(
    parts: Parts, functions: list[Function], mode: int, cause: str, watch: Watch | None
) -> list[tuple[int, ...]]:
    """A drive of its own, because no fault is reset while the rotor turns: the runs of each interrupt from the cause of
    the fault until switching has long been off."""
    with _powered(parts, mode) as stand:
        stand.command.values["TorqueRequested"] = FAULT_TORQUE
        for k in range(FAULT_RAMP_MS):
            start, stop = (FAULT_RPM * RPM * (k + j) / FAULT_RAMP_MS for j in (0, 1))
            stand.run_ms({"plant.speed_rad_s": (start, stop)})
        if int(stand.loop.get("fault_word")) != 0 or stand.loop.get("truth.torque_Nm") < FAULT_TORQUE / 2:
            raise FluxtrueError(f"the drive does not make torque before the fault of {cause}")
        stand.profile(functions, memories=True)
        if watch is not None:
            watch.begin(stand)
        if cause == GATE_DRIVER:
            stand.core.pend(GATE)
        else:
            stand.loop.set(cause, FAULTS[cause])
        stand.run(REACTION_MS)
        if int(stand.loop.get("fault_word")) == 0:
            raise FluxtrueError(f"{cause} was meant to be a fault")
        if watch is not None:
            watch.end(stand)
        return stand.rows()


def record(
    parts: Parts, functions: list[Function], mode: int, watch: Watch | None = None, course: Course = DRIVE
) -> Recording:
    """The whole drive, then the reactions to faults; `mode`: identification_mode. `watch` sees what they execute."""
    with _powered(parts, mode) as stand:
        loop = stand.loop
        loop.record(["voltage_limited", "table_clamped", "id_A"])
        stand.profile(functions, memories=True)
        if watch is not None:
            watch.begin(stand)
        spans: list[tuple[int, ...]] = []
        seen = _drive(stand, spans, course)
        fault = int(loop.get("fault_word"))
        if fault != 0 or int(loop.get("identification_mode")) != mode:
            raise FluxtrueError(f"the measured drive ended with fault word {fault:#x}")
        if watch is not None:
            watch.end(stand)
        causes = (*FAULTS, GATE_DRIVER)
        reacting = [row for cause in causes for row in _reaction(parts, functions, mode, cause, watch)]
        return Recording(
            np.array(spans, dtype=np.int64), np.array(reacting, dtype=np.int64), len(seen), int(seen[:, 0].sum()),
            int(seen[:, 1].sum()), int((seen[:, 2] < -100).sum()), stand.stack_used(),
        )  # fmt: skip
