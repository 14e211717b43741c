# SPDX-License-Identifier: Apache-2.0
"""``fluxtrue bench``."""

from __future__ import annotations

from pathlib import Path

import click

from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.errors import FluxtrueError


@click.command()
@click.option(
    "--build-dir", type=click.Path(path_type=Path, file_okay=False), default=ROOT / "build",
    help="Where the measured program goes (default: build).",
)  # fmt: skip
@click.option(
    "--json", "out", type=click.Path(path_type=Path, dir_okay=False),
    help="Also write the figures here.",
)  # fmt: skip
def bench(build_dir: Path, out: Path | None) -> None:
    """Instructions and accuracy of the fixed-point functions on an emulated Cortex-M4."""
    from fluxtrue_tools import bench as package  # the emulator takes a moment to load

    if out is not None and not out.absolute().parent.is_dir():
        raise FluxtrueError(f"--json {out}: the folder {out.parent} does not exist")
    package.run(build_dir, out)
