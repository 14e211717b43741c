# SPDX-License-Identifier: Apache-2.0
"""Types of command-line values other than paths: a wrong value is refused before the command begins.

click's own float takes NaN and infinity, and a text is checked only where it is used, often after minutes of work.
"""

import math
from typing import Any

import click

from fluxtrue_tools.errors import FluxtrueError

PORT_MAX = 65535


def label(param: click.Parameter | None) -> str:
    """The parameter as a message names it."""
    if isinstance(param, click.Option):
        return max(param.opts, key=len)
    return param.human_readable_name if param is not None else "value"


class Finite(click.FloatRange):
    """A number in a range, or any; NaN and infinity are none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Text to a number."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            raise FluxtrueError(f"{label(param)} {value}: allowed: a finite number")
        return number

    def _describe_range(self) -> str:
        """The range for --help, where click would call no range at all "x<=None"."""
        return "" if self.min is None and self.max is None else super()._describe_range()


class Text(click.ParamType):
    """Any text but an empty one."""

    name = "text"
    wanted = "a text that is not empty"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The text, or what it stands for."""
        return self.read(str(value), label(param))

    def read(self, text: str, name: str) -> Any:
        """The same for a text from elsewhere; a message calls it `name`."""
        try:
            return self.meaning(text)
        except ValueError:
            shown = text[:60] or "''"
            raise FluxtrueError(f"{name} {shown}: allowed: {self.wanted}") from None

    def meaning(self, text: str) -> Any:
        """What the text stands for; ValueError if it does not."""
        if not text:
            raise ValueError
        return text


class Address(Text):
    """HOST:PORT."""

    wanted = "HOST:PORT"

    def meaning(self, text: str) -> tuple[str, int]:
        """Host and port."""
        host, _, port = text.rpartition(":")
        if not host or ":" in host or not (port.isascii() and port.isdigit()) or not 0 < int(port) <= PORT_MAX:
            raise ValueError
        return host, int(port)


class LossPoint(Text):
    """A loss at a speed."""

    wanted = "LOSS@SPEED, from 0 W and above 0 rpm, as in 120@3000"

    def meaning(self, text: str) -> tuple[float, float]:
        """W and rpm."""
        loss, rpm = (float(part) for part in text.split("@"))
        if not (0.0 <= loss < math.inf and 0.0 < rpm < math.inf):
            raise ValueError
        return loss, rpm


class Scheduler(Text):
    """The address of a Dask scheduler."""

    wanted = "tcp://HOST:PORT"

    def meaning(self, text: str) -> str:
        """The address as Dask takes it."""
        scheme, separator, rest = text.partition("://")
        if not separator or not scheme.isalnum():
            raise ValueError
        Address().meaning(rest)
        return text


class BusOption(Text):
    """NAME=VALUE, a further argument of can.Bus; digits are a number."""

    wanted = "NAME=VALUE"

    def meaning(self, text: str) -> tuple[str, Any]:
        """Name and value."""
        name, equals, value = text.partition("=")
        if not name.isidentifier() or not equals:
            raise ValueError
        return name, int(value) if value.isascii() and value.isdigit() else value


class BusInterface(Text):
    """An interface of python-can."""

    def meaning(self, text: str) -> str:
        """The interface's name."""
        import can

        self.wanted = ", ".join(sorted(can.VALID_INTERFACES))
        if text not in can.VALID_INTERFACES:
            raise ValueError
        return text
