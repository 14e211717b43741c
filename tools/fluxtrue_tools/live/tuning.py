# SPDX-License-Identifier: Apache-2.0
"""Calibration values over XCP: read, written, loaded from a file, and brought back to those of the build."""

import math
import struct
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from pyxcp.master import Master
from pyxcp.types import XcpResponseError

from fluxtrue_tools.a2l.elf import Description, Value
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live import freeze, measuring
from fluxtrue_tools.live.xcp import Xcp

FLOAT: Final = struct.Struct("<f")
SEGMENT: Final = 0
REFERENCE, WORKING = 0, 1  # pages: values of the build, present values
BY_TOOL: Final = 0x02  # which page a read goes to; the drive keeps its own


class Tuning:
    """The ECU's calibration values. Its calls run in `thread`."""

    def __init__(self, xcp: Xcp, description: Description) -> None:
        self._xcp, self._description = xcp, description
        self._values = {value.name: value for value in description.values}

    @property
    def thread(self) -> ThreadPoolExecutor:
        """Where the calls run."""
        return self._xcp.thread

    def _read(self, page: int) -> dict[str, float]:
        """All values of one page."""
        self._xcp.master().setCalPage(BY_TOOL, SEGMENT, page)
        return {name: float(FLOAT.unpack(self._xcp.read(value.address, FLOAT.size))[0])
                for name, value in self._values.items()}  # fmt: skip

    def present(self) -> dict[str, float]:
        """Every value as the ECU holds it."""
        with self._xcp.reported():
            return self._read(WORKING)

    def table(self) -> list[dict[str, Any]]:
        """Every value with its range and with the value of the build."""
        with self._xcp.reported():
            built, present = self._read(REFERENCE), self._read(WORKING)
        return [{"name": value.name, "text": value.text, "unit": value.unit, "lo": value.lo, "hi": value.hi,
                 "value": present[value.name], "default": built[value.name]}
                for value in self._values.values()]  # fmt: skip

    def _known(self, name: str) -> Value:
        if name not in self._values:
            raise FluxtrueError(f"no calibration value '{name}', allowed: {', '.join(self._values)}")
        return self._values[name]

    def _in_range(self, name: str, value: float) -> None:
        info = self._known(name)
        if not (math.isfinite(value) and info.lo <= value <= info.hi):
            raise FluxtrueError(f"{name} = {value:g}: allowed: {info.lo:g} … {info.hi:g} {info.unit}".rstrip())

    def write(self, name: str, value: float) -> None:
        """Write a value to the ECU, which checks it."""
        info = self._known(name)
        with self._xcp.reported():
            master = self._xcp.master()
            master.setMta(info.address)
            self._download(master, info, value)

    def _download(self, master: Master, info: Value, value: float) -> None:
        try:
            master.download(FLOAT.pack(value))
        except (XcpResponseError, OverflowError) as error:
            raise FluxtrueError(f"{info.name} = {value:g}: refused by the ECU ({error}), "
                                f"allowed: {info.lo:g} … {info.hi:g} {info.unit}, nothing so small that the drive "
                                "would make it zero") from error  # fmt: skip

    def load(self, values: Mapping[str, float]) -> None:
        """Write the values of a file. Nothing is written if one of them is unknown or out of its range."""
        for name, value in values.items():
            self._in_range(name, value)
        for name, value in values.items():
            self.write(name, value)

    def restore(self) -> None:
        """Bring the values of the build back."""
        with self._xcp.reported():
            self._xcp.master().copyCalPage(SEGMENT, REFERENCE, SEGMENT, WORKING)

    def freeze(self) -> dict[str, Any]:
        """The freeze frame of the first fault."""
        with self._xcp.reported():
            return freeze.frame(self._xcp, self._description)

    def measure(self) -> measuring.Layout:
        """Let the ECU send measurements, for a recording."""
        with self._xcp.reported():
            return measuring.start(self._xcp.master(), self._description.measurements, self._description.bases)

    def measure_no_more(self) -> None:
        """The ECU sends no measurements any more."""
        with self._xcp.reported():
            measuring.stop(self._xcp.master())

    def close(self) -> None:
        """End the session."""
        self._xcp.close()
