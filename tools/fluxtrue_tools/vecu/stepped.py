# SPDX-License-Identifier: Apache-2.0
"""A CAN connection in the virtual ECU's own time, however fast this computer is.

Simulated time passes in run() only. Frames sent before it are received before time advances, and the frames that the
ECU has sent meanwhile have arrived when it returns.
"""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import can

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST

# A frame that the ECU has counted as sent arrives after at most one more turn of its loop.
TURNS: Final = 100
TURN_S: Final = 0.1


def client_port(bus: can.BusABC) -> int:
    """Our port of a socketcand connection, by which the bench channel identifies us; 0 for another interface."""
    connection = getattr(bus, "_SocketCanDaemonBus__socket", None)
    return int(connection.getsockname()[1]) if isinstance(connection, socket.socket) else 0


def connect(port: int) -> can.BusABC:
    """A socketcand client of a virtual ECU."""
    return can.Bus(interface="socketcand", channel="can0", host=HOST, port=port, tcp_tune=True)


class SteppedBus:
    """The connection, and the bench channel that lets time pass."""

    def __init__(self, bus: can.BusABC, channel: Channel) -> None:
        self._bus, self._channel, self._port = bus, channel, client_port(bus)
        self._sent = self._heard = 0
        self._time = threading.Lock()
        self._now_s = 1e-9 * channel.run(0.0, self._port, 0).now_ns

    @property
    def now_s(self) -> float:
        """Simulated time since the virtual ECU's start, at the end of the last run."""
        return self._now_s

    def send(self, message: can.Message) -> None:
        """One frame, before time continues."""
        self._bus.send(message)
        self._sent += 1

    def run(self, milliseconds: float) -> tuple[list[can.Message], list[list[float]]]:
        """Let time pass; the result is the frames that arrived meanwhile, and the rows of a recording."""
        with self._time:
            ran = self._channel.run(milliseconds, self._port, self._sent)
        self._now_s = 1e-9 * ran.now_ns
        frames = [self._receive() for _ in range(ran.frames - self._heard)]
        self._heard = max(ran.frames, self._heard)
        return frames, ran.rows

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Time does not pass in this context, so that another client can connect: python-can refuses a greeting with
        a frame appended."""
        with self._time:
            yield

    def _receive(self) -> can.Message:
        for _ in range(TURNS):
            message = self._bus.recv(TURN_S)
            if message is not None:
                return message
            self._channel.ask("hello")  # it runs, and another turn of its loop has passed
        raise FluxtrueError("the virtual ECU says it has sent more frames than have arrived")
