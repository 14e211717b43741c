# SPDX-License-Identifier: Apache-2.0
"""A small XCP master: one command, one answer; on a bench, or in the time of a virtual ECU."""

import time
from typing import Final, Protocol

import can

from fluxtrue_tools.a2l.cli import ANSWER_ID, COMMAND_ID
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.vecu.stepped import SteppedBus

POSITIVE, NEGATIVE = 0xFF, 0xFE
CONNECT, SET_MTA, UPLOAD, BUILD_CHECKSUM = 0xFF, 0xF6, 0xF5, 0xF3
GET_SEED, UNLOCK, DOWNLOAD = 0xF8, 0xF7, 0xF0
CALIBRATION: Final = 0x01
UPLOAD_MAX: Final = 7
ANSWER_S: Final = 2.0  # on a bench
ANSWER_MS: Final = 50  # of simulated time


class XcpRefused(FluxtrueError):
    """A negative answer."""

    def __init__(self, command: int, code: int) -> None:
        super().__init__(f"XCP: the ECU refuses command {command:#04x} (error {code:#04x})")
        self.code = code


class Master(Protocol):
    """What Scope needs of an XCP connection: that of XcpMaster, or another program's own."""

    def command(self, *data: int) -> bytes:
        """Send one command; the positive answer without its first byte. XcpRefused if it is negative."""

    def pass_time(self, seconds: float) -> None:
        """Wait, or let simulated time pass."""


class Line(Protocol):
    """A bus connection with its own time."""

    def exchange(self, frame: can.Message) -> bytes: ...
    def pass_time(self, seconds: float) -> None: ...


def is_answer(message: can.Message) -> bool:
    """A positive or negative answer of the slave, not a measurement."""
    return (
        message.arbitration_id == ANSWER_ID and not message.is_extended_id and message.data[0] in (POSITIVE, NEGATIVE)
    )


class WallLine:
    """A bench, or a virtual ECU that keeps pace with the wall clock."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def exchange(self, frame: can.Message) -> bytes:
        """One command and its answer."""
        try:
            answer = self._answer(frame)
        except (can.CanError, OSError) as error:
            raise FluxtrueError(f"the bus is lost: {(str(error).splitlines() or [type(error).__name__])[0]}") from None
        if answer is not None:
            return answer
        raise FluxtrueError(f"XCP: no answer within {ANSWER_S:g} s: is the ECU on this bus?")

    def _answer(self, frame: can.Message) -> bytes | None:
        self._bus.send(frame)
        end_s = time.monotonic() + ANSWER_S
        while (left_s := end_s - time.monotonic()) > 0.0:
            message = self._bus.recv(left_s)
            if message is not None and is_answer(message):
                return bytes(message.data)
        return None

    def pass_time(self, seconds: float) -> None:
        """Wait."""
        time.sleep(seconds)


class SteppedLine:
    """A virtual ECU whose time passes only here."""

    def __init__(self, bus: SteppedBus) -> None:
        self._bus = bus

    def exchange(self, frame: can.Message) -> bytes:
        """One command and its answer, a millisecond of simulated time or more."""
        self._bus.send(frame)
        for _ in range(ANSWER_MS):
            for message in self._bus.run(1.0)[0]:
                if is_answer(message):
                    return bytes(message.data)
        raise FluxtrueError(f"XCP: no answer within {ANSWER_MS} ms of simulated time")

    def pass_time(self, seconds: float) -> None:
        """Let simulated time pass."""
        self._bus.run(1e3 * seconds)


class XcpMaster:
    """Connects when it is made."""

    def __init__(self, line: Line) -> None:
        self._line = line
        self.command(CONNECT, 0)

    def command(self, *data: int) -> bytes:
        """Send one command; the positive answer without its first byte."""
        answer = self._line.exchange(can.Message(arbitration_id=COMMAND_ID, data=bytes(data), is_extended_id=False))
        if answer[0] == NEGATIVE:
            raise XcpRefused(data[0], answer[1])
        return answer[1:]

    def pass_time(self, seconds: float) -> None:
        """Wait, or let simulated time pass."""
        self._line.pass_time(seconds)


def upload(master: Master, address: int, size: int) -> bytes:
    """Memory of the ECU."""
    master.command(SET_MTA, 0, 0, 0, *address.to_bytes(4, "little"))
    content = b""
    while len(content) < size:
        wanted = min(size - len(content), UPLOAD_MAX)
        content += master.command(UPLOAD, wanted)[:wanted]
    return content


def checksum(master: Master, address: int, size: int) -> int:
    """CRC-32 of memory of the ECU, as the ECU computes it."""
    master.command(SET_MTA, 0, 0, 0, *address.to_bytes(4, "little"))
    return int.from_bytes(master.command(BUILD_CHECKSUM, 0, 0, 0, *size.to_bytes(4, "little"))[3:7], "little")


def key(seed: int) -> int:
    """The published function of firmware/calibration/xcp_access.c."""
    return ((seed << 7 | seed >> 25) & 0xFFFFFFFF) ^ 0x5A17F10C


def unlock(master: Master) -> None:
    """Seed and key for calibration."""
    seed = int.from_bytes(master.command(GET_SEED, 0, CALIBRATION)[1:5], "little")
    master.command(UNLOCK, 4, *key(seed).to_bytes(4, "little"))
