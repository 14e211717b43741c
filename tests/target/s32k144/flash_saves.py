# SPDX-License-Identifier: Apache-2.0
"""A drive on the emulated processor that identifies its motor, saves a record in the data flash, loses its supply."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import sizeof
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.emulate.core import Core
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.members import members

RPM: Final = 2 * np.pi / 60
FLASH, FLASH_BYTES, SLOT_BYTES, SECTOR_BYTES = 0x1000_0000, 0x1_0000, 512, 2048
SLOTS: Final = FLASH_BYTES // SLOT_BYTES
HEADER: Final = struct.Struct("<4I")  # layout, size, sequence, CRC: firmware/storage/slot.h
STATES: Final = 7  # of the filter
RECORD: Final = struct.Struct(f"<I{STATES}i{STATES}i4i")  # firmware/storage/memory.c
ADDED_VARIANCE_SHIFT: Final = (0, 3, 2, 8, 8, 8, 6)  # (ID-19): firmware/control/identify/record.c
ONE_Q30: Final = 1 << 30
CCIF: Final = 0x80
FAILED_SECTORS: Final = 3  # word of memory_t, firmware/storage/memory.h
RECALLED: Final = 28  # byte of it
STEP_S: Final = 10e-6
IDENTIFIED: Final = ("psi_f_Vs", "lq_scale", "ld_scale", "r_ohm", "drop_V")


@dataclass(frozen=True)
class Record:
    """What one slot of the data flash holds."""

    slot: int
    sequence: int
    content: bytes

    @property
    def states(self) -> tuple[int, ...]:
        """Identified values as the filter has them, q27."""
        return RECORD.unpack(self.content)[1 : 1 + STATES]

    @property
    def recalled(self) -> tuple[int, ...]:
        """What a drive that takes this record starts with, in the order of kept()."""
        _, *values = RECORD.unpack(self.content)
        stored = zip(values[STATES : 2 * STATES], ADDED_VARIANCE_SHIFT, strict=True)
        variances = [min(variance + (ONE_Q30 >> shift), ONE_Q30) for variance, shift in stored]
        return (*values[:STATES], *variances, *values[2 * STATES :])


def _record(slot: int, cells: bytes) -> Record | None:
    layout, size, sequence, crc = HEADER.unpack_from(cells)
    content = cells[HEADER.size : HEADER.size + size]
    if size > SLOT_BYTES - HEADER.size or zlib.crc32(cells[:12] + content) != crc:
        return None
    assert layout != 0
    return Record(slot, sequence, content)


def records(core: Core) -> list[Record]:
    """The intact records, the newest last."""
    cells = core.read(FLASH, FLASH_BYTES)
    found = (_record(k, cells[k * SLOT_BYTES : (k + 1) * SLOT_BYTES]) for k in range(SLOTS))
    return sorted((r for r in found if r is not None), key=lambda r: r.sequence)


def _kept_members() -> Iterator[str]:
    """The members of the drive's state that a record sets."""
    diagonal = [j * (2 * STATES + 1 - j) // 2 for j in range(STATES)]  # the upper triangle, row by row
    yield from (f"task.identify.kalman.x_q27[{j}]" for j in range(STATES))
    yield from (f"task.identify.kalman.p_q30[{p}]" for p in diagonal)
    yield from (f"task.compensation.{name}" for name in ("dead_time", "knee_q17", "measured"))
    yield "task.trim.trim"


def _place(parts: Parts, core: Core, member: str) -> tuple[int, Any]:
    """Address and ctypes type of a member of the drive, which is the first member of the ECU."""
    offset, kind = members(str(parts.image), "drive_t").place(member)
    return core.symbol("ecu") + offset, kind


def kept(parts: Parts, core: Core) -> tuple[int, ...]:
    """The values in the drive's own state, found by their names in the image."""
    places = (_place(parts, core, name) for name in _kept_members())
    return tuple(kind.from_buffer_copy(core.read(address, sizeof(kind))).value for address, kind in places)


def set_trim(parts: Parts, core: Core, trim: int) -> None:
    """Gives the drive the trim that it would find after minutes with an inverter whose dead time is another; the
    compensation, their sum, stays as it is."""
    dead_time, kind = _place(parts, core, "parameters.modulate.dead_time_q16")
    half = kind.from_buffer_copy(core.read(dead_time, sizeof(kind))).value // 2
    for name, value in (("base", half - trim), ("trim", trim)):
        address, kind = _place(parts, core, f"task.trim.{name}")
        core.write(address, bytes(kind(value)))


def fill(core: Core, last: int) -> None:
    """Copies of the newest record in all slots up to `last`, as if there had been so many saves."""
    newest = records(core)[-1]
    layout, size, *_ = HEADER.unpack(core.read(FLASH + newest.slot * SLOT_BYTES, HEADER.size))
    for slot in range(last + 1):
        head = struct.pack("<3I", layout, size, slot)
        crc = zlib.crc32(head + newest.content)
        cells = head + struct.pack("<I", crc) + newest.content
        core.write(FLASH + slot * SLOT_BYTES, cells)


@contextmanager
def key_on(parts: Parts, flash: bytes | None = None, **plant: float) -> Iterator[tuple[Loop, Core]]:
    """A drive at standstill that has just started, with these contents of its data flash; its magnet is weak."""
    motor = parts.emulated()
    machine = motor.plant | {"imposed_speed": 1.0, "vdc_V": 350.0, "magnet_scale": 0.88} | plant
    with Loop(motor.library, machine, motor.flux_map) as loop:
        core = Core.of_simulation(motor.library, loop._sim)
        if flash is not None:
            core.write(FLASH, flash)
            power_cycle(loop)
        yield loop, core


def power_cycle(loop: Loop) -> None:
    """The supply of the processor fails and returns."""
    loop.set("emulator.power_cycle", 1)


def drive(loop: Loop, points: tuple[tuple[float, float], ...], part_s: float) -> None:
    """Switching on, ramps from point to point (rpm, N·m), back to standstill without torque, switching off."""
    for name in ("enable", "identification", "torque_loop"):
        loop.set(name, 1)
    at = (0.0, 0.0)
    for rpm, torque in (*points, (0.0, 0.0)):
        ramps = {"plant.speed_rad_s": (at[0] * RPM, rpm * RPM), "torque_requested_Nm": (at[1], torque)}
        loop.run(round(part_s * 1e4), ramps)
        at = (rpm, torque)
    assert loop.get("fault_word") == 0
    loop.set("enable", 0)


def saves(core: Core) -> int:
    """Number of records saved since the start."""
    return core.word("memory", 0)


def is_recalled(core: Core) -> bool:
    """Whether this start has taken a record."""
    return core.read(core.symbol("memory") + RECALLED, 1) != b"\0"


def until_saving(loop: Loop, core: Core) -> None:
    """Run until the processor has slowed down for its flash."""
    for _ in range(3000):
        loop.run(1)
        if core.register("SMC.PMCTRL") == 0:
            return
    raise AssertionError("nothing is saved")


def until_saved(loop: Loop, core: Core) -> None:
    """Run until the save is complete and the processor runs at its full speed again."""
    for _ in range(4000):
        loop.run(1)
        if core.register("SMC.PMCTRL") != 0:
            return
    raise AssertionError("the save does not end")


def command(core: Core) -> tuple[int, ...] | None:
    """The flash command that runs: its code and its address."""
    if core.register("FTFC.FSTAT") & CCIF != 0:
        return None
    return tuple(core.register(f"FTFC.FCCOB{k}") for k in range(4))


def advance(core: Core, seconds: float) -> None:
    """Let this time pass for the processor alone."""
    end = core.now_s + seconds
    while end - core.now_s > 1e-9:
        core.run(end - core.now_s)


def instants(core: Core, shares: tuple[float, ...]) -> list[float]:
    """Times from now at which to cut the save: these shares of every command, and between two commands."""
    start, begun, last = core.now_s, 0.0, None
    found: list[float] = []
    while core.register("SMC.PMCTRL") == 0:
        now, runs = core.now_s - start, command(core)
        if runs != last:
            found += [begun + share * (now - begun) for share in shares] if last is not None else []
            found.append(now)
            begun, last = now, runs
        advance(core, STEP_S)
    return found


def identified(loop: Loop) -> dict[str, float]:
    """The values in physical units."""
    return {name: loop.get(name) for name in IDENTIFIED}
