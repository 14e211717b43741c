# SPDX-License-Identifier: Apache-2.0
"""The options of the commands that take a bus: python-can's interface, channel and further arguments."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

from fluxtrue_tools import kinds

Command = TypeVar("Command", bound=Callable[..., Any])


def can_bus_or(otherwise: str) -> Callable[[Command], Command]:
    """Adds --can-interface, --can-channel and --can-option; without the first one something else is done."""
    options = (
        click.option(
            "--can-interface",
            type=kinds.BusInterface(),
            help=f"python-can interface of a bench; without it {otherwise}.",
        ),
        click.option("--can-channel", type=kinds.Text(), default="can0", show_default=True),
        click.option(
            "--can-option",
            type=kinds.BusOption(),
            multiple=True,
            metavar="NAME=VALUE",
            help="Further argument of can.Bus.",
        ),
    )

    def added(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return added


def can_bus(command: Command) -> Command:
    """The same for a command that starts a virtual ECU otherwise."""
    return can_bus_or("a virtual ECU is started")(command)
