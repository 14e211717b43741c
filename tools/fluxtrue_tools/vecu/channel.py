# SPDX-License-Identifier: Apache-2.0
"""The bench channel: control of the test stand beside CAN. The commands are in tests/vecu/bench.h."""

import socket
from collections.abc import Sequence
from dataclasses import dataclass, field

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.kinds import Address

TIMEOUT_S = 600.0  # only ends a hang; the duration of a run is not limited
GREETING_S = 10.0  # for the first answer


class BenchRefused(FluxtrueError):
    """The bench refused a command; the text is its answer."""


@dataclass
class Ran:
    """The answer to a run: simulated time, frames sent to our CAN connection so far, recorded rows."""

    now_ns: int
    frames: int
    rows: list[list[float]] = field(default_factory=list)


class Channel:
    """One connection to the bench port."""

    @classmethod
    def at(cls, address: str, option: str) -> "Channel":
        """A connection to HOST:PORT, the value of a command line's option."""
        return cls.greeted(*Address().read(address, option))

    @classmethod
    def greeted(cls, host: str, port: int) -> "Channel":
        """A connection to an address that a user has given; a port on which no bench answers is refused."""
        channel = cls(host, port, GREETING_S)
        try:
            channel.ask("hello")
        except (FluxtrueError, OSError, ValueError):
            channel.close()
            raise FluxtrueError(f"bench channel {host}:{port}: no bench answers there; wanted: the bench port of a "
                                "virtual ECU, not its CAN port, and no run of another client") from None  # fmt: skip
        channel._socket.settimeout(TIMEOUT_S)
        return channel

    def __init__(self, host: str, port: int, timeout_s: float = TIMEOUT_S) -> None:
        self._address = host, port
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
        except OSError as error:
            raise FluxtrueError(f"bench channel {host}:{port}: {error}") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._file = self._socket.makefile("r", encoding="ascii", newline="\n")

    @property
    def address(self) -> tuple[str, int]:
        """Host and port."""
        return self._address

    def another(self) -> "Channel":
        """A second connection, for requests while this one waits for the end of a run."""
        return Channel(*self._address)

    def is_fast(self) -> bool:
        """Whether time passes only in run()."""
        return self.ask("hello").split()[2] == "fast"

    def close(self) -> None:
        """Close the connection; the bench continues."""
        self._file.close()
        self._socket.close()

    def send(self, command: str) -> None:
        """A command whose answer will be read later."""
        self._socket.sendall(command.encode("ascii") + b"\n")

    def answer(self, rows: list[list[float]] | None = None) -> str:
        """The answer to the oldest command; rows of a recording go to the list."""
        for line in self._file:
            if line.startswith("row "):
                if rows is not None:
                    rows.append([float(word) for word in line.split()[1:]])
            elif line.startswith("ok"):
                return line[2:].strip()
            else:
                raise BenchRefused(f"bench: {line.strip()}")
        raise FluxtrueError("bench channel: the bench has closed the connection")

    def ask(self, command: str) -> str:
        """Send a command and return its answer."""
        self.send(command)
        return self.answer()

    def get(self, *names: str) -> list[float]:
        """Values by name."""
        return [float(word) for word in self.ask(f"get {' '.join(names)}").split()]

    def set(self, **values: float) -> None:
        """Plant parameters, and the board's with a leading board_: set(magnet_scale=0.9, board_gate_fault=1)."""
        pairs = []
        for name, value in values.items():
            full = f"board.{name[6:]}" if name.startswith("board_") else f"plant.{name}"
            pairs.append(f"{full} {float(value)!r}")
        self.ask(f"set {' '.join(pairs)}")

    def ramp(self, name: str, value: float, seconds: float) -> None:
        """Change values linearly during the next runs."""
        self.ask(f"ramp {name} {float(value)!r} {float(seconds)!r} s")

    def record(self, names: Sequence[str], periods: int = 10) -> None:
        """Choose the values that the following runs record; without names they record none."""
        self.ask(f"record {periods} {' '.join(names)}" if names else "record off")

    def run(self, milliseconds: float, port: int = 0, sent: int = 0) -> Ran:
        """Let time pass; first wait until the CAN connection with our port has been heard with so many frames."""
        rows: list[list[float]] = []
        self.send(f"run {milliseconds!r} ms {port} {sent}")
        now_ns, frames = self.answer(rows).split()
        return Ran(int(now_ns), int(frames), rows)

    def counters(self) -> dict[str, float]:
        """The counters of bus, hub and bench."""
        return {name: float(value) for name, value in (pair.split("=") for pair in self.ask("counters").split())}

    def duty_hash(self) -> str:
        """Hash of all duties and gate states since the last call."""
        return self.ask("hash")

    def reset(self, seed: int = 1) -> None:
        """Power cycle of ECU and plant."""
        self.ask(f"reset {seed}")
