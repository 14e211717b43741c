# SPDX-License-Identifier: Apache-2.0
"""The measured machine in four quadrants with all deviations at once; firmware and twin."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from fluxtrue_tools.demo.experiment import Bench, Bound, Result, number, run
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.run import Recording

SPEEDS_RPM: Final = (-3000.0, -1000.0, 1000.0, 3000.0)
TORQUES_NM: Final = (-120.0, -80.0, -40.0, -20.0, 20.0, 40.0, 80.0, 120.0)
CLOSED_PERCENT: Final = 0.5
CLOSED_NM: Final = 0.15
TWIN_PERCENT: Final = 0.1

# Our sensors and our inverter: noise, a 12-bit converter, 2 µs of dead time compensated to 95 %.
WRONG: Final = {
    "r_ohm_20": 0.025,
    "dead_time_s": 2e-6,
    "current_noise_A_rms": 0.5,
    "adc_bits": 12,
    "iron_k_h": 0.0,  # the paper's identification has no iron loss in its model
    "iron_k_e": 0.0,
}
MAGNET_SCALE: Final = 0.85


def scenario(speed_rpm: float, torque_Nm: float, closed: bool, kind: str) -> dict[str, Any]:
    """One point of the grid."""
    return {
        "duration_s": 1.5,
        "controller": {
            "kind": kind,
            "torque_loop": closed,
            "identification": closed,
            "identification_mode": "paper",  # identifies a single point within a second
            "dead_time_compensation": 0.95,
        },
        "profile": {
            "torque_Nm": torque_Nm,
            "speed_rpm": speed_rpm,
            "magnet_scale": MAGNET_SCALE,
            "vdc_V": 350.0,
        },
        "plant": WRONG,
    }


def parallel(jobs: list[Callable[[], Recording]], done: Callable[[], None]) -> list[Recording]:
    """Run all jobs on all cores; the simulation does not hold Python's global lock."""

    def one(job: Callable[[], Recording]) -> Recording:
        recording = job()
        done()
        return recording

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        return list(pool.map(one, jobs))


def _job(motor: Motor, spec: dict[str, Any]) -> Callable[[], Recording]:
    return lambda: run(motor, spec)


def grid(bench: Bench, done: Callable[[], None] = lambda: None) -> list[Result]:
    """Both experiments that share the grid: "hsm1-grid" and "twin"."""
    points = [(speed, torque) for speed in SPEEDS_RPM for torque in TORQUES_NM]
    variants = [(kind, closed) for kind in ("firmware", "twin") for closed in (False, True)]
    jobs = [
        _job(bench.hsm1, scenario(speed, torque, closed, kind)) for speed, torque in points for kind, closed in variants
    ]
    recordings = iter(parallel(jobs, done))
    rows = [{variant: next(recordings) for variant in variants} for _ in points]
    firmware = [_point(*point, row) for point, row in zip(points, rows, strict=True)]
    rated = bench.hsm1.torque_max_Nm
    twin = [_difference(*point, row, rated) for point, row in zip(points, rows, strict=True)]
    return [_grid_result(firmware), _twin_result(twin)]


def job_count() -> int:
    """Runs that grid() makes: for a progress bar."""
    return 4 * len(SPEEDS_RPM) * len(TORQUES_NM)


Row = dict[tuple[str, bool], Recording]


def _point(speed_rpm: float, torque_Nm: float, row: Row) -> dict[str, float]:
    closed = row["firmware", True]
    return {
        "speed_rpm": speed_rpm,
        "torque_requested_Nm": torque_Nm,
        "torque_error_open_percent": number(row["firmware", False].torque_error_percent, 4),
        "torque_error_closed_percent": number(closed.torque_error_percent, 4),
        "psi_error_percent": number(closed.error_percent("psi_f_Vs", "true_psi_f_Vs"), 4),
        "r_error_percent": number(closed.error_percent("r_ohm", "true_r_ohm"), 4),
        "psi_f_Vs": number(closed.mean("psi_f_Vs")),
        "r_ohm": number(closed.mean("r_ohm")),
    }


def _difference(speed_rpm: float, torque_Nm: float, row: Row, rated: float) -> dict[str, float]:
    point = {"speed_rpm": speed_rpm, "torque_requested_Nm": torque_Nm}
    for loop, closed in (("open", False), ("closed", True)):
        torque = {kind: row[kind, closed].mean("true_torque_Nm") for kind in ("firmware", "twin")}
        difference = 100.0 * (torque["firmware"] - torque["twin"]) / rated
        point[f"torque_difference_{loop}_percent_of_rated"] = number(difference, 4)
    return point


def allowed_percent(torque_Nm: float) -> float:
    """0.5 % of the requested torque or 0.15 N·m, whichever is larger."""
    return max(CLOSED_PERCENT, 100.0 * CLOSED_NM / abs(torque_Nm))


def _grid_result(points: list[dict[str, float]]) -> Result:
    bounds = [
        Bound(
            f"closed-loop torque error at {p['speed_rpm']:g} rpm, {p['torque_requested_Nm']:g} N·m",
            p["torque_error_closed_percent"],
            allowed_percent(p["torque_requested_Nm"]),
            "%",
        )
        for p in points
    ]
    return Result({"id": "hsm1-grid", "points": points}, bounds)


def _twin_result(points: list[dict[str, float]]) -> Result:
    keys = [f"torque_difference_{loop}_percent_of_rated" for loop in ("open", "closed")]
    worst = max((p[key] for p in points for key in keys), key=abs)
    bounds = [
        Bound(
            f"firmware less twin at {p['speed_rpm']:g} rpm, {p['torque_requested_Nm']:g} N·m, {key.split('_')[2]}",
            p[key],
            TWIN_PERCENT,
            "% of rated",
        )
        for p in points
        for key in keys
    ]
    summary = {"id": "twin", "torque_difference_percent_of_rated": worst, "points": points}
    return Result(summary, bounds)


def story(bench: Bench) -> Recording:
    """3000 rpm, 40 N·m: the magnets weaken from 0.2 to 0.5 s, the loop is closed at 0.8 s."""
    spec = scenario(3000.0, 40.0, False, "firmware")
    spec["duration_s"] = 1.6
    spec["profile"] |= {"magnet_scale": [[0, 1.0], [0.2, 1.0], [0.5, MAGNET_SCALE]]}
    spec["event"] = [{"t": 0.8, "set": {"torque_loop": True, "identification": True}}]
    return run(bench.hsm1, spec)
