# SPDX-License-Identifier: Apache-2.0
"""What XCP measures during a recording: the lists that the ECU is told to send, and how to read its frames."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import can
from pyxcp.master import Master

from fluxtrue_tools.a2l.cli import ANSWER_ID
from fluxtrue_tools.a2l.elf import Base, Value
from fluxtrue_tools.vecu.mdf import Group

PREFIX: Final = "XCP."
RASTER: Final = 1  # each tenth millisecond: fast enough to plot, and a third of the free frames of the bus
PER_FRAME: Final = 3  # values of two bytes behind the number of the frame
WHOLE_BYTES: Final = 0xFF
SELECT: Final = 2
START: Final = 1
STOP: Final = 0


@dataclass(frozen=True)
class Measured:
    """Some measurements of one frame."""

    values: tuple[Value, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True)
class Layout:
    """The measurements in each frame, by its number."""

    frames: dict[int, Measured]

    def groups(self) -> list[Group]:
        """An empty group for each frame."""
        return [Group({PREFIX + value.name: value.unit for value in frame.values}) for frame in self.frames.values()]

    def take(self, frame: can.Message, groups: list[Group]) -> None:
        """Add the values of a frame that holds some."""
        if frame.arbitration_id != ANSWER_ID or not frame.data or frame.data[0] not in self.frames:
            return
        measured = self.frames[frame.data[0]]
        raw = struct.unpack_from(f"<{len(measured.values)}h", frame.data, 1)
        group = groups[list(self.frames).index(frame.data[0])]
        group.add(frame.timestamp, *(count * factor for count, factor in zip(raw, measured.factors, strict=True)))


def measurable(values: Iterable[Value]) -> list[Value]:
    """The measurements of two bytes with a sign: enough of them fit on the bus."""
    return [value for value in values if value.type == "S16"]


def start(master: Master, values: Iterable[Value], bases: Iterable[Base]) -> Layout:
    """Let the ECU send the values; needs no key."""
    chosen = measurable(values)
    frames = [tuple(chosen[k : k + PER_FRAME]) for k in range(0, len(chosen), PER_FRAME)]
    factors = {base.name: base.factor for base in bases}
    master.freeDaq()
    master.allocDaq(1)
    master.allocOdt(0, len(frames))
    for number, frame in enumerate(frames):
        master.allocOdtEntry(0, number, len(frame))
    for number, frame in enumerate(frames):
        master.setDaqPtr(0, number, 0)
        for value in frame:
            master.writeDaq(WHOLE_BYTES, 2, 0, value.address)
    master.setDaqListMode(0, 0, RASTER, 1, 0)
    first = master.startStopDaqList(SELECT, 0).firstPid
    master.startStopSynch(START)
    return Layout({first + number: Measured(frame, tuple(factors.get(value.base, 1.0) for value in frame))
                   for number, frame in enumerate(frames)})  # fmt: skip


def stop(master: Master) -> None:
    """The ECU sends no measurements any more."""
    master.startStopSynch(STOP)
