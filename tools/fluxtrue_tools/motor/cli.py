# SPDX-License-Identifier: Apache-2.0
"""fluxtrue motor check | build | import | start."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fluxtrue_tools import paths
from fluxtrue_tools.motor.map_import.cli import import_
from fluxtrue_tools.motor.names import BUILT, PLOTS, TEXT, source_files
from fluxtrue_tools.motor.start import start

if TYPE_CHECKING:
    from fluxtrue_tools.motor.motor import Motor

_FOLDER = paths.InputFolder()


@click.group()
def motor() -> None:
    """Check machine data, generate the tables the firmware is built from."""


def _warn(resolved: "Motor") -> None:
    from fluxtrue_tools.motor import doubts

    for text in doubts.of_motor(resolved):
        click.echo(f"warning: {text}", err=True)


@motor.command(cls=paths.Command)
@click.argument("folder", type=_FOLDER)
@click.option("--plots", type=paths.OutputFolder(*PLOTS), metavar="DIR", help="Write the plots there too.")
def check(folder: Path, plots: Path | None) -> None:
    """Validate FOLDER (motor.toml and its flux map) and print the report."""
    from fluxtrue_tools.motor.build import generate
    from fluxtrue_tools.motor.motor import load_motor, naming

    with paths.outputs() as outputs:
        outputs.reads(*source_files(folder))
        resolved = load_motor(folder)
        with naming(folder):
            files = generate(resolved)  # what build refuses, check must refuse
        if plots is not None:
            from fluxtrue_tools.motor.html import write_plots
            from fluxtrue_tools.motor.measured import measure_loop

            write_plots(resolved, measure_loop(resolved), outputs.scratch(plots))
    _warn(resolved)
    click.echo(files[TEXT], nl=False)


@motor.command(cls=paths.Command)
@click.argument("folder", type=_FOLDER)
@click.option("--out", required=True, type=paths.OutputFolder(*BUILT), metavar="DIR", help="Where the files go.")
@click.option("--report/--no-report", default=True, help="Plots and report.html (a few seconds).")
def build(folder: Path, out: Path, report: bool) -> None:
    """Generate C tables, motor.json and the report of FOLDER into DIR."""
    from fluxtrue_tools.motor.build import build_into

    with paths.outputs() as outputs:
        outputs.reads(*source_files(folder))
        resolved = build_into(folder, outputs, out, report)
    _warn(resolved)
    click.echo(f"motor {resolved.config.machine.name}: written to {out}")


motor.add_command(import_)
motor.add_command(start)
