# SPDX-License-Identifier: Apache-2.0
"""A whole campaign: missing cases are run, then all are scored and reported. Also the runs of a single line."""

import hashlib
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd

from fluxtrue_tools.campaign import schedule
from fluxtrue_tools.campaign.store import Store
from fluxtrue_tools.emulate import library as emulation
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign import fmea, report
from fluxtrue_tools.fault_campaign.fmea import Row
from fluxtrue_tools.fault_campaign.plan import Plan, machine_of, points_of, run_case, run_one
from fluxtrue_tools.fault_campaign.run_point import check_names
from fluxtrue_tools.fault_campaign.score import score, summarise
from fluxtrue_tools.outputs import write_text
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.output import json_text


@dataclass(frozen=True)
class Record:
    """The table of faults into which the results are written, with all its lines."""

    path: Path
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Job:
    """What to run and where its results go."""

    plan: Plan
    out: Path
    command: str
    record: Record | None = None


def _manifest(plan: Plan) -> dict[str, str]:
    built = b"".join(MotorFolder(name, Path(folder)).library.read_bytes() for name, folder in plan.folders)
    for (_, folder), files in zip(plan.folders, plan.images, strict=False):  # no images: nothing is emulated
        built += b"".join(path.read_bytes() for path in (Path(folder) / emulation.NAME, *map(Path, files)))
    return {"campaign file or table of faults": plan.digest(), "firmware or plant": hashlib.sha256(built).hexdigest()}


def whole(job: Job, *, fresh: bool, scheduler: str | None, workers: int | None) -> tuple[str, bool]:
    """The text for the terminal, and whether the table's status is true in every line."""
    plan, store = job.plan, Store(job.out)
    for index, (name, folder) in enumerate(plan.folders):
        check_names(machine_of(name, folder).motor, plan.rows, plan.loop_of(index))
    with store.opened(_manifest(plan), fresh):
        schedule.missing(partial(run_case, plan), store, plan.cases, scheduler, workers)
        table = store.load(plan.cases)
    scores = score(plan.rows, table, not plan.campaign.is_emulated)
    summary = summarise(scores, table)
    write_text(job.out / "summary.json", json_text(report.summary_data(plan, scores, summary)))
    write_text(job.out / "report.html", report.html(plan, scores, summary, job.command))
    if job.record is not None:
        found = {s.row.id: fmea.recorded(s.row, s.status, s.worst, s.result) for s in scores}
        write_text(job.record.path, fmea.write([found.get(row.id, row) for row in job.record.rows]))
    return f"{report.terminal(scores, summary)}\n\n{job.out / 'report.html'}", not summary.untrue


def one_line(plan: Plan, line: str, only: str | None) -> str:
    """Every run of a line, or the run with this name; nothing is stored."""
    row = next((row for row in plan.rows if row.id == line), None)
    if row is None:
        raise FluxtrueError(f"--line {line}: no such line, allowed: {', '.join(row.id for row in plan.rows)}")
    runs = [(index, point) for index in range(len(plan.folders)) for point in points_of(plan, index)
            if row.holds_at(point) and only in (None, point.name)]  # fmt: skip
    if not runs:
        raise FluxtrueError(f"--run {only}: the line does not speak of it, allowed: motor/point/sign, as hsm1/3/+")
    table = pd.DataFrame([run_one(plan, row, index, point) for index, point in runs])
    return report.runs_table(table)
