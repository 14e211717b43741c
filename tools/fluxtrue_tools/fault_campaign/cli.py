# SPDX-License-Identifier: Apache-2.0
"""fluxtrue faults: every fault of a table at every operating point."""

import shlex
from fnmatch import fnmatchcase
from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError

EXIT_NOT_TRUE = 1
_FOLDER = paths.OutputFolder("campaign.json", "results.parquet", "summary.json", "report.html")


@click.command(cls=paths.Command)
@click.argument("campaign", type=paths.InputFile())
@click.option("--out", type=_FOLDER, help="Folder for the results.  [default: build/faults/<name>]")
@click.option("--fresh", is_flag=True, help="Throw away the results that are there.")
@click.option("--slice", "is_slice", is_flag=True, help="A few points of each line, and where open lines are not met.")
@click.option("--record", is_flag=True, help="Write status, witness and result of each line into the table.")
@click.option(
    "--lines",
    metavar="PATTERNS",
    default="*",
    help="Only lines whose id fits one of them, for example 'angle-*,healthy'.",
)
@click.option("--workers", type=click.IntRange(min=1), help="Processes.  [default: a core each]")
@click.option(
    "--scheduler", type=kinds.Scheduler(), metavar="tcp://HOST:PORT", help="Run on this Dask cluster instead."
)
@click.option("--line", metavar="ID", help="Run one line of the table and show its runs; nothing is stored.")
@click.option("--run", "only", metavar="MOTOR/POINT/SIGN", help="With --line: this run only.")
@click.option("--build-dir", type=paths.InputFolder(), help="Take the libraries from this build folder as they are.")
def faults(campaign: Path, out: Path | None, fresh: bool, is_slice: bool, record: bool, lines: str, workers: int | None,
           scheduler: str | None, line: str | None, only: str | None, build_dir: Path | None) -> int:  # fmt: skip
    """Inject the faults of a CAMPAIGN (TOML) and evaluate what the simulated machine does.

    Exits with 1 when the status of a line in the table is not true.
    """
    from fluxtrue_tools.fault_campaign import plan as plans
    from fluxtrue_tools.fault_campaign import prepare, run, spec
    from fluxtrue_tools.sim.build import ROOT

    _check_options(line, only, is_slice, record, scheduler)
    read = spec.read(campaign)
    if read.is_emulated and record:
        raise FluxtrueError(f"--record: the table has the results of the host; {campaign} has processor = 'emulated'")
    files = paths.outputs()
    table, rows = plans.read_rows(read, campaign.parent)
    files.reads(table)
    chosen = tuple(row for row in rows if any(fnmatchcase(row.id, one) for one in lines.split(",")))
    if not chosen:
        raise FluxtrueError(f"--lines {lines}: no line of {table} fits")
    possible = prepare.possible(read, chosen, line, lines)
    folders, images = prepare.machines(read, campaign, build_dir, files)
    plan = plans.Plan(read, possible, folders, is_slice, images)
    if left_out := [row.id for row in chosen if row not in possible]:
        click.echo(f"Not possible on the emulated processor, left out: {', '.join(left_out)}")
    if line is not None:
        click.echo(run.one_line(plan, line, only))
        return 0
    if out is None:
        out = ROOT / "build" / "faults" / (campaign.stem + ("-slice" if is_slice else ""))
        files.folder("--out", out, _FOLDER.names)
    command = f"tools/fluxtrue faults {shlex.quote(str(campaign))}"
    with files:
        text, is_true = run.whole(run.Job(plan, out, command, run.Record(table, tuple(rows)) if record else None),
                                  fresh=fresh, scheduler=scheduler, workers=workers)  # fmt: skip
    click.echo(text)
    return 0 if is_true or record else EXIT_NOT_TRUE


def _check_options(line: str | None, only: str | None, is_slice: bool, record: bool, scheduler: str | None) -> None:
    if line is not None:
        paths.refuse_given("with --line", "out", "fresh", "is_slice", "record", "lines", "workers", "scheduler")
    elif only is not None:
        raise FluxtrueError("--run: has no effect without --line")
    if is_slice and record:
        raise FluxtrueError("--record: has no effect with --slice, which does not run every point")
    paths.refuse_given("with --scheduler", *(["workers"] if scheduler is not None else []))
