# SPDX-License-Identifier: Apache-2.0
"""The files that a motor is made from, and those that the motor commands write."""

import tomllib
from pathlib import Path

FILE_NAME = "motor.toml"
HTML = "report.html"
TEXT = "report.txt"
_FIGURES = ("current_loop", "envelope", "error", "flux", "inductances", "loci", "losses", "short_circuit", "steps")
PLOTS = tuple(f"plot_{what}.png" for what in _FIGURES)
DBC_NAME = "fluxtrue.dbc"
BUILT = ("motor_tables.c", "motor_si.c", "motor.json", DBC_NAME, TEXT, HTML, *PLOTS)


def source_files(folder: Path) -> tuple[Path, ...]:
    """What a motor is made from: nothing that is written may take its place."""
    path = folder / FILE_NAME
    try:
        if not path.is_file():  # reading a pipe would wait, and a device may have no end
            return (path,)
        return path, folder / tomllib.loads(path.read_text(encoding="utf-8-sig"))["machine"]["flux_map"]
    except (OSError, ValueError, TypeError, LookupError, RecursionError):
        return (path,)  # a missing or unreadable map is reported when it is loaded
