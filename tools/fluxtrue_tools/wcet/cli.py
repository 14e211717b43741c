# SPDX-License-Identifier: Apache-2.0
"""``fluxtrue wcet``."""

from __future__ import annotations

from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError

ROWS = 40


@click.command(cls=paths.Command)
@click.option("--elf", type=paths.InputFile(), help="The image (default: s32k144, which is built).")
@click.option("--mode", type=kinds.Text(), default="driving", show_default=True, help="Mode of operation, for --path.")
@click.option(
    "--path", "handler", type=kinds.Text(), help="Also: the longest path of this handler, by functions of the source."
)
def wcet(elf: Path | None, mode: str, handler: str | None) -> None:
    """Worst-case execution time of each interrupt handler, from the control flow of the image."""
    from fluxtrue_tools.bench import figures
    from fluxtrue_tools.target.build import ROOT, image
    from fluxtrue_tools.wcet import facts, worst
    from fluxtrue_tools.wcet.bound import Image

    data = facts.load()
    preset = "s32k144"
    built = Image.read(elf or image(preset, ROOT / "build" / "emulated" / preset))
    found = worst.bounds(built, data, figures.pointers(figures.budget(), built.functions))
    click.echo("Upper bounds from the control flow of the image; cycles are estimates, by the manual and with the most")
    click.echo("waiting for memories (modelled).\n")
    click.echo(f"{'mode':<12}{'handler':<22}{'instructions':>14}{'cycles':>12}{'most waiting':>14}")
    for name, handlers in found.figures.items():
        for title, row in handlers.items():
            click.echo(f"{name:<12}{title:<22}{row['instructions']:>14,}{row['cycles']:>12,}{row['most']:>14,}")
    if handler is not None:
        _path(found, mode, handler, data["handlers"])


def _path(found, mode: str, title: str, handlers: dict[str, str]) -> None:  # type: ignore[no-untyped-def]
    if title not in handlers or (mode, "instructions") not in found.handlers:
        raise FluxtrueError(f"--path {title} --mode {mode}: handlers are {', '.join(handlers)}; "
                            f"modes are {', '.join(found.figures)}")  # fmt: skip
    of = found.handlers[mode, "instructions"]
    shares = sorted(of.shares(handlers[title]).items(), key=lambda row: -row[1])
    click.echo(f"\nInstructions on the longest path of the {title}, {mode}:")
    for function, number in shares[:ROWS]:
        click.echo(f"{number:>10,}  {function}")
    click.echo(f"{sum(number for _, number in shares[ROWS:]):>10,}  {len(shares[ROWS:])} others")
