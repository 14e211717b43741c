# SPDX-License-Identifier: Apache-2.0
"""Bicubic splines with common knots at many points, bit for bit as FITPACK evaluates them one by one.

FITPACK searches the cell and works out the eight B-splines of a point anew for each value. Both flux linkages have the
same knots, and Newton's method asks for four values at each point; here they share cell and B-splines, and NumPy works
on a few thousand points at once.

Source  de Boor's recursion in FITPACK's fpbspl, the sum over the cell's 16 coefficients in its fpbisp, in their order
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import RectBivariateSpline

Array = NDArray[np.float64]
Levels = tuple[NDArray[np.intp], list[list[Array]]]

DEGREE: Final = 3
MANY: Final = 1500  # points, below which SciPy's own call takes less time than some 200 calls of NumPy
CHUNK: Final = 4096  # points, whose arrays fit the processor's cache


def _levels(knots: Array, x: Array) -> Levels:
    """The interval of each x, and the B-splines of degree 0 to 3 that are not zero in it."""
    at = np.clip(np.searchsorted(knots, x, side="right") - 1, DEGREE, len(knots) - DEGREE - 2)
    near = {k: np.take(knots, at + k) for k in range(1 - DEGREE, DEGREE + 1)}
    above = {k: near[k] - x for k in range(1, DEGREE + 1)}
    below = {k: x - near[k] for k in range(1 - DEGREE, 1)}
    levels = [[np.ones_like(x)]]
    for j in range(1, DEGREE + 1):
        new: list[Array] = [np.zeros_like(x)]
        for i, old in enumerate(levels[-1], start=1):
            share = old / (near[i] - near[i - j])
            new[-1] = new[-1] + share * above[i]
            new.append(share * below[i - j])
        levels.append(new)
    return at, levels


class Axis:
    """One coordinate of many points, with its interval and B-splines."""

    def __init__(self, knots: Array, x: Array) -> None:
        self.x = x
        self.levels = [_levels(knots, x[k : k + CHUNK]) for k in range(0, len(x), CHUNK)]


class Place:
    """The points at which the last values were wanted: the next ones often belong to the same, or to the same i_d."""

    def __init__(self) -> None:
        self._last: dict[int, Axis] = {}

    def axis(self, number: int, knots: Array, x: Array) -> Axis:
        """This coordinate, worked out once for as long as it does not change."""
        last = self._last.get(number)
        if last is None or not np.array_equal(last.x, x):
            last = self._last[number] = Axis(knots, x)
        return last


class Bicubic:
    """One spline and its derivatives; place: common to the splines with these knots."""

    def __init__(self, spline: RectBivariateSpline, place: Place) -> None:
        self.spline, self.place = spline, place
        self.knots_x, self.knots_y = spline.get_knots()
        self._coefficients: dict[tuple[int, int], Array] = {}

    def _of(self, nx: int, ny: int) -> Array:
        """The coefficients of a derivative, as a table over both axes."""
        if (nx, ny) not in self._coefficients:
            spline = self.spline.partial_derivative(nx, ny) if nx or ny else self.spline
            rows = len(self.knots_x) - DEGREE - 1 - nx
            self._coefficients[nx, ny] = np.ascontiguousarray(spline.get_coeffs()).reshape(rows, -1)
        return self._coefficients[nx, ny]

    def few(self, x: ArrayLike, y: ArrayLike, nx: int, ny: int) -> Array:
        """The derivative of these orders at a few points within the knots, by FITPACK itself."""
        return np.asarray(self.spline.ev(x, y, dx=nx, dy=ny))

    def __call__(self, x: Array, y: Array, nx: int, ny: int) -> Array:
        """The derivative of these orders, up to 2, at points within the knots."""
        if x.size < MANY:
            return self.few(x, y, nx, ny)
        axes = (self.place.axis(0, self.knots_x, x.flatten()), self.place.axis(1, self.knots_y, y.flatten()))
        parts = zip(*(axis.levels for axis in axes), strict=True)
        table = self._of(nx, ny)
        return np.concatenate([_sum(table, *part, nx, ny) for part in parts]).reshape(x.shape)


def _sum(table: Array, of_x: Levels, of_y: Levels, nx: int, ny: int) -> Array:
    """Sum of the coefficients of each point's cell, weighted by its B-splines."""
    flat, columns = table.ravel(), table.shape[1]
    first = (of_x[0] - DEGREE) * columns + (of_y[0] - DEGREE)
    total, term = np.zeros(len(first)), np.empty(len(first))
    for i, h_x in enumerate(of_x[1][DEGREE - nx]):
        for j, h_y in enumerate(of_y[1][DEGREE - ny]):
            np.take(flat, first + (i * columns + j), out=term, mode="clip")
            term *= h_x
            term *= h_y
            total += term
    return total
