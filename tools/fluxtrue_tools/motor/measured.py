# SPDX-License-Identifier: Apache-2.0
"""What the report measures on the firmware in simulation: open loop and steps, over the inductances' error."""

import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError, of_system
from fluxtrue_tools.motor.current_loop import Response
from fluxtrue_tools.motor.current_steps import Step, steps
from fluxtrue_tools.motor.injection import measure
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.simulated import simulated

LOOP_SPEEDS = (0.0, 1.0)  # of the top speed
LOOP_INDUCTANCES = (0.75, 1.0, 1.25)
STEP_SPEEDS = (0.0, 0.5)
STEP_INDUCTANCES = (0.8, 1.0, 1.25)  # 0.8: the bound on the overshoot, 10 %, is stated for it


@dataclass(frozen=True)
class Measured:
    """By share of the top speed and inductance; where a measurement was impossible, the reason is in `missing`."""

    loops: dict[tuple[float, float], Response]
    steps: dict[tuple[float, float], dict[str, Step]]
    missing: list[str]


def _each(speeds: Iterable[float], inductances: Iterable[float]) -> list[tuple[float, float]]:
    return [(speed, inductance) for speed in speeds for inductance in inductances]


def measure_loop(motor: Motor) -> Measured:
    """Everything; without a simulation library, or a compiler, only the reason."""
    found = Measured({}, {}, [])
    top_rpm = motor.config.machine.speed_max_rpm
    with tempfile.TemporaryDirectory() as folder:
        try:
            drive = simulated(motor, Path(folder))
        except (FluxtrueError, OSError) as error:
            found.missing.append(f"current loop: {of_system(error) if isinstance(error, OSError) else error}")
            return found
        for speed, inductance in _each(LOOP_SPEEDS, LOOP_INDUCTANCES):
            try:
                found.loops[speed, inductance] = measure(drive, motor, speed * top_rpm, inductance)
            except FluxtrueError as error:
                found.missing.append(f"open current loop, inductances of {100 * inductance:.0f} %: {error}")
        for speed, inductance in _each(STEP_SPEEDS, STEP_INDUCTANCES):
            try:
                found.steps[speed, inductance] = steps(drive, motor, speed * top_rpm, inductance)
            except FluxtrueError as error:
                found.missing.append(f"steps of the current, inductances of {100 * inductance:.0f} %: {error}")
    return found
