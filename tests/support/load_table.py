# SPDX-License-Identifier: Apache-2.0
"""The tables of the processor's load in the README of the S32K144's port, row by row."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

README: Final = Path(__file__).resolve().parents[2] / "hal" / "s32k144" / "README.md"
HEAD: Final = "| `pwm_hz` | robust"
SENSORS_HEAD: Final = "| `FLUXTRUE_ANGLE` |"
# Columns: by the manual and with the most waiting, of each identification, then the sum of the largest.
IDENTIFICATIONS: Final = {"robust": slice(0, 2), "paper": slice(2, 4)}
SUM: Final = 4


def _rows(readme: Path, head: str) -> Iterator[tuple[str, ...]]:
    _, _, after = readme.read_text(encoding="utf-8").partition(head)
    for line in after.splitlines()[2:]:
        if not line.startswith("|"):
            break
        yield tuple(cell.strip() for cell in line.strip("|").split("|"))


def load_rows(readme: Path = README) -> dict[float, tuple[str, ...]]:
    """The cells of each row by its frequency in kHz."""
    return {float(khz.removesuffix(" kHz")): tuple(cells) for khz, *cells in _rows(readme, HEAD)}


def sensor_rows(readme: Path = README) -> list[tuple[str, ...]]:
    """The cells of each row of the angle sensors."""
    return list(_rows(readme, SENSORS_HEAD))


def load_row(khz: float) -> tuple[str, ...]:
    """The cells of one row, without the frequency."""
    return load_rows()[khz]
