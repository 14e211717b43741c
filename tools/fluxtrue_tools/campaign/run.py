# SPDX-License-Identifier: Apache-2.0
"""A whole campaign: missing cases are run, then all are scored, reported and checked. A single case can be run, too."""

import hashlib
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from fluxtrue_tools.campaign import figures, report, schedule, terminal
from fluxtrue_tools.campaign.case import check_names, run_case
from fluxtrue_tools.campaign.check import check
from fluxtrue_tools.campaign.machine import machine_of, make_machine
from fluxtrue_tools.campaign.score import score
from fluxtrue_tools.campaign.spec import Campaign
from fluxtrue_tools.campaign.store import Store
from fluxtrue_tools.campaign.tour import Trace
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import Outputs, write_text
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.output import json_text


@dataclass(frozen=True)
class Job:
    """What to run and where its results go."""

    campaign: Campaign
    folder: MotorFolder
    out: Path
    cases: range
    where: str  # for messages
    command: str  # that reproduces {case}
    plot: Path | None = None  # the overview


def task(name: str, folder: str, text: str, case: int) -> list[dict[str, Any]]:
    """One case in a worker: everything it needs comes as text."""
    campaign = Campaign.model_validate_json(text)
    return run_case(campaign, machine_of(name, folder, text), case)


def _manifest(job: Job) -> dict[str, str]:
    built = job.folder.library.read_bytes() + job.folder.data.read_bytes()
    return {"campaign file": job.campaign.digest(), "firmware or plant": hashlib.sha256(built).hexdigest()}


def _simulate(job: Job, store: Store, scheduler: str | None, workers: int | None) -> None:
    work = partial(task, job.folder.name, str(job.folder.folder), job.campaign.model_dump_json())
    schedule.missing(work, store, job.cases, scheduler, workers)


def _draw(sheet: Any, plot: Path) -> None:
    import matplotlib.pyplot as plt

    try:
        sheet.savefig(plot, dpi=120)
    finally:
        plt.close(sheet)


def whole(job: Job, files: Outputs, *, fresh: bool, scheduler: str | None, workers: int | None) -> tuple[str, bool]:
    """The text for the terminal, and whether every bound is met."""
    machine = make_machine(job.folder, job.campaign, job.where)
    check(job.campaign, machine, job.where)
    check_names(job.campaign, machine, job.where)
    store = Store(job.out)
    with store.opened(_manifest(job), fresh):
        _simulate(job, store, scheduler, workers)
        table = store.load(job.cases)
    scores = score(job.campaign, table)
    promised = terminal.promises(job.campaign, scores)
    data = report.summary(job.campaign, table, scores, promised)
    write_text(job.out / "summary.json", json_text(data))
    page = report.html(job.campaign, table, scores, promised, machine.nominal, job.command)
    write_text(job.out / "report.html", page)
    if job.plot is not None:
        _draw(figures.headline(job.campaign, table), files.scratch(job.plot))
    parts = [terminal.figures_table(job.campaign, scores), terminal.trouble_table(job.campaign, scores)]
    parts += [terminal.bounds_table(promised)] if promised else []
    parts.append(str(job.out / "report.html"))
    return "\n\n".join(parts), all(bound.met for _, bound in promised)


def one_case(campaign: Campaign, folder: MotorFolder, case: int, files: Outputs, plot: Path | None, where: str) -> str:
    """Its plant and its windows as text, its time series as a picture."""
    machine = make_machine(folder, campaign, where)
    check(campaign, machine, where)
    check_names(campaign, machine, where)
    traces: dict[str, Trace] = {}
    table = pd.DataFrame(run_case(campaign, machine, case, traces.__setitem__))
    if table.empty:
        raise FluxtrueError(f"{where}: case {case} has no window: its plant reaches windows.torque_min_Nm = "
                            f"{campaign.windows.torque_min_Nm:g} N·m at none of its speeds")  # fmt: skip
    if plot is not None:
        _draw(figures.case_figure(campaign, traces, f"{Path(where).stem}, case {case}"), files.scratch(plot))
    return terminal.case_table(table)
