# SPDX-License-Identifier: Apache-2.0
"""A recording as CSV and JSON text."""

import io
import json
import math
from typing import Any

import numpy as np

from fluxtrue_tools import faults
from fluxtrue_tools.sim.run import Recording


def csv_text(recording: Recording) -> str:
    """Units are in the headers; values have nine digits."""
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
    error = recording.mean("true_torque_Nm") - recording.mean("torque_requested_Nm")
    return {
        "motor": recording.motor.name,
        "controller": scenario.controller.kind,
        "duration_s": scenario.duration_s,
        "seed": scenario.seed,
        "window": {"from_s": first, "to_s": last, "request_reverses": recording.request_reverses},
        "torque_error_Nm": _rounded(error),
        "torque_error_percent": _rounded(recording.torque_error_percent),
        "estimate_error_percent": _rounded(recording.error_percent("torque_estimated_Nm", "true_torque_Nm")),
        "psi_error_percent": _rounded(recording.error_percent("psi_f_Vs", "true_psi_f_Vs")),
        "r_error_percent": _rounded(recording.error_percent("r_ohm", "true_r_ohm")),
        "fault_word": recording.fault_word,
        "faults": [{"t": _rounded(time_s), "names": names} for time_s, names in recording.faults()],
        "motor_check": faults.refused_data(recording.motor_check) or None,
        "expect_fault": scenario.expect_fault,
        "realtime_factor": _rounded(scenario.duration_s / recording.processor_s),
        "mean": means,
    }


def json_text(data: dict[str, Any]) -> str:
    """JSON text; the same run gives the same text except for the realtime factor."""
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
