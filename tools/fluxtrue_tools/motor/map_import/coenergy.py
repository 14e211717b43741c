# SPDX-License-Identifier: Apache-2.0
"""One smooth co-energy through measured or computed flux linkages.

The flux linkages of a lossless machine are the slopes of its co-energy W: psi_d = dW/di_d, psi_q = dW/di_q, and
W(i_d, -i_q) = W(i_d, i_q). W is a tensor product of uniform B-splines of degree 4, even in i_q, found by penalised
least squares (P. Eilers, B. Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11, 1996):
psi_d, psi_q and the torque of all points against the third derivatives of W, so that where there are no points the
inductances stay what they are at the last one. The weight of the third derivatives minimises the generalised cross-
validation (P. Craven, G. Wahba, "Smoothing noisy data with spline functions", Numerische Mathematik 31, 1979).

Flux linkages that are not the slopes of one energy can only be met in the mean. The torque, 1.5 p (psi_d i_q - psi_q
i_d), is 1.5 p times the slope of W along a circle of constant current. Its weight keeps the torque; the change goes
to the other component of the flux, the one along the current. Errors at small currents weigh more, so that the flux
of the magnet alone and the torque per ampere stay as well.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cholesky, eigh, solve_triangular

from fluxtrue_tools.motor.flux_model import Array

DEGREE = 4
INTERVALS_MIN, INTERVALS_MAX = 4, 24  # over the longer side of the plane
INTERVALS_PER_POINT = 0.9  # of the square root of the number of points, each of which gives three equations
INTERVALS_SEPARATE = 0.6  # the same for one surface, to which each point gives one
SMALL = 0.1  # of i_max: above it an error of the flux weighs as 1/i, for the torque there is less at small currents
TORQUE_WEIGHT = 10.0  # of an error of the flux across the current, over that of one along it
SMOOTHING = 10.0 ** np.arange(-12.0, 6.1, 0.5)  # candidates, relative to the points' share
SCORE_SLACK = 1.05  # the least smoothing that is nearly as good: a detail of the source is kept rather than lost
MIDDLE = 1e-4  # the candidate whose equations are decomposed: all others follow from its eigenvalues
FLOOR = 1e-15  # relative: what the computation cannot resolve
NOISE_MIN = 1e-5  # of the rms flux: no measured or computed map is more exact


@dataclass(frozen=True)
class Points:
    """Flux linkages at points in any order, in the frame of flux_map.csv."""

    i_d: Array
    i_q: Array
    psi_d: Array
    psi_q: Array
    torque: Array | None = None

    def __len__(self) -> int:
        return len(self.i_d)

    def where(self, chosen: Array) -> "Points":
        """Some of the points."""
        torque = None if self.torque is None else self.torque[chosen]
        return Points(self.i_d[chosen], self.i_q[chosen], self.psi_d[chosen], self.psi_q[chosen], torque)


class _Axis:
    """B-splines of one current, in units of i_max; even or odd ones if the axis is symmetric."""

    def __init__(self, low: float, high: float, intervals: int, parity: int = 0) -> None:
        self.step = (high - low) / intervals
        self.knots = low + self.step * np.arange(-DEGREE, intervals + DEGREE + 1)
        whole = np.eye(intervals + DEGREE)
        if parity:
            half = whole[:, : len(whole) // 2]
            middle = whole[:, len(whole) // 2 : (len(whole) + 1) // 2]  # its own mirror image, if there is one
            whole = np.hstack((half + parity * half[::-1], middle[:, : 1 if parity > 0 else 0]))
        self.fold = whole

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return int(self.fold.shape[1])

    def roughness(self, order: int) -> Array:
        """The order-th derivative, as differences of the coefficients, squared and summed over the axis."""
        rows = np.diff(np.eye(len(self.fold)), order, axis=0) @ self.fold / self.step**order
        return np.asarray(rows.T @ rows * self.step)

    def rows(self, x: Array, order: int) -> tuple[Array, Array, sparse.csr_matrix]:
        """The order-th derivatives at x: columns and values of splines of lower degree, and those from the splines."""
        inside = np.clip(x, self.knots[DEGREE], self.knots[-DEGREE - 1])
        knots, degree, chain = self.knots, DEGREE, self.fold
        for _ in range(order):
            chain = np.diff(chain, axis=0) * degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])[:, None]
            knots, degree = knots[1:-1], degree - 1
        splines = BSpline.design_matrix(inside, knots, degree)
        shape = len(x), degree + 1
        return splines.indices.reshape(shape), splines.data.reshape(shape), sparse.csr_matrix(chain)


class Basis:
    """The tensor product over a plane (i_d from, i_d to, largest i_q) in units of i_max."""

    def __init__(self, plane: tuple[float, float, float], intervals: int, parity: int = 1) -> None:
        low, high, reach = plane
        step = max(high - low, reach) / intervals
        self.d = _Axis(low, high, max(INTERVALS_MIN, round((high - low) / step)))
        self.q = _Axis(-reach, reach, 2 * max(INTERVALS_MIN, round(reach / step)), parity)
        self.count = self.d.count * self.q.count

    def rows(self, u_d: Array, u_q: Array, nd: int, nq: int) -> sparse.csr_matrix:
        """Derivatives of all products."""
        at_d, value_d, chain_d = self.d.rows(u_d, nd)
        at_q, value_q, chain_q = self.q.rows(u_q, nq)
        columns = at_d[:, :, None] * chain_q.shape[0] + at_q[:, None, :]
        values = value_d[:, :, None] * value_q[:, None, :]
        ends = np.arange(len(u_d) + 1) * (at_d.shape[1] * at_q.shape[1])
        shape = len(u_d), chain_d.shape[0] * chain_q.shape[0]
        products = sparse.csr_matrix((values.ravel(), columns.ravel(), ends), shape=shape)
        return sparse.csr_matrix(products @ sparse.kron(chain_d, chain_q, format="csr"))

    def penalty(self) -> Array:
        """All third derivatives, squared."""
        terms = ((3, 0, 1.0), (2, 1, 3.0), (1, 2, 3.0), (0, 3, 1.0))
        parts = [factor * np.kron(self.d.roughness(nd), self.q.roughness(nq)) for nd, nq, factor in terms]
        return np.asarray(np.sum(parts, axis=0))


class System:
    """Normal equations of a penalised fit."""

    def __init__(self, count: int) -> None:
        self.matrix, self.right = np.zeros((count, count)), np.zeros(count)
        self.power, self.total = 0.0, 0

    def add(self, rows: sparse.csr_matrix | Array, values: Array, counted: bool = True) -> None:
        """Some more equations; those that follow from others do not count."""
        squares = rows.T @ rows
        self.matrix += squares.toarray() if sparse.issparse(squares) else squares
        self.right += rows.T @ values
        self.power += float(values @ values)
        self.total += len(values) if counted else 0

    def solve(self, penalty: Array, slack: float = SCORE_SLACK, price: float = 1.0, least: float = 0.0,
              accepted: Callable[[Array], bool] = lambda _: True) -> tuple[float, Array]:  # fmt: skip
        """Effective unknowns and solution, with the smoothing that generalised cross-validation chooses.

        slack      of its score, for the least smoothing that is taken instead of the best
        price      of an effective unknown in the score, in equations
        least      smoothing that is a candidate
        accepted   solutions, of which the best is taken; the best of all if there is none
        """
        penalty = penalty * (np.trace(self.matrix) / np.trace(penalty))
        size = len(self.matrix)
        base = self.matrix + MIDDLE * penalty + FLOOR * np.trace(self.matrix) / size * np.eye(size)
        lower = cholesky(base, lower=True)
        half = solve_triangular(lower, penalty, lower=True)
        stiffness, modes = eigh(solve_triangular(lower, half.T, lower=True))
        modes = solve_triangular(lower, modes, lower=True, trans="T")  # base = identity, penalty = stiffness
        loads, found = modes.T @ self.right, []
        for smoothing in SMOOTHING[least <= SMOOTHING]:
            gains = 1.0 / np.maximum(1.0 + (smoothing - MIDDLE) * stiffness, FLOOR)
            x = modes @ (gains * loads)
            unknowns = float(np.sum(gains * np.maximum(1.0 - MIDDLE * stiffness, 0.0)))
            error = max(self.power - float(2.0 * x @ self.right - x @ self.matrix @ x), 0.0) + NOISE_MIN**2 * self.power
            found.append((error / max(self.total - price * unknowns, 1.0) ** 2, unknowns, x))
        found = [one for one in found if accepted(one[2])] or found
        best = min(score for score, _, _ in found)
        return next((unknowns, x) for score, unknowns, x in found if score <= slack * best)


class CoEnergy:
    """psi_d and psi_q as slopes of one energy (a FluxModel). Beyond the fitted plane the value at its edge holds."""

    def __init__(self, basis: Basis, coefficients: Array, i_max_A: float) -> None:
        self._basis, self._coefficients, self._i_max = basis, coefficients, i_max_A

    def _slope(self, i_d: ArrayLike, i_q: ArrayLike, nd: int, nq: int) -> Array:
        d, q = np.broadcast_arrays(np.asarray(i_d, float), np.asarray(i_q, float))
        rows = self._basis.rows(d.ravel() / self._i_max, q.ravel() / self._i_max, nd, nq)
        return np.asarray(rows @ self._coefficients).reshape(d.shape) / self._i_max ** (nd + nq)

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the d axis or a derivative of it."""
        return self._slope(i_d, i_q, nd + 1, nq)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the q axis or a derivative of it."""
        return self._slope(i_d, i_q, nd, nq + 1)


class Separate:
    """psi_d and psi_q as two separate surfaces (a FluxModel), from which the reciprocity of the points follows."""

    def __init__(self, surfaces: tuple[tuple[Basis, Array], tuple[Basis, Array]], i_max_A: float) -> None:
        self._surfaces, self._i_max = surfaces, i_max_A

    def _value(self, which: int, i_d: ArrayLike, i_q: ArrayLike, nd: int, nq: int) -> Array:
        d, q = np.broadcast_arrays(np.asarray(i_d, float), np.asarray(i_q, float))
        basis, coefficients = self._surfaces[which]
        rows = basis.rows(d.ravel() / self._i_max, q.ravel() / self._i_max, nd, nq)
        return np.asarray(rows @ coefficients).reshape(d.shape) / self._i_max ** (nd + nq)

    def psi_d(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the d axis or a derivative of it."""
        return self._value(0, i_d, i_q, nd, nq)

    def psi_q(self, i_d: ArrayLike, i_q: ArrayLike, nd: int = 0, nq: int = 0) -> Array:
        """Flux linkage of the q axis or a derivative of it."""
        return self._value(1, i_d, i_q, nd, nq)


@dataclass(frozen=True)
class Fit:
    """The energy, and what it left of the points."""

    model: CoEnergy
    offset_Vs: float  # of psi_q without i_q: taken away
    unknowns: float  # effective number
    count: int  # of all coefficients
    psi_d_left: Array  # points minus fit, V·s
    psi_q_left: Array


def _plane(
    points: Points, i_max_A: float, per_point: float = INTERVALS_PER_POINT
) -> tuple[tuple[float, float, float], int]:
    """The plane to fit, with the current circle in it, and how finely."""
    plane = (min(float(points.i_d.min()) / i_max_A, -1.0), max(float(points.i_d.max()) / i_max_A, 0.0),
             max(float(np.abs(points.i_q).max()) / i_max_A, 1.0))  # fmt: skip
    places = len(np.unique(np.column_stack((points.i_d, np.abs(points.i_q))), axis=0))
    return plane, int(np.clip(per_point * np.sqrt(places), INTERVALS_MIN, INTERVALS_MAX))


def _pair(basis: Basis, u_d: Array, u_q: Array) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Rows of psi_d and psi_q; the constant of the energy (the first coefficient) becomes the offset of psi_q."""
    d, q = (basis.rows(u_d, u_q, *order)[:, 1:] for order in ((1, 0), (0, 1)))
    ones = np.ones((len(u_d), 1))
    return sparse.hstack((0.0 * ones, d), format="csr"), sparse.hstack((ones, q), format="csr")


def fit(points: Points, i_max_A: float) -> Fit:
    """The co-energy of all points over the current circle, and as far as the points reach."""
    basis = Basis(*_plane(points, i_max_A))
    scale = float(np.sqrt(np.mean(points.psi_d**2 + points.psi_q**2)))
    u_d, u_q = points.i_d / i_max_A, points.i_q / i_max_A
    d, q = _pair(basis, u_d, u_q)
    weight = 1.0 / (SMALL + np.hypot(u_d, u_q))
    psi_d, psi_q = weight * points.psi_d / scale, weight * points.psi_q / scale
    d, q = (sparse.diags(weight) @ rows for rows in (d, q))
    system = System(basis.count)
    system.add(d, psi_d)
    system.add(q, psi_q)
    across = sparse.csr_matrix(TORQUE_WEIGHT * (sparse.diags(u_q) @ d - sparse.diags(u_d) @ q))
    system.add(across, TORQUE_WEIGHT * (u_q * psi_d - u_d * psi_q), counted=False)
    penalty = basis.penalty()
    penalty[0, :] = penalty[:, 0] = 0.0  # differences do not change when all coefficients lose the first one
    unknowns, x = system.solve(penalty)
    offset = float(x[0]) * scale
    x[0] = 0.0
    model = CoEnergy(basis, x * scale * i_max_A, i_max_A)
    d_left = points.psi_d - model.psi_d(points.i_d, points.i_q)
    q_left = points.psi_q - model.psi_q(points.i_d, points.i_q)
    return Fit(model, offset, unknowns, basis.count, d_left, q_left)


def fit_separately(points: Points, i_max_A: float) -> Separate:
    """Smooth surfaces through psi_d, even in i_q, and psi_q, odd in i_q, that need not belong to one energy."""
    plane, intervals = _plane(points, i_max_A, INTERVALS_SEPARATE)
    surfaces = []
    for psi, parity in ((points.psi_d, 1), (points.psi_q, -1)):
        basis = Basis(plane, intervals, parity)
        system = System(basis.count)
        system.add(basis.rows(points.i_d / i_max_A, points.i_q / i_max_A, 0, 0), psi)
        surfaces.append((basis, system.solve(basis.penalty())[1]))
    return Separate((surfaces[0], surfaces[1]), i_max_A)
