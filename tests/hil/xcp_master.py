# SPDX-License-Identifier: Apache-2.0
"""A small XCP master on the rig's bus and in its time: single commands and measurement lists."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rig import MS, Frame, Rig

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID
from fluxtrue_tools.a2l.elf import Description, Value

FORMATS = {"S16": "<h", "U32": "<I", "F32": "<f", "U8": "<B"}
POSITIVE, NEGATIVE = 0xFF, 0xFE
LOCKED, OUT_OF_RANGE, DENIED = 0x25, 0x22, 0x24
CALIBRATION = 0x01
PAYLOAD, STAMP = 7, 2
ANSWER_MS = 10


def key_of(seed: int) -> int:
    """The key for a seed: the same function as in firmware/calibration/xcp_access.c."""
    return ((seed << 7 | seed >> 25) & 0xFFFFFFFF) ^ 0x5A17F10C


class XcpError(Exception):
    """A negative answer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"error {code:#04x}")
        self.code = code


@dataclass
class Sampled:
    """A measurement list's recording."""

    time_ms: NDArray[np.float64]
    columns: dict[str, NDArray[np.float64]]


class Master:
    """Connects when it is made."""

    def __init__(self, rig: Rig, description: Description) -> None:
        self._rig = rig
        self.values = {value.name: value for value in description.values}
        self.measurements = {value.name: value for value in description.measurements}
        self._factors = {base.name: base.factor for base in description.bases}
        self._taken = len(rig.others[ANSWER_ID])
        self.command(0xFF, 0)

    def command(self, *data: int) -> bytes:
        """Send one command; returns the positive answer without its first byte."""
        self._rig.send(COMMAND_ID, bytes(data))
        for _ in range(ANSWER_MS):
            self._rig.advance(MS)
            frames = self._rig.others[ANSWER_ID][self._taken :]
            for k, frame in enumerate(frames):
                if frame.data[0] in (POSITIVE, NEGATIVE):
                    self._taken += k + 1
                    return self._check_answer(frame.data)
        raise AssertionError(f"no answer to command {data[0]:#04x} in {ANSWER_MS} ms")

    @staticmethod
    def _check_answer(data: bytes) -> bytes:
        if data[0] == NEGATIVE:
            raise XcpError(data[1])
        return data[1:]

    def unlock(self) -> None:
        """Seed and key for calibration."""
        seed = int.from_bytes(self.command(0xF8, 0, CALIBRATION)[1:5], "little")
        self.command(0xF7, 4, *key_of(seed).to_bytes(4, "little"))

    def _point(self, address: int) -> None:
        self.command(0xF6, 0, 0, 0, *address.to_bytes(4, "little"))

    def _raw(self, value: Value) -> float:
        size = struct.calcsize(FORMATS[value.type])
        data = self.command(0xF4, size, 0, 0, *value.address.to_bytes(4, "little"))
        return float(struct.unpack(FORMATS[value.type], data[:size])[0])

    def calibration(self, name: str) -> float:
        """A calibratable value, now."""
        return self._raw(self.values[name])

    def measurement(self, name: str) -> float:
        """The present value of a measurement in its unit."""
        value = self.measurements[name]
        return self._raw(value) * self._factors.get(value.base, 1.0)

    def write(self, name: str, value: float) -> None:
        """Write a calibratable value; XcpError if it is refused."""
        self._point(self.values[name].address)
        self.command(0xF0, 4, *struct.pack("<f", value))

    def checksum(self) -> int:
        """The checksum of the whole page."""
        self._point(min(value.address for value in self.values.values()))
        return int.from_bytes(self.command(0xF3, 0, 0, 0, *(4 * len(self.values)).to_bytes(4, "little"))[3:7], "little")

    def set_page(self, page: int) -> None:
        """0: the built-in values, 1: the working page; for ECU and master."""
        self.command(0xEB, 0x03, 0, page)

    def sample(self, names: Sequence[str], event: int, seconds: float) -> Sampled:
        """Run a measurement list for a while; event 0 is every millisecond, 1 every tenth."""
        frames = self._lay_out(names)
        self.command(0xD6)
        self.command(0xD5, 0, 1, 0)
        self.command(0xD4, 0, 0, 0, len(frames))
        for odt, entries in enumerate(frames):
            self.command(0xD3, 0, 0, 0, odt, len(entries))
        for odt, entries in enumerate(frames):
            self.command(0xE2, 0, 0, 0, odt, 0)
            for value in entries:
                size = struct.calcsize(FORMATS[value.type])
                self.command(0xE1, 0xFF, size, 0, *value.address.to_bytes(4, "little"))
        self.command(0xE0, 0x10, 0, 0, event, 0, 1, 0)
        self.command(0xDE, 1, 0, 0)
        first = self._taken
        self._rig.advance(seconds)
        self.command(0xDE, 0, 0, 0)
        return self._unpack(frames, self._rig.others[ANSWER_ID][first : self._taken])

    def _lay_out(self, names: Sequence[str]) -> list[list[Value]]:
        frames: list[list[Value]] = [[]]
        free = PAYLOAD - STAMP
        for name in names:
            value = self.measurements[name]
            size = struct.calcsize(FORMATS[value.type])
            if size > free:
                frames.append([])
                free = PAYLOAD
            frames[-1].append(value)
            free -= size
        return frames

    def _unpack(self, frames: list[list[Value]], received: Sequence[Frame]) -> Sampled:
        times: list[float] = []
        columns: dict[str, list[float]] = {value.name: [] for entries in frames for value in entries}
        for frame in received:
            odt = frame.data[0]
            if odt >= len(frames):
                continue
            at = 1
            if odt == 0:
                times.append(int.from_bytes(frame.data[1:3], "little"))
                at += STAMP
            for value in frames[odt]:
                (raw,) = struct.unpack_from(FORMATS[value.type], frame.data, at)
                columns[value.name].append(raw * self._factors.get(value.base, 1.0))
                at += struct.calcsize(FORMATS[value.type])
        arrays = {name: np.asarray(column) for name, column in columns.items()}
        return Sampled(np.asarray(times, dtype=np.float64), arrays)
