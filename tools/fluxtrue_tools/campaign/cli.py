# SPDX-License-Identifier: Apache-2.0
"""fluxtrue campaign: random plants, every controller on each."""

import shlex
from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError

EXIT_BOUND_MISSED = 1
_FOLDER = paths.OutputFolder("campaign.json", "results.parquet", "summary.json", "report.html")


@click.command(cls=paths.Command)
@click.argument("campaign", type=paths.InputFile())
@click.option("--out", type=_FOLDER, help="Folder for the results.  [default: build/campaign/<name>]")
@click.option("--cases", type=click.IntRange(min=1), help="Only the first so many cases; a later run goes on.")
@click.option("--fresh", is_flag=True, help="Throw away the results that are there.")
@click.option("--check/--no-check", default=True, help="Exit with 1 when a bound is missed.  [default: check]")
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: a core each]")
@click.option(
    "--scheduler", type=kinds.Scheduler(), metavar="tcp://HOST:PORT", help="Run on this Dask cluster instead."
)
@click.option("--case", type=click.IntRange(min=0), help="Run one case and show its windows; nothing is stored.")
@click.option("--plot", type=paths.OutputFile(*paths.PICTURES),
              help="The errors at a glance, or with --case its time series: PNG, SVG or PDF.")  # fmt: skip
@click.option("--build-dir", type=paths.InputFolder(), help="Take the libraries from this build folder as they are.")
def campaign(campaign: Path, out: Path | None, cases: int | None, fresh: bool, check: bool, workers: int | None,
             scheduler: str | None, case: int | None, plot: Path | None, build_dir: Path | None) -> int:  # fmt: skip
    """Run a CAMPAIGN (TOML): random plants, every controller on each, scored and checked."""
    from fluxtrue_tools.campaign import run, spec
    from fluxtrue_tools.sim.build import ROOT, prepare, sources

    read, where = spec.read(campaign), f"{campaign}: motor"
    _check_options(read.cases, cases, case, scheduler)
    files = paths.outputs()
    files.reads(*sources(read.motor, campaign.parent, where))
    folder = prepare(read.motor, build_dir, campaign.parent, where)
    files.reads(folder.library, folder.data)
    if case is not None:
        with files:
            text = run.one_case(read, folder, case, files, plot, str(campaign))
        click.echo(text)
        return 0
    if out is None:
        out = ROOT / "build" / "campaign" / campaign.stem
        files.folder("--out", out, _FOLDER.names)
    job = run.Job(
        read,
        folder,
        out,
        range(cases or read.cases),
        where=str(campaign),
        command=f"tools/fluxtrue campaign {shlex.quote(str(campaign))} --case {{case}}",
        plot=plot,
    )
    with files:
        text, met = run.whole(job, files, fresh=fresh, scheduler=scheduler, workers=workers)
    click.echo(text)
    return EXIT_BOUND_MISSED if check and not met else 0


def _check_options(available: int, cases: int | None, case: int | None, scheduler: str | None) -> None:
    if cases is not None and cases > available:
        raise FluxtrueError(f"--cases {cases}, allowed: up to the campaign's {available}")
    if case is not None and case >= available:
        raise FluxtrueError(f"--case {case}, allowed: 0 to {available - 1}")
    if case is not None:
        paths.refuse_given("with --case", "out", "cases", "fresh", "check", "workers", "scheduler")
    paths.refuse_given("with --scheduler", *(["workers"] if scheduler is not None else []))
