# SPDX-License-Identifier: Apache-2.0
"""The address of a bus: the arguments of python-can, taken from a command line."""

from dataclasses import dataclass
from typing import Any

import can

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.kinds import BusOption


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
        try:
            return can.Bus(interface=self.interface, channel=self.channel, receive_own_messages=False,
                           **self.options)  # fmt: skip
        except (
            Exception
        ) as error:  # a driver, or its Python package, can raise any exception, even NameError or TypeError
            raise FluxtrueError(f"--can-interface {self.interface}, --can-channel {self.channel}: {error}") from error
