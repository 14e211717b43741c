# SPDX-License-Identifier: Apache-2.0
"""Whether a port suits a machine: its timer must make the period and the dead time, its processor the PWM frequency.

The limits of a port are in its budget.toml. The cost of its interrupts is measured (docs/performance.json, emulated)
with each angle sensor; the maxima of all interrupts are added up, those while driving and those while reacting to a
fault each by themselves.

Most sensors are measured with one identification only. With the other, an interrupt is taken to cost what it costs with
the encoder and the most that the sensor adds to it with the measured one, in whichever state. The same code reads the
sensor with both, so that this is near what would be measured, but no proven bound: of the resolver, which is measured
with both, the sums differ by less than 0.1 % of the processor.
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
ENCODER = "encoder"  # its image is that of all figures but those of "sensors"
MAXIMUM = 2  # after minimum and average
STATES = ("driving", "reacting")  # to a fault: no interrupt is in both at once

Costs = dict[str, dict[str, float]]  # the most cycles of each row in each state


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


def _at_most(runs: dict[str, Any]) -> Costs:
    return {row: {state: float(runs[row]["cycles_at_most"][state]) for state in STATES} for row in (WORK, TASK, CAN)}


def _with_sensor(encoder: dict[str, Costs], sensor: dict[str, Costs]) -> list[Costs]:
    """Of each identification: as measured with the sensor, else the encoder's and what the sensor adds at most."""

    def added(row: str) -> float:
        return max(0.0, *(sensor[name][row][state] - encoder[name][row][state] for name in sensor for state in STATES))

    def estimated(costs: Costs) -> Costs:
        return {row: {state: cycles + added(row) for state, cycles in of.items()} for row, of in costs.items()}

    return [sensor[name] if name in sensor else estimated(costs) for name, costs in encoder.items()]


def _costs(measured: dict[str, Any], angle: str) -> list[Costs]:
    """Of the image with this angle sensor, of each identification."""
    encoder = {name: _at_most(drive["runs"]) for name, drive in measured["drives"].items()}
    if angle == ENCODER:
        return list(encoder.values())
    sensors = measured["sensors"]
    if angle not in sensors:
        raise FluxtrueError(f"--angle {angle}, allowed: {', '.join((ENCODER, *sensors))}")
    return _with_sensor(encoder, {name: _at_most(runs) for name, runs in sensors[angle]["runs"].items()})


def busy_share(built: Built, core_hz: float, measured: dict[str, Any], angle: str = ENCODER) -> float:
    """Share of the processor that is busy, with the identification that takes longer."""
    pwm_hz = built.inverter.pwm_hz
    tasks_hz = pwm_hz / periods_per_step(pwm_hz)
    law = _cycles_of_turning_law(measured) if built.is_turning else 0.0

    def cycles_per_s(costs: Costs, state: str) -> float:
        work, task, can = (costs[row][state] for row in (WORK, TASK, CAN))
        return pwm_hz * (work + law) + tasks_hz * task + COMMAND_HZ * can

    return max(cycles_per_s(costs, state) for costs in _costs(measured, angle) for state in STATES) / core_hz


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


def check(motor: Path, budget: Path, measured: Path = MEASURED, angle: str = ENCODER) -> str:
    """One line that says how busy the processor will be; a machine that the port cannot carry is refused.

    angle   the image's angle sensor, as performance.json names it
    """
    built, port, name = read(motor), budgets.read(budget), budget.absolute().parent.name
    inverter, pwm_hz = built.inverter, built.inverter.pwm_hz
    _check_timer(pwm_hz, inverter.dead_time_s, port.pwm, name)
    costs = json.loads(measured.read_text(encoding="utf-8"))
    share, share_max = busy_share(built, port.core_Hz, costs, angle), port.busy_share_max
    said = f"{100.0 * share:.0f} % of the time at inverter.pwm_hz = {pwm_hz:g} with the angle sensor {angle}"
    if share > share_max:
        raise FluxtrueError(
            f"the processor of the {name} would be busy for {said}, allowed: up to {100.0 * share_max:g} %"
        )
    return f"busy for at most {said}, without wait states"
