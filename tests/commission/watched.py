# SPDX-License-Identifier: Apache-2.0
"""A drive in software in the loop of which a test sees how the rotor of the plant moves."""

from collections.abc import Mapping

import numpy as np

from fluxtrue_tools.commission.metered import Metered
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop


class Watched(Metered):
    """Also keeps the swing of each burst and the speed before it."""

    def __init__(self, loop: Loop) -> None:
        super().__init__(loop)
        self.swings_rad: list[float] = []  # of the shaft, from one end to the other
        self.starts_rad_s: list[float] = []  # speed before the pulses

    def pulse(self, values: Mapping[str, float]) -> Array:
        start_rad_s = self._loop.get("truth.speed_rad_s")
        rows = super().pulse(values)
        if values["pulses_reversals"] > 1.0:
            turned = self.turned_rad[-1]
            self.starts_rad_s.append(start_rad_s)
            self.swings_rad.append(float(np.ptp(turned)) if turned.size else 0.0)
        return rows
