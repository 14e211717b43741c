# SPDX-License-Identifier: Apache-2.0
"""All files of a commissioning's result."""

from pathlib import Path

from fluxtrue_tools.commission import folder, plot, report
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.map_import.grid import Grid


def write(found: Found, known: Nameplate, nameplate: Path, staging: Path, out: Path) -> tuple[str, Grid | None]:
    """Written to `staging`, named after `out`; the report and the map."""
    known = found.known(known)
    grid, _ = folder.write(found, known, nameplate, staging, out)
    text = report.text(found, known, grid)
    (staging / "commission.txt").write_text(text, encoding="utf-8")
    if found.resistance is not None:
        plot.write(found, known, grid, staging / "commission.png")
    return text, grid
