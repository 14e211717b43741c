# SPDX-License-Identifier: Apache-2.0
"""Whether a port suits a machine: its timer must make the period and the dead time, its processor the PWM frequency.

The limits of a port are in its budget.toml. The cost of its interrupts is measured (docs/performance.json, emulated);
the maxima of all interrupts are added up, those while driving and those while reacting to a fault each by themselves.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import periods_per_step
from fluxtrue_tools.motor.config import ANGLE_TURNING
from fluxtrue_tools.target import budget as budgets
from fluxtrue_tools.target.budget import Pwm

ROOT = Path(__file__).resolve().parents[3]
MEASURED = ROOT / "docs" / "performance.json"
COMMAND_HZ = 100
WORK, TASK, CAN = "10 kHz work", "1 kHz task", "CAN ISR"  # rows of performance.json; the work is that of a period
MAXIMUM = 2  # after minimum and average
STATES = ("driving", "reacting")  # to a fault: no interrupt is in both at once


class Inverter(BaseModel):
    """What is read of a motor.json."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)
    pwm_hz: Annotated[float, Field(ge=1e3, le=1e6)]
    dead_time_s: Annotated[float, Field(ge=0, le=1e-3)]


class Machine(BaseModel):
    """What is read of its machine."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False)
    pole_pairs: Annotated[int, Field(ge=1, le=64)]
    speed_max_rpm: Annotated[float, Field(gt=0, le=1e6)]


class Built(BaseModel):
    """motor.json, most of which does not matter here."""

    machine: Machine
    inverter: Inverter

    @property
    def is_turning(self) -> bool:
        """The field turns so far in a PWM period that the motor has the law for it, as in its configuration."""
        omega_rad_s = 2.0 * math.pi / 60.0 * self.machine.speed_max_rpm * self.machine.pole_pairs
        return omega_rad_s > ANGLE_TURNING * self.inverter.pwm_hz


def _cycles_of_turning_law(measured: dict[str, Any]) -> float:
    """What a period takes longer with the law for a field that turns far."""
    laws = measured["kernels"]["laws"]
    return float(laws["turning"]["cycles"][MAXIMUM] - laws["usual"]["cycles"][MAXIMUM])


def busy_share(built: Built, core_hz: float, measured: dict[str, Any]) -> float:
    """Share of the processor that is busy, with the identification that takes longer."""
    pwm_hz = built.inverter.pwm_hz
    tasks_hz = pwm_hz / periods_per_step(pwm_hz)
    law = _cycles_of_turning_law(measured) if built.is_turning else 0.0

    def cycles_per_s(runs: dict[str, Any], state: str) -> float:
        cycles = {name: float(runs[name]["cycles_at_most"][state]) for name in (WORK, TASK, CAN)}
        return pwm_hz * (cycles[WORK] + law) + tasks_hz * cycles[TASK] + COMMAND_HZ * cycles[CAN]

    drives = measured["drives"].values()
    return max(cycles_per_s(drive["runs"], state) for drive in drives for state in STATES) / core_hz


def _check_timer(pwm_hz: float, dead_time_s: float, pwm: Pwm, port: str) -> None:
    ticks = round(pwm.timer_Hz / pwm_hz)
    if ticks > pwm.period_ticks_max:
        lowest_hz = pwm.timer_Hz / pwm.period_ticks_max
        raise FluxtrueError(f"inverter.pwm_hz = {pwm_hz:g}, allowed on the {port}: from {lowest_hz:.0f}")
    longest_s = min(pwm.dead_time_ticks_max / pwm.timer_Hz, pwm.dead_time_share_max / pwm_hz)
    if not 0.0 < dead_time_s <= longest_s * (1.0 + 1e-9):
        raise FluxtrueError(f"inverter.dead_time_s = {dead_time_s:g}, allowed on the {port} at inverter.pwm_hz = "
                            f"{pwm_hz:g}: more than 0, up to {longest_s:.4g}")  # fmt: skip


def read(path: Path) -> Built:
    """A motor.json; what is not one is refused."""
    try:
        return Built.model_validate_json(strict.read_text(path))
    except ValidationError as error:
        raise FluxtrueError(f"{path}: not the motor.json of a build: {strict.explain(error, Built)}") from None


def check(motor: Path, budget: Path, measured: Path = MEASURED) -> str:
    """One line that says how busy the processor will be; a machine that the port cannot carry is refused."""
    built, port, name = read(motor), budgets.read(budget), budget.absolute().parent.name
    inverter, pwm_hz = built.inverter, built.inverter.pwm_hz
    _check_timer(pwm_hz, inverter.dead_time_s, port.pwm, name)
    costs = json.loads(measured.read_text(encoding="utf-8"))
    share, share_max = busy_share(built, port.core_Hz, costs), port.busy_share_max
    said = f"{100.0 * share:.0f} % of the time at inverter.pwm_hz = {pwm_hz:g}"
    if share > share_max:
        raise FluxtrueError(
            f"the processor of the {name} would be busy for {said}, allowed: up to {100.0 * share_max:g} %"
        )
    return f"busy for at most {said}, without wait states"
