# SPDX-License-Identifier: Apache-2.0
"""Errors of the samples of a burst: (CM-31), (CM-32).

The noise of a current is one sample's own. Where a phase current is so small that noise hides its sign, the voltage of
its leg is uncertain for a period, and all later flux linkages of the burst contain the same error.
"""

import numpy as np
from scipy import linalg

from fluxtrue_tools.commission.bursts import Raw, mean_sign
from fluxtrue_tools.motor.flux_model import Array

NODES, SHARES = np.polynomial.hermite_e.hermegauss(5)  # of a normal distribution
CERTAIN = 1e-3  # variance of a sign that is known


def sign_variance(i: Array, noise_A: float) -> Array:
    """Of the mean sign of each period between two samples of a current, each with its own noise."""
    begins = i[:-1, None, None] + noise_A * NODES[:, None]
    ends = i[1:, None, None] + noise_A * NODES
    signs, shares = mean_sign(begins, ends), np.outer(SHARES, SHARES) / SHARES.sum() ** 2
    means = np.sum(shares * signs, axis=(1, 2))
    return np.asarray(np.sum(shares * signs**2, axis=(1, 2)) - means**2)


def _of_phase(raw: Raw, noise_A: float, k: int) -> Array:
    """Change of psi, per volt that a leg loses, by one standard deviation of each uncertain sign of a phase."""
    axis = np.exp(2j * np.pi * k / 3.0)
    variance = sign_variance((raw.i * np.exp(1j * raw.theta) * np.conj(axis)).real, noise_A)
    at = np.flatnonzero(variance > CERTAIN)
    since = np.arange(len(raw.i))[:, None] > at
    back = np.exp(-1j * raw.theta)
    return np.asarray(2.0 / 3.0 * axis * raw.period_s * np.sqrt(variance[at]) * since * back[:, None])


def of_signs(raw: Raw, noise_A: float) -> Array:
    """A column for each uncertain sign: their errors are independent."""
    return np.hstack([_of_phase(raw, noise_A, k) for k in range(3)])


def of_phases(raw: Raw, noise_A: float) -> Array:
    """A column for each phase: all its uncertain signs are wrong in the same direction."""
    return np.column_stack([_of_phase(raw, noise_A, k).sum(axis=1) for k in range(3)])


class Noise:
    """Standard deviation of each equation, and errors that several have in common; an infinite one: not used."""

    def __init__(self, sigma: Array, common: Array) -> None:
        self._used = np.isfinite(sigma)
        self._sigma = sigma[self._used, None]
        # The faster driver gesdd, numpy's only one, does not converge for some finite matrices.
        relative = common[self._used] / self._sigma
        self._along, sizes, _ = linalg.svd(relative, full_matrices=False, lapack_driver="gesvd")
        self._less = 1.0 - 1.0 / np.sqrt(1.0 + sizes[:, None] ** 2)

    def whitened(self, rows: Array) -> Array:
        """Equations whose errors are independent and have a variance of one: (CM-32)."""
        own = rows[self._used] / self._sigma
        return np.asarray(own - self._along @ (self._less * (self._along.T @ own)))
