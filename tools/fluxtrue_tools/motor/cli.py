# SPDX-License-Identifier: Apache-2.0
"""fluxtrue motor check | build."""

from pathlib import Path

import click


@click.group()
def motor() -> None:
    """Check machine data, generate the tables the firmware is built from."""


@motor.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--plots", type=click.Path(path_type=Path), metavar="DIR", help="Write the plots there too.")
def check(folder: Path, plots: Path | None) -> None:
    """Validate FOLDER (motor.toml and its flux map) and print the report."""
    from fluxtrue_tools.motor.build import generate
    from fluxtrue_tools.motor.motor import load_motor, naming

    resolved = load_motor(folder)
    with naming(folder):
        files = generate(resolved)  # what build refuses, check must refuse
    if plots is not None:
        from fluxtrue_tools.motor.html import write_plots

        write_plots(resolved, plots)
    click.echo(files["report.txt"], nl=False)


@motor.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Where the files go.")
@click.option("--report/--no-report", default=True, help="Plots and report.html (a few seconds).")
def build(folder: Path, out: Path, report: bool) -> None:
    """Generate C tables, motor.json and the report of FOLDER into DIR."""
    from fluxtrue_tools.motor.build import build as run

    resolved = run(folder, out, report)
    click.echo(f"motor {resolved.config.machine.name}: written to {out}")
