# SPDX-License-Identifier: Apache-2.0
"""``fluxtrue bench``."""

from __future__ import annotations

from pathlib import Path

import click

from fluxtrue_tools import paths
from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.errors import FluxtrueError


@click.command(cls=paths.Command)
@click.option("--build-dir", type=paths.BuildFolder(), default=ROOT / "build",
              help="Where the measured program goes (default: build).")  # fmt: skip
@click.option("--json", "out", type=paths.OutputFile(), help="Also write the figures here.")
@click.option("--check", is_flag=True, help="Instead: measure all of docs/performance.md again and compare exactly.")
@click.option("--update", is_flag=True, help="Instead: measure, and rewrite docs/performance.{json,md}.")
def bench(build_dir: Path, out: Path | None, check: bool, update: bool) -> None:
    """Instructions, memory, stack of the firmware on an emulated Cortex-M4."""
    from fluxtrue_tools import bench as package  # the emulator takes a moment to load

    if check and update:
        raise FluxtrueError("--check and --update: one of them")
    if check or update:
        paths.refuse_given("with --check or --update", "out")
        _performance(build_dir, update)
        return
    with paths.outputs() as outputs:
        text = package.run(build_dir)
        if out is not None:
            outputs.text(out, text)


def _performance(build_dir: Path, update: bool) -> None:
    """docs/performance.md and what it is made of."""
    from fluxtrue_tools.bench import baseline, figures, page, sizes

    if not update:
        committed = baseline.load()
        reason = baseline.other_compiler(committed, sizes.compiler())
        if reason is not None:
            click.echo(reason)
            return
    measured = figures.measure(build_dir)
    text = page.page(measured)
    if update:
        baseline.write(measured, text)
        click.echo(f"{baseline.BASELINE.name} and {baseline.PAGE.name} written")
        return
    found = baseline.compare(committed, measured, text, baseline.PAGE.read_text(encoding="utf-8"))
    if found:
        raise FluxtrueError("\n  ".join(["the figures have changed:", *found, baseline.HOW]))
    click.echo("every figure is as committed")
