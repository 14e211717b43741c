# SPDX-License-Identifier: Apache-2.0
"""A recording as CSV and JSON; files appear complete or not at all."""

import contextlib
import io
import json
import math
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.run import Recording


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """A file next to `path` that takes its name when the block succeeds."""
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be written ({error.strerror})") from error
    os.close(handle)
    scratch = Path(name)
    try:
        yield scratch
        umask = os.umask(0)
        os.umask(umask)
        scratch.chmod(0o666 & ~umask)
        scratch.replace(path)
    except OSError as error:
        raise FluxtrueError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        scratch.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """The whole text, or the file as it was."""
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def check_writable(*paths: Path | None) -> None:
    """Find out before a long run, not after it."""
    given = [path for path in paths if path is not None]
    for path in given:
        if path.is_dir():
            raise FluxtrueError(f"{path}: is a folder, allowed: a file name")
        # A new file takes the name at the end: of /dev/null, too, for those who may.
        if path.exists() and not path.is_file():
            raise FluxtrueError(f"{path}: is a device or a pipe, allowed: a file name")
        if sum(path.resolve() == other.resolve() for other in given) > 1:
            raise FluxtrueError(f"{path}: given twice, allowed: another name for every output")
        if not path.parent.is_dir() or not os.access(path.parent, os.W_OK):
            raise FluxtrueError(f"{path}: cannot be written (no such folder, or not allowed)")


def csv_text(recording: Recording) -> str:
    """Units are in the headers; nine digits are more than any sensor has."""
    stream = io.StringIO()
    header = ",".join(recording.columns)
    np.savetxt(stream, recording.rows, fmt="%.9g", delimiter=",", header=header, comments="")
    return stream.getvalue()


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(f"{value:.6g}")


def summary(recording: Recording) -> dict[str, Any]:
    """Means over the window and how far the results are from the plant's truth."""
    scenario = recording.scenario
    first, last = scenario.averaged()
    means = {c: _rounded(recording.mean(c)) for c in recording.columns if c != "time_s"}
    error = recording.mean("true_torque_Nm") - recording.mean("torque_command_Nm")
    return {
        "motor": recording.motor.name,
        "controller": scenario.controller.kind,
        "duration_s": scenario.duration_s,
        "seed": scenario.seed,
        "window": {"from_s": first, "to_s": last},
        "torque_error_Nm": _rounded(error),
        "torque_error_percent": _rounded(recording.torque_error_percent),
        "estimate_error_percent": _rounded(
            recording.error_percent("torque_estimate_Nm", "true_torque_Nm")
        ),
        "psi_error_percent": _rounded(recording.error_percent("psi_f_Vs", "true_psi_f_Vs")),
        "r_error_percent": _rounded(recording.error_percent("r_ohm", "true_r_ohm")),
        "fault_word": recording.fault_word,
        "realtime_factor": _rounded(scenario.duration_s / recording.wall_s),
        "mean": means,
    }


def json_text(data: dict[str, Any]) -> str:
    """Readable, and the same for the same run but for the realtime factor."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
