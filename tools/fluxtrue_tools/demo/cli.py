# SPDX-License-Identifier: Apache-2.0
"""fluxtrue demo: every experiment, a table, a report."""

import itertools
import sys
import time
from pathlib import Path

import click

from fluxtrue_tools import paths

EXIT_BOUND_MISSED = 1
_FOLDER = paths.OutputFolder("report.html", "summary.json")


@click.command(cls=paths.Command)
@click.option(
    "--out",
    type=_FOLDER,
    help="Folder for report.html and summary.json.  [default: build/demo]",
)
def demo(out: Path | None) -> int:
    """The paper's experiments, and ours on a measured machine, in closed loop."""
    from fluxtrue_tools.demo import report
    from fluxtrue_tools.demo.all import demonstrate
    from fluxtrue_tools.demo.experiment import bench
    from fluxtrue_tools.demo.grid import job_count
    from fluxtrue_tools.sim.build import ROOT
    from fluxtrue_tools.sim.output import json_text

    folder, outputs = out, paths.outputs()
    if folder is None:
        folder = ROOT / "build" / "demo"
        outputs.folder("--out", folder, _FOLDER.names)
    begin = time.monotonic()

    def say(text: str) -> None:
        click.echo(f"[{time.monotonic() - begin:5.1f} s] {text}", err=True)

    runs = itertools.count(1)

    def grid_done() -> None:
        done = next(runs)
        if sys.stderr.isatty():
            end = "\n" if done == job_count() else ""
            click.echo(f"\r          {done} of {job_count()} ", nl=False, err=True)
            click.echo(end, nl=False, err=True)

    demonstration = demonstrate(bench(), say, grid_done)
    say("report")
    with outputs:
        made = outputs.scratch(folder)
        (made / "report.html").write_text(report.html(demonstration), encoding="utf-8")
        (made / "summary.json").write_text(json_text(demonstration.summary()), encoding="utf-8")
    click.echo(report.terminal(demonstration))
    click.echo(f"\n{folder / 'report.html'}\n{folder / 'summary.json'}")
    missed = demonstration.missed()
    for line in missed:
        click.echo(f"bound missed: {line}", err=True)
    return EXIT_BOUND_MISSED if missed else 0
