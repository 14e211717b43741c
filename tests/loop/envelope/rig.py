# SPDX-License-Identifier: Apache-2.0
"""One simulated drive at an imposed speed, recorded by name. The torque is that of the plant."""

import math

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

NAMES = (
    "truth.torque_Nm", "truth.i_d_A", "truth.i_q_A", "truth.u_d_V", "truth.u_q_V", "truth.idc_A", "truth.vdc_V",
    "truth.electrical_W", "torque_commanded_Nm", "torque_max_Nm", "torque_estimated_Nm", "fault_word", "derating",
    "voltage_limited", "run_state",
)  # fmt: skip
RUNNING, FAULTED = 1, 2
OVER_CURRENT, OVER_VOLTAGE, UNDER_VOLTAGE, CURRENT_SUM, ANGLE = (1 << n for n in range(5))
CONTROL, PHASE_LOST, CURRENT_STUCK, OVER_SPEED, ANGLE_OFFSET, TORQUE, TEMPERATURE = (1 << n for n in range(8, 15))


class Rig:
    """A drive with the plant of its motor data, 0.5 A rms of current noise, and the given plant parameters changed."""

    def __init__(self, motor: Motor, rpm: float, torque_Nm: float = 0.0, enable: bool = True, **plant: float) -> None:
        parameters = (
            motor.plant
            | {"imposed_speed": 1.0, "speed_rad_s": rpm * math.pi / 30.0, "current_noise_A_rms": 0.5}
            | plant
        )
        self.loop = Loop(motor.library, parameters, motor.flux_map)
        self.loop.record(NAMES)
        self.loop.set("torque_requested_Nm", torque_Nm)
        self.loop.set("enable", float(enable))

    def set(self, **values: float) -> "Rig":
        """Set values by name; a name that begins with plant_ belongs to the plant."""
        for name, value in values.items():
            self.loop.set(name.replace("plant_", "plant.", 1) if name.startswith("plant_") else name, value)
        return self

    def run(self, seconds: float, **ramps: tuple[float, float]) -> "Trace":
        """Simulate and record every period; the ramps have names as in set()."""
        named = {n.replace("plant_", "plant.", 1): span for n, span in ramps.items()}
        return Trace(self.loop.run(round(seconds / self.loop.period_s), named), self.loop.period_s)

    def periods(self, ms: float) -> int:
        """How many PWM periods a time has."""
        return round(ms * 1e-3 / self.loop.period_s)

    def get(self, name: str) -> float:
        """The present value."""
        return self.loop.get(name)


class Trace:
    """What a run recorded: a row for each PWM period."""

    def __init__(self, rows: NDArray[np.float64], period_s: float) -> None:
        self._rows = rows
        self._period_ms = 1e3 * period_s

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self._rows[:, NAMES.index(name)]

    @property
    def torque(self) -> NDArray[np.float64]:
        """The plant's air-gap torque."""
        return self["truth.torque_Nm"]

    def settled(self, name: str = "truth.torque_Nm", share: float = 0.25) -> float:
        """Mean over the last part of the run."""
        values = self[name]
        return float(values[-max(int(len(values) * share), 1) :].mean())

    @property
    def voltage(self) -> float:
        """Magnitude of the acting voltage, mean of the last quarter of the run."""
        u = np.hypot(self["truth.u_d_V"], self["truth.u_q_V"])
        return float(u[-len(u) // 4 :].mean())

    @property
    def faults(self) -> int:
        return int(self["fault_word"][-1])

    def row(self, ms: float) -> int:
        """The row at a time after the start of the run; negative: before its end."""
        return round(ms / self._period_ms)

    def first_ms(self, found: NDArray[np.bool_]) -> float:
        """Milliseconds from the start of the run to the first row of a condition; NaN: none."""
        return float(np.argmax(found)) * self._period_ms if found.any() else math.nan

    def fault_ms(self, fault: int) -> float:
        """Milliseconds from the start of the run to the fault; NaN: none."""
        return self.first_ms(self["fault_word"].astype(int) & fault > 0)
