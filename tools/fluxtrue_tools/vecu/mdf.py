# SPDX-License-Identifier: Apache-2.0
"""A bus log in MDF4, with further signals beside its frames, written in one go.

python-can's own writer appends frame by frame, which costs more than the simulation itself; the layout is the same.
"""

from array import array
from collections.abc import Iterable
from datetime import UTC, datetime
from hashlib import md5
from pathlib import Path
from typing import Final

import can
import numpy as np
from asammdf import MDF, Signal
from asammdf.blocks.v4_blocks import SourceInformation
from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

from fluxtrue_tools import light_can
from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.interface import Interface

STD_DTYPE: Final = light_can.with_mdf().STD_DTYPE


class Group:
    """Signals with common time stamps that are not decoded from frames of the DBC."""

    def __init__(self, units: dict[str, str]) -> None:
        self._units = units
        self._times, self._columns = array("d"), [array("d") for _ in units]

    def __len__(self) -> int:
        return len(self._times)

    def add(self, time_s: float, *values: float) -> None:
        """One value of each signal, in the order of their names."""
        self._times.append(time_s)
        for column, value in zip(self._columns, values, strict=True):
            column.append(value)

    def signals(self) -> list[Signal]:
        """The signals for asammdf."""
        times = np.maximum.accumulate(np.asarray(self._times, dtype=np.float64))
        return [Signal(name=name, unit=unit, samples=np.asarray(column, dtype=np.float64), timestamps=times)
                for (name, unit), column in zip(self._units.items(), self._columns, strict=True)]  # fmt: skip


class BusLog:
    """Collects data frames; a python-can listener."""

    def __init__(self) -> None:
        self._times, self._ids, self._flags = array("d"), array("L"), array("B")
        self._data = bytearray()

    def __call__(self, message: can.Message) -> None:
        if message.is_error_frame or message.is_remote_frame:
            return
        self._times.append(message.timestamp)
        self._ids.append(message.arbitration_id)
        self._flags.append(message.dlc | message.is_extended_id << 4 | (not message.is_rx) << 5)
        self._data += bytes(message.data).ljust(8, b"\0")

    def __len__(self) -> int:
        return len(self._times)

    def write(self, path: Path, interface: Interface | None = None, groups: Iterable[Group] = ()) -> None:
        """The file; the DBC goes in as an attachment, because its factors are those of one motor."""
        frames = np.zeros(len(self), dtype=STD_DTYPE)
        flags = np.frombuffer(self._flags, dtype=np.uint8)
        frames["CAN_DataFrame.BusChannel"] = 1
        frames["CAN_DataFrame.ID"] = np.asarray(self._ids, dtype=np.uint32)
        frames["CAN_DataFrame.IDE"] = flags >> 4 & 1
        frames["CAN_DataFrame.Dir"] = flags >> 5
        frames["CAN_DataFrame.DLC"] = frames["CAN_DataFrame.DataLength"] = flags & 0xF
        frames["CAN_DataFrame.DataBytes"][:, :8] = np.frombuffer(self._data, dtype=np.uint8).reshape(-1, 8)
        times = np.maximum.accumulate(np.asarray(self._times, dtype=np.float64))
        attachment = None
        if interface is not None:
            data = interface.text.encode()
            attachment = (data, DBC.name, md5(data, usedforsecurity=False).digest())
        with MDF(version="4.10") as mdf:
            mdf.header.start_time = datetime.now(UTC)
            source = SourceInformation(source_type=SOURCE_BUS, bus_type=BUS_TYPE_CAN)
            mdf.append(
                Signal(name="CAN_DataFrame", samples=frames, timestamps=times, attachment=attachment, source=source)
            )
            for group in groups:
                if len(group):
                    mdf.append(group.signals())
            mdf.save(path, overwrite=True, compression=2)
