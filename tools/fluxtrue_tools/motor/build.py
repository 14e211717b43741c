# SPDX-License-Identifier: Apache-2.0
"""motor build: all files or none."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.emit_c import motor_si_c, motor_tables_c
from fluxtrue_tools.motor.emit_json import motor_json
from fluxtrue_tools.motor.motor import Motor, load_motor, naming
from fluxtrue_tools.motor.report import report_text

HTML_NAME = "report.html"
PLOT_NAMES = tuple(f"plot_{what}.png" for what in ("envelope", "error", "flux", "inductances", "loci"))


def generate(motor: Motor) -> dict[str, str]:
    """Every file as text; refuses numbers that do not fit the firmware's formats."""
    return {"motor_tables.c": motor_tables_c(motor), "motor_si.c": motor_si_c(motor),
            "motor.json": motor_json(motor), "report.txt": report_text(motor)}


@contextmanager
def _staging(out: Path) -> Iterator[Path]:
    """A fresh folder on the same disk as out, gone afterwards whatever happens."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=".motor-build-", dir=out))
    except OSError as error:
        raise FluxtrueError(f"{out}: cannot be written: {error.strerror}") from None
    try:
        yield folder
    except OSError as error:
        raise FluxtrueError(f"{out}: cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def build(folder: Path, out: Path, report: bool) -> Motor:
    """Generate everything for one motor. Old files stay until every new one is complete."""
    motor = load_motor(folder)
    with naming(folder):
        files = generate(motor)
    with _staging(out) as staging:
        for name, text in files.items():
            (staging / name).write_text(text, encoding="utf-8")
        if report:
            from fluxtrue_tools.motor.html import write_report

            write_report(motor, files["report.txt"], staging)
        new = {path.name for path in staging.iterdir()}
        for stale in (out / name for name in (HTML_NAME, *PLOT_NAMES)):
            if stale.name not in new:
                stale.unlink(missing_ok=True)  # plots of an older build would be taken for these tables'
        for name in sorted(new):
            os.replace(staging / name, out / name)
    return motor
