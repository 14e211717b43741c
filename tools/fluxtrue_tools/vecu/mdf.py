# SPDX-License-Identifier: Apache-2.0
"""A bus log in MDF4, written in one go.

python-can's own writer appends frame by frame, which costs more than the simulation itself; the layout is the same.
"""

from array import array
from datetime import UTC, datetime
from hashlib import md5
from pathlib import Path

import can
import numpy as np
from asammdf import MDF, Signal
from asammdf.blocks.v4_blocks import SourceInformation
from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS
from can.io.mf4 import STD_DTYPE

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.interface import Interface


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

    def write(self, path: Path, interface: Interface | None = None) -> None:
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
            mdf.save(path, overwrite=True, compression=2)
