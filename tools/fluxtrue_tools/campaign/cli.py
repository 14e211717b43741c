# SPDX-License-Identifier: Apache-2.0
"""fluxtrue campaign: many plants, one table."""

import hashlib
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fluxtrue_tools.errors import FluxtrueError

if TYPE_CHECKING:
    from fluxtrue_tools.campaign.spec import Campaign
    from fluxtrue_tools.sim.build import MotorFolder

EXIT_BOUND_MISSED = 1
_FOLDER = click.Path(file_okay=False, path_type=Path)


def task(name: str, folder: str, text: str, case: int) -> list[dict[str, Any]]:
    """One case in a worker: everything it needs comes as text."""
    from fluxtrue_tools.campaign.case import run_case
    from fluxtrue_tools.campaign.machine import machine_of
    from fluxtrue_tools.campaign.spec import Campaign

    return run_case(Campaign.model_validate_json(text), machine_of(name, folder, text), case)


def _manifest(campaign: "Campaign", folder: "MotorFolder") -> dict[str, Any]:
    library = hashlib.sha256(folder.library.read_bytes() + folder.data.read_bytes()).hexdigest()
    return {"campaign.toml": campaign.digest(), "firmware or plant (libfluxtrue_sim.so, motor.json)": library}


def _run(campaign: "Campaign", folder: "MotorFolder", out: Path, cases: range, fresh: bool, scheduler: str | None,
         workers: int | None) -> Any:  # fmt: skip
    from tqdm import tqdm

    from fluxtrue_tools.campaign import schedule
    from fluxtrue_tools.campaign.store import Store

    store = Store(out)
    store.open(_manifest(campaign, folder), fresh)
    job = partial(task, folder.name, str(folder.folder), campaign.model_dump_json())
    todo = store.missing(cases)
    results = schedule.dask(job, todo, scheduler) if scheduler else schedule.local(job, todo, workers)
    bar = tqdm(total=len(cases), initial=len(cases) - len(todo), unit="case", disable=not sys.stderr.isatty())
    with bar:
        for case, rows in results:
            store.save(case, rows)
            bar.update()
    return store.load(cases)


@click.command()
@click.argument("campaign", type=click.Path(dir_okay=False, path_type=Path))
@click.option("--out", type=_FOLDER, help="Folder for the results.  [default: build/campaign/<name>]")
@click.option("--cases", type=click.IntRange(min=1), help="Only the first so many cases; a later run goes on.")
@click.option("--fresh", is_flag=True, help="Throw away the results that are there.")
@click.option("--check/--no-check", default=True, help="Exit with 1 when a bound is missed.  [default: check]")
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: a core each]")
@click.option("--scheduler", metavar="tcp://HOST:PORT", help="Run on this Dask cluster instead.")
@click.option("--build-dir", type=_FOLDER, help="Take the libraries from this build folder as they are.")
def campaign(campaign: Path, out: Path | None, cases: int | None, fresh: bool, check: bool, workers: int | None,
             scheduler: str | None, build_dir: Path | None) -> int:  # fmt: skip
    """Run a CAMPAIGN (TOML): random plants, every controller on each, scored and checked."""
    from fluxtrue_tools.campaign import spec, terminal
    from fluxtrue_tools.campaign.case import check_names
    from fluxtrue_tools.campaign.machine import make_machine
    from fluxtrue_tools.campaign.score import score
    from fluxtrue_tools.sim.build import ROOT, prepare

    read = spec.read(campaign)
    if cases is not None and cases > read.cases:
        raise FluxtrueError(f"--cases {cases}, allowed: up to the campaign's {read.cases}")
    folder = prepare(read.motor, build_dir, campaign.parent)
    check_names(read, make_machine(folder, read, str(campaign)), str(campaign))
    out = out or ROOT / "build" / "campaign" / campaign.stem
    table = _run(read, folder, out, range(cases or read.cases), fresh, scheduler, workers)
    scores = score(read, table)
    promised = terminal.promises(read, scores)
    click.echo(terminal.figures_table(read, scores) + "\n\n" + terminal.trouble_table(read, scores))
    if promised:
        click.echo("\n" + terminal.bounds_table(promised))
    return EXIT_BOUND_MISSED if check and not all(bound.met for _, bound in promised) else 0
