# SPDX-License-Identifier: Apache-2.0
"""The limits of a port, in its budget.toml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from fluxtrue_tools import strict
from fluxtrue_tools.strict import Number, Strict

Count = Annotated[int, Field(ge=1, lt=2**32)]
Share = Annotated[Number, Field(gt=0, le=1)]
Hertz = Annotated[Number, Field(ge=1e3, le=1e10)]


class Pwm(Strict):
    """The timer."""

    timer_Hz: Hertz
    period_ticks_max: Count
    dead_time_ticks_max: Count
    dead_time_share_max: Share


class Budget(Strict):
    """What image and timer may take; the lists for the measurement of the image are read there."""

    core_Hz: Hertz
    flash_bytes: Count
    ram_bytes: Count
    ram_code_bytes: int = Field(default=0, ge=0)
    busy_share_max: Share
    pwm: Pwm
    level: list[Any] = Field(default_factory=list)
    pointer: list[Any] = Field(default_factory=list)


def read(path: Path) -> Budget:
    """The limits."""
    return strict.parse(Budget, strict.read_text(path), str(path))
