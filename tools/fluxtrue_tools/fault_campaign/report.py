# SPDX-License-Identifier: Apache-2.0
"""The campaign as one self-contained HTML page, as text for the terminal, and as summary.json."""

import math
from dataclasses import asdict
from importlib.resources import files
from typing import Any, Final

import jinja2
import pandas as pd

from fluxtrue_tools.campaign.terminal import columns
from fluxtrue_tools.fault_campaign.fmea import MET, NO_EFFECT, OPEN, PHYSICS
from fluxtrue_tools.fault_campaign.oracle import MARGIN
from fluxtrue_tools.fault_campaign.plan import Plan
from fluxtrue_tools.fault_campaign.score import Score, Summary

PLAIN: Final = {MET: "met", PHYSICS: "as good as physics allows", OPEN: "not met",
               NO_EFFECT: "without effect"}  # fmt: skip


def _text(value: float, digits: int = 1) -> str:
    return "–" if value != value else f"{value:.{digits}f}"


def terminal(scores: list[Score], summary: Summary) -> str:
    """What is not met, and the sums."""
    cells: list[tuple[str, ...]] = [("line", "runs", "met", "of these by physics", "fault, ms", "torque safe, ms", "A",
                                     "V", "status", "")]  # fmt: skip
    for s in scores:
        if s.status != MET or not s.is_true:
            said = s.missed or s.physics
            cells.append((s.row.id, str(s.runs), str(s.met), str(s.by_physics), _text(s.detect_ms), _text(s.harm_ms, 0),
                          _text(s.current_A, 0), _text(s.vdc_V, 0), s.row.status,
                          said if s.is_true else f"status {s.row.status} is NOT TRUE. {said}"))  # fmt: skip
    sums = (f"{summary.kinds} kinds of fault, {summary.lines} lines, {summary.runs} runs: {summary.runs_met} "
            f"({summary.share:.2f} %) as demanded, of these {summary.runs_by_physics} beyond a limit and as good as "
            f"physics allows (in {summary.runs_by_effect} the fault had no effect at first); "
            f"{summary.runs_idle} without effect, not counted; "
            f"{summary.lines_met} lines met, {summary.lines_by_physics} met with such runs, "
            f"{summary.lines_open} open, {summary.false_trips} false trips")  # fmt: skip
    return (columns(cells) + "\n\n" if len(cells) > 1 else "") + sums


def runs_table(table: pd.DataFrame) -> str:
    """Every run of one line."""
    cells: list[tuple[str, ...]] = [("run", "rpm", "N·m", "first fault", "ms", "torque safe, ms", "beyond, N·m", "A",
                                     "V", "")]  # fmt: skip
    for _, run in table.iterrows():
        name = f"{run['motor']}/{run['point']}/{'+' if run['sign'] > 0 else '-'}"
        said = "; ".join(filter(None, (PLAIN[run["verdict"]], run["why"])))
        cells.append((name, f"{run['speed_rpm']:.0f}", f"{run['torque_Nm']:.1f}", run["first_fault"],
                      _text(run["detect_ms"]), _text(run["harm_ms"], 0), _text(run["beyond_Nm"]),
                      _text(run["current_A"], 0), _text(run["vdc_V"], 0), said))  # fmt: skip
    return columns(cells)


def summary_data(plan: Plan, scores: list[Score], summary: Summary) -> dict[str, Any]:
    """The summary for scripts; null where there is no figure."""

    def plain(value: float) -> float | None:
        return None if value != value else round(value, 6)

    lines = [
        {"id": s.row.id, "status": s.row.status, "is_met": s.is_met, "is_true": s.is_true, "runs": s.runs,
         "met": s.met, "by_physics": s.by_physics, "idle": s.idle, "found": s.status,
         "detect_ms": plain(s.detect_ms), "harm_ms": plain(s.harm_ms), "beyond_Nm": plain(s.beyond_Nm),
         "current_A": plain(s.current_A), "vdc_V": plain(s.vdc_V), "worst": s.worst, "why": s.why}
        for s in scores
    ]  # fmt: skip
    return asdict(summary) | {"digest": plan.digest(), "slice": plan.is_slice, "scores": lines}


def html(plan: Plan, scores: list[Score], summary: Summary, command: str) -> str:
    """The page."""
    template = files("fluxtrue_tools.fault_campaign").joinpath("report.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    environment.globals["infinity"] = math.inf
    environment.filters["figure"] = _text
    elements: dict[str, list[Score]] = {}
    for s in scores:
        elements.setdefault(s.row.element, []).append(s)
    return environment.from_string(template).render(
        plan=plan,
        summary=summary,
        elements=elements,
        opened=[s for s in scores if not s.is_met],
        physics=[s for s in scores if s.by_physics],
        margin=100.0 * (MARGIN - 1.0),
        command=command,
    )
