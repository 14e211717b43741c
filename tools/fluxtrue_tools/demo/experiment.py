# SPDX-License-Identifier: Apache-2.0
"""The parts of every experiment: from scenarios to figures of merit and bounds."""

from dataclasses import dataclass, field
from typing import Any

from fluxtrue_tools.sim.motor import Motor, load
from fluxtrue_tools.sim.run import Recording, simulate
from fluxtrue_tools.sim.scenario import Scenario


@dataclass(frozen=True)
class Bound:
    """One bound and its result."""

    what: str
    value: float
    limit: float
    unit: str
    at_least: bool = False

    @property
    def met(self) -> bool:
        """NaN meets no bound."""
        return self.value >= self.limit if self.at_least else abs(self.value) <= self.limit

    def text(self) -> str:
        """Value, relation, limit."""
        relation = "≥" if self.at_least else "≤"
        return f"{self.what}: {self.value:.4g} {self.unit}, allowed {relation} {self.limit:g} {self.unit}"


@dataclass
class Result:
    """An experiment's entry in summary.json, its bounds, and recordings for the figures."""

    summary: dict[str, Any]
    bounds: list[Bound]
    runs: dict[str, Recording] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The id, and the gain set where there is one."""
        gains = self.summary.get("gain_set")
        return f"{self.summary['id']} {gains}" if gains else str(self.summary["id"])

    @property
    def met(self) -> bool:
        """All bounds met."""
        return all(bound.met for bound in self.bounds)


@dataclass(frozen=True)
class Bench:
    """The machines of the demonstration."""

    paper: Motor
    hsm1: Motor


def bench() -> Bench:
    """Both machines, built if need be."""
    return Bench(load("paper"), load("hsm1"))


def run(motor: Motor, scenario: dict[str, Any]) -> Recording:
    """A scenario as it would stand in a file."""
    return simulate(Scenario.model_validate({"motor": motor.name} | scenario), motor)


def number(value: float | None, digits: int = 5) -> float:
    """Figures for summary.json; a missing value is NaN and meets no bound."""
    return float("nan") if value is None else float(f"{value:.{digits}g}")
