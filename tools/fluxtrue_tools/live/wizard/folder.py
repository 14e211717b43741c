# SPDX-License-Identifier: Apache-2.0
"""The motor's folder that the wizard ends with, as a .zip."""

import io
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.commission import result
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.map_import.grid import Grid


@dataclass(frozen=True)
class Folder:
    """What the user downloads, and what the page shows of it."""

    name: str
    archive: bytes
    report: str
    grid: Grid | None
    known: Nameplate
    found: Found


def written(found: Found, known: Nameplate, nameplate: Path, name: str) -> Folder:
    """The same files as of `fluxtrue commission --out`; what motor build would refuse is refused here."""
    with tempfile.TemporaryDirectory() as place:
        staging = Path(place) / name
        staging.mkdir()
        report, grid = result.write(found, known, nameplate, staging, staging)
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(staging.iterdir()):
                archive.write(path, f"{name}/{path.name}")
        return Folder(name, content.getvalue(), report, grid, known, found)
