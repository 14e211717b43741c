# SPDX-License-Identifier: Apache-2.0
"""campaign.toml of the faults: machines, operating points, and the table of the faults."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from fluxtrue_tools import strict
from fluxtrue_tools.sim.scenario import Positive
from fluxtrue_tools.strict import Number, Strict

Share = Annotated[Number, Field(ge=-1, le=1)]


def _tuples(value: Any) -> Any:
    """Lists of TOML, at any depth."""
    return tuple(_tuples(each) for each in value) if isinstance(value, list) else value


class Bounded(Strict):
    """A machine and what its inverter and its magnets withstand."""

    motor: Annotated[str, Field(min_length=1)]
    current_A: Positive
    vdc_V: Positive


class Faults(Strict):
    """One campaign; a point is a share of the largest speed and a share of the torque that can be reached there."""

    fmea: Annotated[str, Field(min_length=1)]
    machine: Annotated[tuple[Bounded, ...], BeforeValidator(_tuples), Field(min_length=1, max_length=8)]
    points: Annotated[
        tuple[tuple[Share, Share], ...], BeforeValidator(_tuples), Field(min_length=1, max_length=200)
    ]  # fmt: skip
    signs: Annotated[tuple[Number, ...], BeforeValidator(_tuples), Field(min_length=1, max_length=2)] = (1.0, -1.0)
    slice_points: Annotated[int, Field(ge=1, le=200)] = 3
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 1
    settle_ms: Annotated[int, Field(ge=10, le=10000)] = 100
    watch_ms: Annotated[int, Field(ge=10, le=10000)] = 250
    plant: dict[str, strict.Flag] = Field(default_factory=dict)
    processor: Literal["host", "emulated"] = "host"

    @property
    def is_emulated(self) -> bool:
        """The flashed image runs on the emulated processor, not the firmware on this computer."""
        return self.processor == "emulated"


def read(path: Path) -> Faults:
    """A campaign file."""
    return strict.parse(Faults, strict.read_text(path), str(path))
