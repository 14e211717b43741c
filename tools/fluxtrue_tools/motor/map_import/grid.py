# SPDX-License-Identifier: Apache-2.0
"""The rectangular grid of flux_map.csv, and where it lies beyond the points."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array, FluxModel
from fluxtrue_tools.motor.map_import.coenergy import Points
from fluxtrue_tools.motor.map_import.frame import POINTS_MIN

KEPT_BEYOND = 1.15  # of i_max, or the first point beyond i_max: points further out do not describe the circle
KEPT_ABOVE = 0.3  # of i_max, on the magnetising side
OUTSIDE_MAX = 0.5  # of the current circle without points
EDGE = 0.01  # of the size: the chord between two points on a circle is inside it, and so is a point on the edge


@dataclass(frozen=True)
class Grid:
    """Nodes [i_d][i_q] over i_d from -i_max to 0 and i_q from 0 to i_max."""

    id_A: Array
    iq_A: Array
    psi_d_Vs: Array
    psi_q_Vs: Array
    extrapolated: Array  # bool
    circle_outside: float  # share of the current circle that lies beyond the points
    reach_A: float  # of the points from the origin, where they reach least


class Cover:
    """The convex hull of the points and their mirror images."""

    def __init__(self, points: Points, path: Path) -> None:
        both = np.vstack((np.column_stack((points.i_d, points.i_q)), np.column_stack((points.i_d, -points.i_q))))
        try:
            self._hull = Delaunay(both.mean(axis=0) + (1.0 + EDGE) * (both - both.mean(axis=0)))
        except (QhullError, ValueError):
            raise FluxtrueError(f"{path}: all points lie on a line, wanted: points over i_d and i_q") from None

    def holds(self, i_d: Array, i_q: Array) -> Array:
        """Whether a current lies between points."""
        places = np.column_stack((i_d.ravel(), i_q.ravel()))
        return np.asarray(self._hull.find_simplex(places) >= 0).reshape(i_d.shape)


def reach_of(points: Points) -> float:
    """The largest i_max for which the points cover i_d from -i_max to 0 and one half of i_q."""
    return float(min(-points.i_d.min(), np.abs(points.i_q).max()))


def _rounded_down(value: float) -> float:
    step = 10.0 ** (np.floor(np.log10(value)) - 3.0)
    return float(np.floor(value / step * (1.0 + 1e-9)) * step)


def default_i_max(points: Points, path: Path) -> float:
    """The largest circle that the points reach along both axes."""
    reach = reach_of(points)
    if reach <= 0.0:
        raise FluxtrueError(f"{path}: i_d from {points.i_d.min():g} A in our frame, wanted: points at i_d below 0")
    return _rounded_down(reach)


def _limit(sizes: Array, i_max_A: float) -> float:
    """How far out points are kept along an axis."""
    beyond = sizes[sizes >= i_max_A * (1.0 - 1e-9)]
    return max(KEPT_BEYOND * i_max_A, float(beyond.min()) if len(beyond) else 0.0) * (1.0 + 1e-9)


def chosen(points: Points, i_max_A: float, path: Path) -> Points:
    """Points in and about the current circle's half plane."""
    inside = (-points.i_d <= _limit(-points.i_d, i_max_A)) & (points.i_d <= KEPT_ABOVE * i_max_A)
    inside &= np.abs(points.i_q) <= _limit(np.abs(points.i_q), i_max_A)
    kept = points.where(inside)
    if len(kept) < POINTS_MIN:
        raise FluxtrueError(
            f"{path}: {len(kept)} points within machine.i_max_A = {i_max_A:g} A and i_d <= 0, allowed: from "
            f"{POINTS_MIN}"
        )
    return kept


def _circle(i_max_A: float) -> tuple[Array, Array]:
    d, q = np.meshgrid(np.linspace(-i_max_A, 0.0, 101), np.linspace(0.0, i_max_A, 101), indexing="ij")
    inside = np.hypot(d, q) <= i_max_A * (1.0 + 1e-9)
    return d[inside], q[inside]


def make_grid(model: FluxModel, points: Points, i_max_A: float, nodes: int, path: Path) -> Grid:
    """The fitted surface on the grid, with the nodes beyond the points marked."""
    cover = Cover(points, path)
    outside = float(np.mean(~cover.holds(*_circle(i_max_A))))
    if outside > OUTSIDE_MAX:
        raise FluxtrueError(
            f"{path}: no points in {100 * outside:.0f} % of the circle of machine.i_max_A = {i_max_A:g} A, allowed: up "
            f"to {100 * OUTSIDE_MAX:.0f} %; the points reach i_d = {points.i_d.min():.4g} A, |i_q| = "
            f"{np.abs(points.i_q).max():.4g} A"
        )
    id_A, iq_A = np.linspace(-i_max_A, 0.0, nodes), np.linspace(0.0, i_max_A, nodes)
    d, q = np.meshgrid(id_A, iq_A, indexing="ij")
    psi_q = np.asarray(model.psi_q(d, q))
    psi_q[:, 0] = 0.0  # by symmetry; the sum of the splines leaves 1e-17
    return Grid(id_A, iq_A, np.asarray(model.psi_d(d, q)), psi_q, ~cover.holds(d, q), outside, reach_of(points))
