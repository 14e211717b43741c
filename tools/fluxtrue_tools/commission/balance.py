# SPDX-License-Identifier: Apache-2.0
"""Gain balance of the three current sensors: (CM-23), (CM-24).

The three phase currents sum to zero. Apart from its offset, the sum of the sensors therefore shows only the differences
of their gains, not the gain that all three have in common.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fluxtrue_tools.commission.bursts import Raw
from fluxtrue_tools.motor.flux_model import Array

PHASES = np.exp(2j * np.pi * np.arange(3) / 3.0)


@dataclass(frozen=True)
class Balance:
    """Errors of the gains without their mean."""

    vector: complex  # a third of their sum, each along the axis of its phase
    sigma: float  # of a phase's gain
    noise_A: float  # of one component of a sample's current

    @property
    def gains(self) -> Array:
        """Relative error of each phase against the mean of the three."""
        return 2.0 * (self.vector * np.conj(PHASES)).real

    def corrected(self, raw: Raw) -> Raw:
        """The currents that sensors of equal gains would show."""
        turn = np.exp(1j * raw.theta)
        return replace(raw, i=raw.i - np.conj(self.vector * raw.i * turn) / turn)


def measure(raws: Sequence[Raw]) -> Balance:
    """Least squares over the samples of all bursts: what the sum of the phases has of each component."""
    i_s = np.concatenate([raw.i * np.exp(1j * raw.theta) for raw in raws])
    zero = np.concatenate([raw.zero for raw in raws])
    matrix = np.column_stack((i_s.real, i_s.imag, np.ones(len(i_s))))
    x, *_ = np.linalg.lstsq(matrix, zero, rcond=None)
    left = zero - matrix @ x
    variance = float(left @ left) / (len(zero) - len(x))
    covariance = np.linalg.inv(matrix.T @ matrix) * variance
    worst = float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2]).max()))
    noise_A = math.sqrt(2.0 * variance)  # zero is a mean of three: it has half of the variance of a component
    return Balance(complex(x[0], x[1]), 2.0 * worst, noise_A)
