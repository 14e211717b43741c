# SPDX-License-Identifier: Apache-2.0
"""Flux linkages over the current plane: a spline through a measured map, or three constants."""

from typing import Final, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator, RectBivariateSpline

from fluxtrue_tools.motor.bicubic import Bicubic, Place

Array = NDArray[np.float64]

MODELS_KEPT: Final = 8
"""Models of which a number is kept that depends on them alone; a model does not change once it is made."""


class FluxModel(Protocol):
    """psi_d(i_d, i_q), psi_q(i_d, i_q) and first derivatives; nd, nq = orders of derivative."""

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array: ...

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array: ...


class ConstantModel:
    """psi_d = psi_f + l_d i_d, psi_q = l_q i_q."""

    def __init__(self, ld_H: float, lq_H: float, psi_f_Vs: float) -> None:
        self.ld_H, self.lq_H, self.psi_f_Vs = ld_H, lq_H, psi_f_Vs

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        d, q = np.broadcast_arrays(np.asarray(i_d, float), np.asarray(i_q, float))
        if nd + nq == 0:
            return self.psi_f_Vs + self.ld_H * d
        return np.full(q.shape, self.ld_H if (nd, nq) == (1, 0) else 0.0)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        d, q = np.broadcast_arrays(np.asarray(i_d, float), np.asarray(i_q, float))
        if nd + nq == 0:
            return self.lq_H * q
        return np.full(d.shape, self.lq_H if (nd, nq) == (0, 1) else 0.0)


class _Surface:
    """One bicubic spline; outside its rectangle it continues with the slope of the edge."""

    def __init__(self, x: Array, y: Array, z: Array, place: Place) -> None:
        self._spline = Bicubic(RectBivariateSpline(x, y, z, kx=3, ky=3, s=0), place)
        self._box = (x[0], x[-1], y[0], y[-1])

    def __call__(self, x: ArrayLike, y: ArrayLike, nx: int, ny: int) -> Array:
        if isinstance(x, float) and isinstance(y, float) and self._holds(x, y):
            return self._spline.few(x, y, nx, ny)  # a plant in Python asks for one point at a time, often
        xa, ya = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        xc, yc = np.clip(xa, self._box[0], self._box[1]), np.clip(ya, self._box[2], self._box[3])
        z = self._spline(xc, yc, nx, ny)
        beyond = (xa != xc) | (ya != yc)
        if (nx, ny) == (0, 0) and np.any(beyond):
            z = z + (xa - xc) * self._spline(xc, yc, 1, 0) + (ya - yc) * self._spline(xc, yc, 0, 1)
        return np.asarray(z, dtype=np.float64)

    def _holds(self, x: float, y: float) -> bool:
        left, right, low, high = self._box
        return bool(left <= x <= right and low <= y <= high)


def _refine(axis: Array, values: Array, along: int, parts: int) -> tuple[Array, Array]:
    """Shape-preserving resampling of one axis: between nodes the result never leaves the nodes' range."""
    fine = np.interp(np.arange((len(axis) - 1) * parts + 1) / parts, np.arange(len(axis)), axis)
    return fine, np.asarray(PchipInterpolator(axis, values, axis=along)(fine))


class SplineModel:
    """Bicubic spline through a map of the full i_q plane; exact at the map's nodes."""

    def __init__(self, id_A: Array, iq_A: Array, psi_d_Vs: Array, psi_q_Vs: Array) -> None:
        place = Place()  # of both: they have the same knots
        self._d = _Surface(id_A, iq_A, psi_d_Vs, place)
        self._q = _Surface(id_A, iq_A, psi_q_Vs, place)
        self.shape_preserving = False
        if not self._rises(id_A, iq_A):
            place = Place()
            self._d = self._refined(id_A, iq_A, psi_d_Vs, place)
            self._q = self._refined(id_A, iq_A, psi_q_Vs, place)
            self.shape_preserving = True

    @staticmethod
    def _refined(x: Array, y: Array, z: Array, place: Place) -> _Surface:
        parts = 6
        xf, zx = _refine(x, z, 0, parts)
        yf, zxy = _refine(y, zx, 1, parts)
        return _Surface(xf, yf, zxy, place)

    def _rises(self, id_A: Array, iq_A: Array) -> bool:
        """Whether the spline rises everywhere: both incremental inductances are positive between the nodes, too."""
        x = np.interp(np.linspace(0, len(id_A) - 1, 4 * len(id_A) - 3), np.arange(len(id_A)), id_A)
        y = np.interp(np.linspace(0, len(iq_A) - 1, 4 * len(iq_A) - 3), np.arange(len(iq_A)), iq_A)
        d, q = np.meshgrid(x, y, indexing="ij")
        return bool(np.all(self.psi_d(d, q, nd=1) > 0) and np.all(self.psi_q(d, q, nq=1) > 0))

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        return self._d(i_d, i_q, nd, nq)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        return self._q(i_d, i_q, nd, nq)


def torque(model: FluxModel, pole_pairs: int, i_d: ArrayLike, i_q: ArrayLike) -> Array:
    """1.5 p (psi_d i_q - psi_q i_d), N·m."""
    d, q = np.asarray(i_d, float), np.asarray(i_q, float)
    return np.asarray(1.5 * pole_pairs * (model.psi_d(d, q) * q - model.psi_q(d, q) * d))


def flux(model: FluxModel, i_d: ArrayLike, i_q: ArrayLike) -> Array:
    """|psi|, V·s."""
    return np.hypot(model.psi_d(i_d, i_q), model.psi_q(i_d, i_q))
