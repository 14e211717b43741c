# SPDX-License-Identifier: Apache-2.0
"""Per line of the table: its runs, how many went as demanded, the worst figures, and whether its status is true."""

import math
from dataclasses import dataclass

import pandas as pd

from fluxtrue_tools.fault_campaign.fmea import KEEP, MET, OPEN, RAMP, Row


@dataclass(frozen=True)
class Score:
    """One line; NaN: in no run."""

    row: Row
    runs: int
    met: int
    detect_ms: float
    harm_ms: float
    beyond_Nm: float
    current_A: float
    vdc_V: float
    worst: str  # the run that is furthest from what is demanded, or empty
    why: str

    @property
    def is_met(self) -> bool:
        """In every run."""
        return self.met == self.runs

    @property
    def status(self) -> str:
        """The status that the table should have."""
        return MET if self.is_met else OPEN

    @property
    def is_true(self) -> bool:
        """Whether the table agrees with the results."""
        return self.row.status == self.status

    @property
    def result(self) -> str:
        """For the table: the latest times and largest values, and what is not met."""
        detect = "–" if math.isnan(self.detect_ms) else f"{self.detect_ms:.1f}"
        figures = f"fault {detect} ms, torque safe {self.harm_ms:.0f} ms, {self.current_A:.0f} A, {self.vdc_V:.0f} V"
        return figures if self.is_met else f"{figures}; {self.missed}"

    @property
    def missed(self) -> str:
        """What is not met, and where."""
        return "" if self.is_met else f"{self.runs - self.met} of {self.runs} runs not met; {self.worst}: {self.why}"


def _name(run: "pd.Series[object]") -> str:
    return f"{run['motor']}/{run['point']}/{'+' if float(str(run['sign'])) > 0 else '-'}"


def _score(row: Row, runs: pd.DataFrame) -> Score:
    missed = runs[~runs["met"]]
    worst, why = "", ""
    if len(missed):
        order = missed.assign(size=missed["beyond_Nm"] + missed["detect_ms"].isna() * 1e3)
        first = order.loc[order["size"].idxmax()]
        worst, why = _name(first), str(first["why"])
    return Score(row, len(runs), int(runs["met"].sum()), float(runs["detect_ms"].max()), float(runs["harm_ms"].max()),
                 float(runs["beyond_Nm"].max()), float(runs["current_A"].max()), float(runs["vdc_V"].max()),
                 worst, why)  # fmt: skip


def score(rows: tuple[Row, ...], table: pd.DataFrame) -> list[Score]:
    """In the table's order; a line that speaks of no operating point is left out."""
    by_row = dict(tuple(table.groupby("row")))
    return [_score(row, by_row[row.id]) for row in rows if row.id in by_row]


@dataclass(frozen=True)
class Summary:
    """The campaign in numbers."""

    kinds: int
    lines: int
    runs: int
    runs_met: int
    lines_met: int
    false_trips: int
    untrue: tuple[str, ...]

    @property
    def share(self) -> float:
        """The share of the runs in percent."""
        return 100.0 * self.runs_met / self.runs if self.runs else math.nan


def summarise(scores: list[Score], table: pd.DataFrame) -> Summary:
    """Everything at a glance."""
    keeps = {s.row.id for s in scores if s.row.reaction in (KEEP, RAMP)}
    false = table[table["row"].isin(keeps) & (table["first_fault"] != "")]
    return Summary(
        len({(s.row.element, s.row.failure) for s in scores}), len(scores), len(table), int(table["met"].sum()),
        sum(s.is_met for s in scores), len(false), tuple(s.row.id for s in scores if not s.is_true),
    )  # fmt: skip
