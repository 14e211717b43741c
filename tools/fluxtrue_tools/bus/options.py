# SPDX-License-Identifier: Apache-2.0
"""The options of the commands that take a bus: python-can's interface, channel and further arguments."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

from fluxtrue_tools import kinds

Command = TypeVar("Command", bound=Callable[..., Any])

OPTIONS = (
    click.option(
        "--can-interface",
        type=kinds.BusInterface(),
        help="python-can interface of a bench; without it a virtual ECU is started.",
    ),
    click.option("--can-channel", type=kinds.Text(), default="can0", show_default=True),
    click.option(
        "--can-option", type=kinds.BusOption(), multiple=True, metavar="NAME=VALUE", help="Further argument of can.Bus."
    ),
)


def can_bus(command: Command) -> Command:
    """Adds --can-interface, --can-channel and --can-option."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command
