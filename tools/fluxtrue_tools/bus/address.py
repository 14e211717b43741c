# SPDX-License-Identifier: Apache-2.0
"""The address of a bus: the arguments of python-can, taken from a command line."""

import logging
import socket
from dataclasses import dataclass
from typing import Any, Final

import can

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.kinds import BusOption

GREETING_S: Final = 10.0  # a socketcand server greets at once
GREETING: Final = b"< hi >"

# python-can logs what it also raises, with a traceback, and each of many thousand attempts to reach a closed port.
logging.getLogger("can.interfaces.socketcand").setLevel(logging.CRITICAL)


def parse_option(text: str) -> tuple[str, Any]:
    """NAME=VALUE of --can-option; digits are a number."""
    name, value = BusOption().read(text, "--can-option")
    return name, value


@dataclass(frozen=True)
class BusAddress:
    """Arguments of can.Bus."""

    interface: str
    channel: str
    options: dict[str, Any]

    def connect(self) -> can.BusABC:
        """A new connection."""
        if self.interface == "socketcand":
            self._greeted()
        try:
            return can.Bus(interface=self.interface, channel=self.channel, receive_own_messages=False,
                           **self.options)  # fmt: skip
        except (
            Exception
        ) as error:  # a driver, or its Python package, can raise any exception, even NameError or TypeError
            raise FluxtrueError(f"--can-interface {self.interface}, --can-channel {self.channel}: {error}") from error

    def _greeted(self) -> None:
        """Refuse a port on which no socketcand server answers.

        python-can tries a closed port for ten seconds, and waits without end for a greeting of another server, such as
        the bench channel.
        """
        missing = [name for name in ("host", "port") if name not in self.options]
        if missing:
            raise FluxtrueError(f"--can-interface socketcand: missing: --can-option {missing[0]}=…")
        host, port = self.options["host"], self.options["port"]
        where = f"--can-interface socketcand, host={host}, port={port}"
        try:
            with socket.create_connection((str(host), port), GREETING_S) as connection:
                said = b""
                while len(said) < len(GREETING) and (part := connection.recv(len(GREETING) - len(said))):
                    said += part
        except TimeoutError:
            said = b""
        except (OSError, OverflowError, UnicodeError) as error:
            why = getattr(error, "strerror", None) or error
            raise FluxtrueError(f"{where}: {why}; wanted: the CAN port of a running socketcand server") from None
        if said != GREETING:
            raise FluxtrueError(f"{where}: no socketcand server answers there; wanted: its CAN port, not the bench "
                                "channel's")  # fmt: skip
