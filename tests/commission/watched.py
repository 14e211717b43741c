# SPDX-License-Identifier: Apache-2.0
"""A drive in software in the loop of which a test sees how the rotor of the plant moves."""

from collections.abc import Mapping, Sequence

import numpy as np

from fluxtrue_tools.commission.drive import PULSE, SoftwareInTheLoop
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop


class Watched(SoftwareInTheLoop):
    """With the plant's true angle beside what is recorded; one value for each burst, of the shaft. The half waves that
    brake the rotor before a burst are none."""

    def __init__(self, loop: Loop) -> None:
        super().__init__(loop)
        self.angles: list[Array] = []
        self.swings_rad: list[float] = []  # from one end to the other
        self.moves_rad: list[float] = []  # from where the rotor stood
        self.starts_rad_s: list[float] = []  # speed before the pulses

    def capture(self, names: Sequence[str], periods: int) -> Array:
        self._loop.record([*names, "truth.theta_m_rad"])
        rows = self._loop.run(periods)
        self.angles.append(rows[:, -1])
        return np.asarray(rows[:, :-1])

    def pulse(self, values: Mapping[str, float]) -> Array:
        if values["pulses_reversals"] == 1.0:
            return super().pulse(values)
        self.angles = []
        self.starts_rad_s.append(self._loop.get("truth.speed_rad_s"))
        rows = super().pulse(values)
        angle = np.unwrap(np.concatenate(self.angles))[rows[:, -1] == PULSE]
        self.swings_rad.append(float(np.ptp(angle)) if angle.size else 0.0)
        self.moves_rad.append(float(np.abs(angle - angle[0]).max()) if angle.size else 0.0)
        return rows
