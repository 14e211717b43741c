# SPDX-License-Identifier: Apache-2.0
"""An XCP session by pyxcp, on a bus connection of its own."""

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from typing import Final

import can
from pyxcp.config import create_application_from_config
from pyxcp.master import Master
from pyxcp.types import Command, XcpResponseError, XcpTimeoutError

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope.xcp import key

BENCH_ANSWER_S: Final = 2.0
SIMULATED_ANSWER_S: Final = 3600.0  # by the wall clock, independent of simulated time: it only ends a hang
CLOSE_S: Final = 1.0  # for the call that is in progress when the session ends
CHUNK: Final = 7  # bytes of an answer
NEGATIVE: Final = bytes((0xFE, 0x00))  # put into the queue of answers to end a wait
SILENT: Final = "the inverter does not answer any more"


def _key(resource: int, seed: bytes) -> bytes:
    return key(int.from_bytes(seed, "little")).to_bytes(4, "little")


def _connect(address: BusAddress, answer_s: float) -> Master:
    application = create_application_from_config({}, log_level=logging.CRITICAL)
    bus = application.transport.can
    bus.interface, bus.channel = address.interface, address.channel
    bus.can_id_master, bus.can_id_slave = COMMAND_ID, ANSWER_ID
    section = getattr(bus, address.interface, None)
    for name, value in address.options.items():
        if name == "bitrate":
            bus.bitrate = value
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
        self._made: Master | None = None  # the same, from before it is connected
        self._abandoned: Master | None = None  # whose call waits no longer
        self._stack = ExitStack()  # closes the connection
        self.is_busy = False  # a call is in progress
        self.thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="xcp")

    @property
    def is_abandoned(self) -> bool:
        """The call over this connection waits no longer for an inverter that is silent."""
        return self._abandoned is not None and self._abandoned is self._made

    def master(self) -> Master:
        """The connected, unlocked master."""
        if self._master is None:
            with self._standing_still():
                self._made = master = self._stack.enter_context(_connect(self._address, self._answer_s))
            master.connect()
            master.cond_unlock()
            self._master = master
        return self._master

    @contextmanager
    def reported(self) -> Iterator[None]:
        """What goes wrong becomes one message. After an ECU that did not answer, which may have been reset, the next
        call connects again."""
        if self.is_abandoned:  # the call before ended by itself in that moment
            self._disconnect()
        self.is_busy = True
        try:
            yield
        except XcpResponseError as error:
            if not self.is_abandoned:
                raise FluxtrueError(f"XCP: {error}") from error
            self._disconnect()
            raise FluxtrueError(f"XCP: {SILENT}") from error
        except (XcpTimeoutError, can.CanError, OSError, RuntimeError) as error:
            self._disconnect()
            raise FluxtrueError(f"XCP: {error}") from error
        finally:
            self.is_busy = False

    def _disconnect(self) -> None:
        self._master = self._made = self._abandoned = None
        with suppress(XcpTimeoutError, can.CanError, OSError, RuntimeError):
            self._stack.close()

    def abandon(self) -> None:
        """End the wait of a call for an inverter that is silent; before a virtual ECU that has ended it would be
        without end. Any thread."""
        made = self._made
        if made is not None and self.is_busy:
            self._abandoned = made
            with made.transport.resQueue_condition:
                made.transport.resQueue.append(NEGATIVE)
                made.transport.resQueue_condition.notify()

    def command(self, *data: int) -> bytes:
        """One command as its bytes; the positive answer without its first byte."""
        return bytes(self.master().transport.request(Command(data[0]), *data[1:]))

    def read(self, address: int, size: int) -> bytes:
        """Some bytes of the ECU."""
        master, data = self.master(), b""
        while len(data) < size:
            data += bytes(master.shortUpload(min(CHUNK, size - len(data)), address + len(data)))
        return data

    def close(self) -> None:
        """End the session, and a call that may wait for an ECU that has ended."""
        closed = self.thread.submit(self._stack.close)
        while not wait((closed,), CLOSE_S).done:
            self.abandon()
        self.thread.shutdown()
