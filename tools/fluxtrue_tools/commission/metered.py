# SPDX-License-Identifier: Apache-2.0
"""A drive in software in the loop of which a campaign sees what the simulated machine itself does."""

import math
from collections.abc import Sequence

import numpy as np

from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop

TRUTH = ("truth.i_d_A", "truth.i_q_A", "truth.speed_rad_s")


class Metered(SoftwareInTheLoop):
    """Adds up time and squared current of the machine and keeps its largest speed and current.

    What a commissioning sees of the drive is unchanged.
    """

    def __init__(self, loop: Loop) -> None:
        super().__init__(loop)
        self.seconds, self.square_A2s = 0.0, 0.0
        self.fastest_rad_s, self.largest_A = 0.0, 0.0  # mechanical

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """As SoftwareInTheLoop.capture()."""
        rows = self._recorded([*map(self._allowed, names), *TRUTH], periods)
        self.seconds += periods * self.period_s
        squares = np.square(rows[:, -3:-1]).sum(axis=1)
        self.square_A2s += float(squares.sum()) * self.period_s
        self.largest_A = max(self.largest_A, math.sqrt(float(squares.max(initial=0.0))))
        self.fastest_rad_s = max(self.fastest_rad_s, float(np.abs(rows[:, -1]).max(initial=0.0)))
        return rows[:, :-3]
