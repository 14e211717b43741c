# SPDX-License-Identifier: Apache-2.0
"""A drive in software in the loop of which a campaign sees what the simulated machine itself does."""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fluxtrue_tools.commission.drive import PULSE, Capture, SoftwareInTheLoop
from fluxtrue_tools.commission.steps import Step
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop

TRUTH = ("truth.i_d_A", "truth.i_q_A", "truth.speed_rad_s", "truth.theta_m_rad")


class Metered(SoftwareInTheLoop):
    """Adds up time and squared current of the machine and keeps its largest speed and current, and how far the rotor
    moved in each burst. The half waves that brake the rotor before a burst are none.

    What a commissioning sees of the drive is unchanged.
    """

    def __init__(self, loop: Loop) -> None:
        super().__init__(loop)
        self.seconds, self.square_A2s = 0.0, 0.0
        self.fastest_rad_s, self.largest_A = 0.0, 0.0  # mechanical
        self._angles_rad: list[Array] | None = None  # of the shaft, while a burst is made
        self.turned_rad: list[Array] = []  # by the shaft in each burst, from where it stood
        self.of_steps: dict[str, list[float]] = {}  # the same, of each finished step

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """As SoftwareInTheLoop.capture()."""
        rows = self._recorded([*map(self._allowed, names), *TRUTH], periods)
        i_dq_A, speed_rad_s, theta_rad = rows[:, -4:-2], rows[:, -2], rows[:, -1]
        self.seconds += periods * self.period_s
        squares = np.square(i_dq_A).sum(axis=1)
        self.square_A2s += float(squares.sum()) * self.period_s
        self.largest_A = max(self.largest_A, math.sqrt(float(squares.max(initial=0.0))))
        self.fastest_rad_s = max(self.fastest_rad_s, float(np.abs(speed_rad_s).max(initial=0.0)))
        if self._angles_rad is not None:
            self._angles_rad.append(theta_rad)
        return rows[:, : -len(TRUTH)]

    def pulse(self, values: Mapping[str, float]) -> Array:
        """As SoftwareInTheLoop.pulse()."""
        self._angles_rad = []
        rows = super().pulse(values)
        angle = np.unwrap(np.concatenate(self._angles_rad))[rows[:, -1] == PULSE]
        self._angles_rad = None
        if values["pulses_reversals"] > 1.0:
            self.turned_rad.append(angle - angle[:1])
        return rows

    @property
    def moves_rad(self) -> list[float]:
        """The largest distance of the shaft from where it stood, of each burst."""
        return [float(np.abs(turned).max(initial=0.0)) for turned in self.turned_rad]

    @contextlib.contextmanager
    def in_step(self, _: Capture, step: Step) -> Iterator[None]:
        """The context of a step for steps.run()."""
        before = len(self.turned_rad)
        yield
        self.of_steps[step.name] = self.moves_rad[before:]
