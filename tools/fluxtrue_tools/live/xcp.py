# SPDX-License-Identifier: Apache-2.0
"""An XCP session by pyxcp, on a bus connection of its own."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from typing import Final

from pyxcp.config import create_application_from_config
from pyxcp.master import Master
from pyxcp.types import XcpResponseError, XcpTimeoutError

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError

BENCH_ANSWER_S: Final = 2.0
SIMULATED_ANSWER_S: Final = 3600.0  # by the wall clock, independent of simulated time: it only ends a hang
CHUNK: Final = 7  # bytes of an answer


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


class Xcp:
    """One session; every call runs in its one thread, since the master is not made for more."""

    def __init__(self, address: BusAddress, answer_s: float = BENCH_ANSWER_S,
                 standing_still: Callable[[], AbstractContextManager[None]] = nullcontext) -> None:  # fmt: skip
        self._address, self._answer_s, self._standing_still = address, answer_s, standing_still
        self._master: Master | None = None
        self._stack = ExitStack()  # closes the connection
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="xcp")

    def master(self) -> Master:
        """The connected, unlocked master."""
        if self._master is None:
            with self._standing_still():
                master = self._stack.enter_context(_connect(self._address, self._answer_s))
            master.connect()
            master.cond_unlock()
            self._master = master
        return self._master

    @contextmanager
    def reported(self) -> Iterator[None]:
        """What goes wrong becomes one message. After an ECU that did not answer, which may have been reset, the next
        call connects again."""
        try:
            yield
        except XcpResponseError as error:
            raise FluxtrueError(f"XCP: {error}") from error
        except (XcpTimeoutError, OSError, RuntimeError) as error:
            self._master = None
            with suppress(XcpTimeoutError, OSError, RuntimeError):
                self._stack.close()
            raise FluxtrueError(f"XCP: {error}") from error

    def read(self, address: int, size: int) -> bytes:
        """Some bytes of the ECU."""
        master, data = self.master(), b""
        while len(data) < size:
            data += bytes(master.shortUpload(min(CHUNK, size - len(data)), address + len(data)))
        return data

    def close(self) -> None:
        """End the session."""
        self.thread.submit(self._stack.close).result()
        self.thread.shutdown()
