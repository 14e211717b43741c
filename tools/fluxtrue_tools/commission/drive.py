# SPDX-License-Identifier: Apache-2.0
"""The interface of a commissioning to a drive: names to set and get, and signals recorded in each PWM period.

There is one implementation: software in the loop, where the firmware runs as a library in this process beside a
simulated machine. It records by reading the names after each period. On a bus, a capture buffer in the firmware takes
its place.
"""

import math
from collections.abc import Sequence
from typing import Protocol

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop

HIDDEN = ("plant.", "truth.")  # what belongs to the simulated machine, not to the drive


class Capture(Protocol):
    """A drive that can be commanded and recorded."""

    @property
    def period_s(self) -> float:
        """Of the PWM."""

    def set(self, name: str, value: float) -> None:
        """A value of the drive."""

    def get(self, name: str) -> float:
        """The value now."""

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """Let the drive run; one row for each period, a column for each name."""


class SoftwareInTheLoop:
    """The firmware as a library, on a simulated machine of which nothing but the drive's names can be read."""

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self.period_s = loop.period_s

    @staticmethod
    def _allowed(name: str) -> str:
        if name.startswith(HIDDEN):
            raise FluxtrueError(f"{name}: belongs to the simulated machine, which a commissioning cannot read")
        return name

    def set(self, name: str, value: float) -> None:
        """A value of the drive."""
        self._loop.set(self._allowed(name), value)

    def get(self, name: str) -> float:
        """The value now."""
        value = self._loop.get(self._allowed(name))
        if math.isnan(value):
            raise FluxtrueError(f"{name}: this firmware has no such value")
        return value

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """Every period, by reading the names after it."""
        self._loop.record([self._allowed(name) for name in names])
        return self._loop.run(periods)
