# SPDX-License-Identifier: Apache-2.0
"""Calibration values over XCP, by pyxcp, on a bus connection of its own."""

import logging
import struct
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from typing import Any, Final

from pyxcp.config import create_application_from_config
from pyxcp.master import Master
from pyxcp.types import XcpResponseError, XcpTimeoutError

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID
from fluxtrue_tools.a2l.elf import Description
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError

FLOAT: Final = struct.Struct("<f")
BENCH_ANSWER_S: Final = 2.0
SIMULATED_ANSWER_S: Final = 3600.0  # by the wall clock, independent of simulated time: it only ends a hang


def _key(resource: int, seed: bytes) -> bytes:
    """The published function of firmware/calibration/xcp_access.c."""
    value = int.from_bytes(seed, "little")
    return (((value << 7 | value >> 25) & 0xFFFFFFFF) ^ 0x5A17F10C).to_bytes(4, "little")


def _connect(address: BusAddress, answer_s: float) -> Master:
    application = create_application_from_config({}, log_level=logging.CRITICAL)
    can = application.transport.can
    can.interface, can.channel = address.interface, address.channel
    can.can_id_master, can.can_id_slave = COMMAND_ID, ANSWER_ID
    section = getattr(can, address.interface, None)
    for name, value in address.options.items():
        if name == "bitrate":
            can.bitrate = value
        elif section is not None and hasattr(section, name):
            setattr(section, name, value)
    application.transport.timeout = answer_s
    application.general.seed_n_key_function = _key
    application.general.disable_error_handling = True
    return Master("can", config=application)


class Tuning:
    """One session; every call runs in its one thread, since the master is not made for more."""

    def __init__(self, address: BusAddress, description: Description, answer_s: float = BENCH_ANSWER_S,
                 standing_still: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:  # fmt: skip
        self._address, self._answer_s, self._standing_still = address, answer_s, standing_still
        self._values = {value.name: value for value in description.values}
        self._master: Master | None = None
        self._stack = ExitStack()  # closes the connection
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="xcp")

    def _session(self) -> Master:
        if self._master is None:
            with self._standing_still():
                master = self._stack.enter_context(_connect(self._address, self._answer_s))
            master.connect()
            master.cond_unlock()
            self._master = master
        return self._master

    def _read(self, name: str) -> float:
        master = self._session()
        master.setMta(self._values[name].address)
        (value,) = FLOAT.unpack(master.upload(FLOAT.size))
        return float(value)

    def _tried(self, call: Any) -> Any:
        try:
            return call()
        except (XcpResponseError, XcpTimeoutError, OSError, RuntimeError) as error:
            raise FluxtrueError(f"XCP: {error}") from error

    def table(self) -> list[dict[str, Any]]:
        """Every value with its range."""
        return [{"name": value.name, "text": value.text, "unit": value.unit, "lo": value.lo, "hi": value.hi,
                 "value": self._tried(lambda name=value.name: self._read(name))}
                for value in self._values.values()]  # fmt: skip

    def write(self, name: str, value: float) -> float:
        """Write a value to the ECU, which checks it; the result is the value that the ECU then holds."""
        if name not in self._values:
            raise FluxtrueError(f"no calibration value '{name}', allowed: {', '.join(self._values)}")
        info = self._values[name]
        master = self._tried(self._session)
        try:
            master.setMta(info.address)
            master.download(FLOAT.pack(value))
        except XcpResponseError as error:
            raise FluxtrueError(f"{name} = {value:g}: refused by the ECU ({error}), "
                                f"allowed: {info.lo:g} … {info.hi:g} {info.unit}, nothing so small that the drive "
                                "would make it zero") from error  # fmt: skip
        return float(self._tried(lambda: self._read(name)))

    def close(self) -> None:
        """End the session."""
        self.thread.submit(self._stack.close).result()
        self.thread.shutdown()
