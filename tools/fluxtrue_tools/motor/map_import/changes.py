# SPDX-License-Identifier: Apache-2.0
"""What the fit changed: flux, torque, symmetry, reciprocity."""

from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.motor.flux_model import Array, FluxModel
from fluxtrue_tools.motor.map_import.coenergy import Points

TORQUE_WANTED = 0.002  # of the largest torque


@dataclass(frozen=True)
class Changes:
    """The map minus its points, inside the current circle."""

    inside: Array  # bool, over the points
    psi_d_Vs: Array
    psi_q_Vs: Array
    torque: Array  # of the largest torque
    torque_even: float  # largest part of the points' own torque that is the same for +i_q and -i_q, the same share
    largest_Nm: float
    source: str  # of the torque

    def worst(self, values: Array) -> float:
        """Largest change inside the circle."""
        return float(np.abs(values[self.inside]).max())

    def rms(self, values: Array) -> float:
        """Rms change inside the circle."""
        return float(np.sqrt(np.mean(np.square(values[self.inside]))))


def _even_part(points: Points, torque: Array) -> Array:
    """(T(i_q) + T(-i_q))/2 where both points are there, else 0: no map that is symmetric in i_q can have it."""
    scale = max(float(np.abs(points.i_q).max()), float(np.abs(points.i_d).max())) * 1e-9
    at = {(round(d / scale), round(q / scale)): t for d, q, t in zip(points.i_d, points.i_q, torque, strict=True)}
    mirror = [at.get((round(d / scale), round(-q / scale))) for d, q in zip(points.i_d, points.i_q, strict=True)]
    return np.array([0.0 if m is None else 0.5 * (t + m) for t, m in zip(torque, mirror, strict=True)])


def changes(points: Points, model: FluxModel, pole_pairs: int, i_max_A: float) -> Changes:
    """Compare the map, as motor build reads it, with the points; the torque is the file's own where it has one."""
    d, q = points.i_d, points.i_q
    psi_d, psi_q = model.psi_d(d, q), model.psi_q(d, q)
    torque = points.torque
    own = torque is not None
    if torque is None:
        torque = 1.5 * pole_pairs * (points.psi_d * q - points.psi_q * d)
    inside = (np.hypot(d, q) <= i_max_A * (1.0 + 1e-9)) & (d <= 1e-9 * i_max_A)
    if not inside.any():
        inside = np.ones(len(d), dtype=bool)
    largest = float(np.abs(torque[inside]).max()) or 1.0
    even = _even_part(points, torque)
    error = (1.5 * pole_pairs * (psi_d * q - psi_q * d) - (torque - even)) / largest
    return Changes(inside, psi_d - points.psi_d, psi_q - points.psi_q, error,
                   float(np.abs(even[inside]).max()) / largest, largest,
                   "the file's own" if own else "the fluxes'")  # fmt: skip
