# SPDX-License-Identifier: Apache-2.0
"""Steps of the requested torque on a machine whose inductances are 20 % smaller than its data say.

A step is one to the torque that half of the reach at a speed allows, and back beyond zero: to half, to minus half, to
zero. The request changes at once; the drive's own slew limit (torque_slew_Nm_per_s) acts. Overshoot is that of the
machine's torque over one period, beyond the torque at which it settles, as a share of the step.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools import faults
from fluxtrue_tools.campaign.envelope import NOTHING_WRONG, make_envelope
from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.sim.library import Loop

SMALL: Final = {"lq_scale": 0.8, "ld_slope_scale": 0.8}
SPEEDS: Final = (0.02, 0.3, 0.6, 0.8, 1.0)  # of speed_max
TORQUES: Final = (0.5, -0.5, 0.0)  # of the reach at this speed
SPEED_UP_S, SETTLE_S, STEP_S, FINAL_S = 1.0, 0.4, 0.1, 0.02
OVERSHOOT_MAX: Final = 0.1
TURN_RAD: Final = 2.0 * math.pi


@dataclass(frozen=True)
class Step:
    """One answer."""

    speed_rpm: float
    from_Nm: float
    to_Nm: float
    overshoot: float
    fault_word: int

    @property
    def met(self) -> bool:
        return self.fault_word == 0 and self.overshoot <= OVERSHOOT_MAX

    def __str__(self) -> str:
        trip = f"trip ({', '.join(faults.named(self.fault_word))})"
        result = trip if self.fault_word else f"{100 * self.overshoot:.2f} %"
        return f"{self.speed_rpm:.0f} rpm, {self.from_Nm:.3g} to {self.to_Nm:.3g} N·m: {result}"


def overshoot(torque_Nm: NDArray[np.float64], from_Nm: float, final_Nm: float) -> float:
    """Beyond the final value, as a share of the whole change."""
    change = final_Nm - from_Nm
    return max(0.0, float(((torque_Nm - final_Nm) / change).max())) if change else 0.0


def steps(machine: Machine, plant: dict[str, float] | None = None, speeds: tuple[float, ...] = SPEEDS) -> list[Step]:
    """The steps of one machine, at every speed from a drive that has just been started."""
    motor = machine.motor
    changed = SMALL if plant is None else plant
    envelope = make_envelope(machine, NOTHING_WRONG | {k: v for k, v in changed.items() if k in NOTHING_WRONG})
    answers = []
    for share in speeds:
        speed_rpm = share * machine.speed_max_rpm
        reach_Nm = envelope.at(speed_rpm)
        with Loop(motor.library, motor.plant | {"imposed_speed": 1.0} | changed, motor.flux_map) as loop:
            loop.set("enable", 1.0)
            loop.record(("truth.torque_mean_Nm", "fault_word"))
            loop.run(round(SPEED_UP_S / loop.period_s), {"plant.speed_rad_s": (0.0, speed_rpm / 60.0 * TURN_RAD)})
            before = 0.0
            for torque in TORQUES:
                loop.run(round(SETTLE_S / loop.period_s))
                loop.set("torque_requested_Nm", torque * reach_Nm)
                rows = loop.run(round(STEP_S / loop.period_s))
                final = float(rows[-round(FINAL_S / loop.period_s) :, 0].mean())
                word = int(rows[:, 1].max())
                answers.append(Step(speed_rpm, before, torque * reach_Nm, overshoot(rows[:, 0], before, final), word))
                if word:
                    break  # the drive is off; what follows is no answer
                before = final
    return answers


def worst(answers: list[Step]) -> Step:
    """The first trip, or else the largest overshoot."""
    return max(answers, key=lambda step: (step.fault_word != 0, 0.0 if step.fault_word else step.overshoot))
