# SPDX-License-Identifier: Apache-2.0
"""Per line of the table: its runs, how many meet the requirement, the worst figures, and whether its status is true."""

import math
from dataclasses import dataclass

import pandas as pd

from fluxtrue_tools.fault_campaign.fmea import KEEP, MET, NO_EFFECT, OPEN, PHYSICS, RAMP, Row


@dataclass(frozen=True)
class Score:
    """One line; NaN: in no run."""

    row: Row
    runs: int
    met: int  # by_physics included
    by_physics: int  # beyond a limit, but as good as physics allows
    idle: int  # without effect: neither as demanded nor open
    detect_ms: float
    harm_ms: float
    beyond_Nm: float
    current_A: float
    vdc_V: float
    worst: str  # the run that is furthest from what is demanded, of those not met if there are any, or empty
    why: str
    is_host: bool = True  # false: the table's status is that of other runs, at more points

    @property
    def is_met(self) -> bool:
        """In every run that has an effect, of which there must be one."""
        return self.met > 0 and self.met + self.idle == self.runs

    @property
    def status(self) -> str:
        """The status that the table should have."""
        return OPEN if not self.is_met else PHYSICS if self.by_physics else MET

    @property
    def is_true(self) -> bool:
        """Whether the table agrees with the results; other runs may be better than the table's, never worse.

        No status is true of a line that never has an effect: it tests nothing. The few points of the image do not
        decide that."""
        if self.idle == self.runs:
            return not self.is_host
        if not self.is_host:
            return self.row.status == OPEN or self.status != OPEN
        return self.row.status == self.status

    @property
    def physics(self) -> str:
        """How many runs are met only as well as physics allows, and the one furthest beyond its limits."""
        where = f"; {self.worst}: {self.why}" if self.is_met else ""
        return f"{self.by_physics} of {self.runs} runs as good as physics allows{where}" if self.by_physics else ""

    @property
    def result(self) -> str:
        """For the table: the latest times and largest values, and what is not met."""
        detect = "–" if math.isnan(self.detect_ms) else f"{self.detect_ms:.1f}"
        figures = f"fault {detect} ms, torque safe {self.harm_ms:.0f} ms, {self.current_A:.0f} A, {self.vdc_V:.0f} V"
        idle = f"{self.idle} of {self.runs} runs without effect" if self.idle else ""
        return "; ".join(filter(None, (figures, idle, self.physics, self.missed)))

    @property
    def missed(self) -> str:
        """What is not met, and where."""
        if self.is_met:
            return ""
        if self.idle == self.runs:
            return "WITHOUT EFFECT: neither a fault nor the shaft torque shows the change in any run"
        return f"{self.runs - self.met - self.idle} of {self.runs} runs not met; {self.worst}: {self.why}"


def _name(run: "pd.Series[object]") -> str:
    return f"{run['motor']}/{run['point']}/{'+' if float(str(run['sign'])) > 0 else '-'}"


def _score(row: Row, runs: pd.DataFrame, is_host: bool) -> Score:
    by_physics, missed = runs[runs["verdict"] == PHYSICS], runs[runs["verdict"] == OPEN]
    worst, why = "", ""
    if len(told := missed if len(missed) else by_physics):
        order = told.assign(size=told["beyond_Nm"] + told["detect_ms"].isna() * 1e3)
        first = order.loc[order["size"].idxmax()]
        worst, why = _name(first), str(first["why"])
    idle = int((runs["verdict"] == NO_EFFECT).sum())
    return Score(row, len(runs), int(runs["met"].sum()), len(by_physics), idle, float(runs["detect_ms"].max()),
                 float(runs["harm_ms"].max()), float(runs["beyond_Nm"].max()), float(runs["current_A"].max()),
                 float(runs["vdc_V"].max()), worst, why, is_host)  # fmt: skip


def score(rows: tuple[Row, ...], table: pd.DataFrame, is_host: bool = True) -> list[Score]:
    """In the table's order; a line that speaks of no operating point is left out."""
    by_row = dict(tuple(table.groupby("row")))
    return [_score(row, by_row[row.id], is_host) for row in rows if row.id in by_row]


@dataclass(frozen=True)
class Summary:
    """The campaign in numbers."""

    kinds: int
    lines: int
    runs: int
    runs_met: int  # runs_by_physics included
    runs_by_physics: int
    runs_by_effect: int  # of these, whose times count from the first effect of the fault
    runs_idle: int  # without effect: not counted as demanded
    lines_met: int
    lines_by_physics: int
    false_trips: int
    untrue: tuple[str, ...]

    @property
    def share(self) -> float:
        """The share of the runs in percent; those without effect are not counted."""
        return 100.0 * self.runs_met / (self.runs - self.runs_idle) if self.runs > self.runs_idle else math.nan

    @property
    def lines_open(self) -> int:
        """With a run that is not met."""
        return self.lines - self.lines_met - self.lines_by_physics


def summarise(scores: list[Score], table: pd.DataFrame) -> Summary:
    """Everything at a glance."""
    keeps = {s.row.id for s in scores if s.row.reaction in (KEEP, RAMP)}
    false = table[table["row"].isin(keeps) & (table["first_fault"] != "")]
    return Summary(
        len({(s.row.element, s.row.failure) for s in scores}), len(scores), len(table), int(table["met"].sum()),
        sum(s.by_physics for s in scores), int(((table["verdict"] == PHYSICS) & table["effect_ms"].notna()).sum()),
        sum(s.idle for s in scores),
        sum(s.status == MET for s in scores),
        sum(s.status == PHYSICS for s in scores), len(false), tuple(s.row.id for s in scores if not s.is_true),
    )  # fmt: skip
