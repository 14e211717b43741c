# SPDX-License-Identifier: Apache-2.0
"""Steps of both current references in simulation: the firmware around the machine of the data sheet."""

from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.motor.current_loop import operating_point
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.injection import at_point
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.simulated import DataLoop, Simulated

AXES = ("d", "q")
STEP = 0.1  # of i_max
BEFORE, AFTER = 10, 70  # periods shown; the slower law needs 13.5 periods, and the integrator 22
READ = ("truth.i_d_A", "truth.i_q_A", "voltage_limited")


@dataclass(frozen=True)
class Step:
    """Change of the machine's currents; the firmware has the new reference of the axis from time 0 on."""

    axis: str
    step_A: float
    time_s: Array
    change_A: dict[str, Array]
    is_limited: bool  # by the voltage

    def overshoot(self) -> float:
        """Beyond the reference, as a share of the step."""
        return max(float((self.change_A[self.axis] / self.step_A).max()) - 1.0, 0.0)


def steps(simulated: Simulated, motor: Motor, speed_rpm: float, inductance: float = 1.0) -> dict[str, Step]:
    """By axis: i_d away from zero, i_q upwards from the operating point, each within one period."""
    point = dict(zip(AXES, operating_point(motor, speed_rpm, inductance), strict=True))
    sizes = {"d": -STEP * motor.config.machine.i_max_A, "q": STEP * motor.config.machine.i_max_A}
    with at_point(simulated, motor, speed_rpm, inductance) as loop:
        loop.record(READ)
        found = {}
        for axis in AXES:
            found[axis] = _step(loop, axis, point[axis], sizes[axis], motor.bases.periods_per_step)
            loop.set(f"i{axis}_ref_A", point[axis])
            loop.run(10 * AFTER)
    return found


def _step(loop: DataLoop, axis: str, from_A: float, step_A: float, per_task: int) -> Step:
    """The 1 kHz task hands the reference over at the end of a step: it is set one period before.

    The last row before and the first one after it end where the firmware samples without and with the reference.
    """
    loop.run((-loop.periods - BEFORE - 1) % per_task)
    before = loop.run(BEFORE)
    loop.set(f"i{axis}_ref_A", from_A + step_A)
    rows = np.concatenate([before, loop.run(1 + AFTER)])
    start = {"d": from_A if axis == "d" else before[:, 0].mean(), "q": from_A if axis == "q" else before[:, 1].mean()}
    change = {name: rows[:, k] - start[name] for k, name in enumerate(AXES)}
    return Step(axis, step_A, np.arange(-BEFORE, AFTER + 1) * loop.period_s, change, bool(rows[:, 2].any()))
