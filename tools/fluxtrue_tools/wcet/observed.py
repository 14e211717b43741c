# SPDX-License-Identifier: Apache-2.0
"""What the emulated drive executes, beside what the bounds assume: passes through loops, and which code runs at all."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.bench.image import CODE, CODE_SIZE, Stand
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet.bound import Annotated, Handlers, Image


class Region(ctypes.Structure):
    """The C type emu_region_t."""

    _fields_ = (("header", ctypes.c_uint32), ("root", ctypes.c_uint16), ("end", ctypes.c_uint16))


def place(address: int) -> int:
    """The number of a half word of the flash and then of the RAM."""
    begin = 0
    for start, size in CODE:
        if start <= address < start + size:
            return (begin + address - start) // 2
        begin += size
    raise FluxtrueError(f"{address:#x}: no code is expected there")


@dataclass(frozen=True)
class Plan:
    """The regions of all functions that handlers reach, and which instruction is in which."""

    regions: Sequence[Region]
    of: bytes
    headers: dict[int, int]  # region: header


def plan(image: Image, reached: Iterable[str]) -> Plan:
    """Regions in the order that emu_profile_passes() expects."""
    regions = [Region(0, 0, 0)]
    of = np.zeros(CODE_SIZE // 2, dtype=np.uint16)
    headers: dict[int, int] = {}

    def add(blocks: Iterable[int], header: int, root: int, inner: list[Annotated], listed: list[Annotated]) -> None:
        number = len(regions)
        regions.append(Region(header, root or number, 0))
        headers[number] = header
        for block in blocks:
            for instruction in graph.blocks[block].instructions:
                of[place(instruction.address)] = number
        for one in inner:
            within = [other for other in listed if other.loop.parent is one.loop]
            add(one.loop.blocks, one.loop.header, root or number, within, listed)
        regions[number].end = len(regions)

    for name in sorted(reached):
        graph, loops = image.flow(name), image.loops(name)
        add(graph.blocks, 0, 0, [one for one in loops if one.loop.parent is None], loops)
    return Plan(regions, of.tobytes(), headers)


class Watch:
    """Collects over several drives of the same image."""

    def __init__(self, wanted: Plan) -> None:
        self._plan = wanted
        self.most: dict[int, int] = {}  # by header: its most runs each time the loop is entered
        self._ran = np.zeros(CODE_SIZE // 2, dtype=bool)

    def begin(self, stand: Stand) -> None:
        """Start the observation after Stand.profile()."""
        library = stand.library
        library.emu_profile_passes.restype = ctypes.c_bool
        library.emu_profile_passes.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint32,
                                               ctypes.POINTER(Region), ctypes.c_uint32]  # fmt: skip
        regions = self._plan.regions
        array = (Region * len(regions))(*regions)
        if not library.emu_profile_passes(stand.handle, self._plan.of, CODE_SIZE // 2, array, len(regions)):
            raise FluxtrueError("the emulator refuses the regions of the profile")

    def end(self, stand: Stand) -> None:
        most = (ctypes.c_uint32 * len(self._plan.regions))()
        ran = (ctypes.c_uint8 * (CODE_SIZE // 2))()
        stand.library.emu_profile_most_passes.argtypes = [ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint32)]
        stand.library.emu_profile_ran.argtypes = [ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint8), ctypes.c_uint32]
        stand.library.emu_profile_most_passes(stand.handle, most)
        stand.library.emu_profile_ran(stand.handle, ran, CODE_SIZE // 2)
        for region, header in self._plan.headers.items():
            if header:
                self.most[header] = max(self.most.get(header, 0), most[region])
        self._ran |= np.frombuffer(ran, dtype=np.uint8).astype(bool)

    def has_run(self, address: int) -> bool:
        return bool(self._ran[place(address)])


def mismatches(image: Image, handlers: Handlers, watch: Watch) -> list[str]:
    """What the emulated drive did that the bounds exclude."""
    found = []
    for name in sorted(handlers.reached):
        runs = handlers.header_runs(name)
        for one in image.loops(name):
            seen, most = watch.most.get(one.loop.header, 0), runs[one.loop.header]
            if seen > most:
                found.append(f"the loop of {one.where} ran {seen} times, not at most {most}")
        found += [f"{name}: {at:#x} ran, which {handlers.mode} excludes"
                  for at in sorted(handlers.excluded(name)) if watch.has_run(at)]  # fmt: skip
    return found


def entered(image: Image, reached: Iterable[str], watch: Watch) -> tuple[int, int]:
    """Loops that the emulated drive has entered, and all that handlers reach."""
    headers = [one.loop.header for name in reached for one in image.loops(name)]
    return sum(watch.most.get(header, 0) > 0 for header in headers), len(headers)
