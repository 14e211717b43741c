# SPDX-License-Identifier: Apache-2.0
"""Whether a port can carry a machine: its timer the period and the dead time, its processor the PWM frequency.

The port tells its limits in budget.toml. What its interrupts cost is measured (docs/performance.json, emulated): the
most that each of them took, added up as if they always did.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import periods_per_step

ROOT = Path(__file__).resolve().parents[3]
MEASURED = ROOT / "docs" / "performance.json"
COMMAND_HZ = 100
WORK, TASK, CAN = "10 kHz work", "1 kHz task", "CAN ISR"  # rows of performance.json; the work is that of a period
MOST = 2


def busy_share(pwm_hz: float, core_hz: float, measured: dict[str, Any]) -> float:
    """Of the processor, with the identification that takes more."""
    tasks_hz = pwm_hz / periods_per_step(pwm_hz)

    def cycles_per_s(runs: dict[str, Any]) -> float:
        most = {name: float(runs[name]["cycles"][MOST]) for name in (WORK, TASK, CAN)}
        return pwm_hz * most[WORK] + tasks_hz * most[TASK] + COMMAND_HZ * most[CAN]

    return max(cycles_per_s(drive["runs"]) for drive in measured["drives"].values()) / core_hz


def _check_timer(pwm_hz: float, dead_time_s: float, pwm: dict[str, Any], port: str) -> None:
    ticks = round(pwm["timer_Hz"] / pwm_hz)
    if ticks > pwm["period_ticks_max"]:
        least = pwm["timer_Hz"] / pwm["period_ticks_max"]
        raise FluxtrueError(f"inverter.pwm_hz = {pwm_hz:g}, allowed on the {port}: from {least:.0f}")
    most_s = min(pwm["dead_time_ticks_max"] / pwm["timer_Hz"], pwm["dead_time_share_max"] / pwm_hz)
    if not 0.0 < dead_time_s <= most_s * (1.0 + 1e-9):
        raise FluxtrueError(f"inverter.dead_time_s = {dead_time_s:g}, allowed on the {port} at inverter.pwm_hz = "
                            f"{pwm_hz:g}: more than 0, up to {most_s:.4g}")  # fmt: skip


def check(motor: Path, budget: Path, measured: Path = MEASURED) -> str:
    """One line that says how busy the processor will be; a machine that the port cannot carry is refused."""
    inverter = json.loads(motor.read_text(encoding="utf-8"))["inverter"]
    port, name = tomllib.loads(budget.read_text(encoding="utf-8")), budget.parent.name
    pwm_hz = float(inverter["pwm_hz"])
    _check_timer(pwm_hz, float(inverter["dead_time_s"]), port["pwm"], name)
    costs = json.loads(measured.read_text(encoding="utf-8"))
    share, most = busy_share(pwm_hz, port["core_Hz"], costs), port["busy_share_max"]
    said = f"{100.0 * share:.0f} % of the time at inverter.pwm_hz = {pwm_hz:g}"
    if share > most:
        raise FluxtrueError(f"the processor of the {name} would be busy for {said}, allowed: up to {100.0 * most:g} %")
    return f"busy for at most {said}, without wait states"
