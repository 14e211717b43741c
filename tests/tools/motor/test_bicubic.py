# SPDX-License-Identifier: Apache-2.0
"""Bicubic splines at many points against SciPy's own evaluation, bit for bit."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from fluxtrue_tools.motor.bicubic import CHUNK, MANY, Bicubic, Place
from fluxtrue_tools.motor.flux_model import SplineModel

Array = NDArray[np.float64]
RANDOM = np.random.default_rng(7)
X, Y = np.linspace(-300.0, 0.0, 26), np.sort(np.append(RANDOM.uniform(-300.0, 300.0, 29), (-300.0, 300.0)))
Z = 0.08 + 2e-4 * X[:, None] - 2e-7 * Y**2 + RANDOM.normal(0.0, 1e-3, (X.size, Y.size))
PLANE = RectBivariateSpline(X, Y, Z, kx=3, ky=3, s=0)


def points(count: int) -> tuple[Array, Array]:
    """Random points, and among them all nodes, where one cell ends and the next begins, with edges and corners."""
    nodes = np.repeat(X, Y.size), np.tile(Y, X.size)
    x, y = RANDOM.uniform(-300.0, 0.0, count), RANDOM.uniform(-300.0, 300.0, count)
    return np.concatenate((x, nodes[0])), np.concatenate((y, nodes[1]))


@pytest.mark.parametrize("orders", [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 2)])
@pytest.mark.parametrize("count", [MANY, 3 * CHUNK + 1])
def test_a_value_has_the_bits_of_scipy_s(orders: tuple[int, int], count: int) -> None:
    x, y = points(count)
    wanted = PLANE.ev(x, y, dx=orders[0], dy=orders[1])
    np.testing.assert_array_equal(Bicubic(PLANE, Place())(x, y, *orders), wanted)


def test_points_that_change_along_one_axis_or_in_one_value_are_not_taken_for_the_last_ones() -> None:
    x, y = points(2 * CHUNK)
    spline = Bicubic(PLANE, Place())
    other_x, other_y = x.copy(), y.copy()
    other_x[-1], other_y[0] = -150.0, 7.0
    for at in ((x, y), (x, other_y), (other_x, other_y), (other_x, y), (x[:-1], y[:-1])):
        np.testing.assert_array_equal(spline(*at, 0, 0), PLANE.ev(*at))


@pytest.mark.parametrize("shape", [(60, 50), (3000,)])
def test_both_fluxes_of_a_map_have_values_of_their_own_inside_and_beyond_it(shape: tuple[int, ...]) -> None:
    """Many points at once, and the same points one by one, which SciPy evaluates."""
    d, q = np.meshgrid(X, Y, indexing="ij")
    model = SplineModel(X, Y, 0.08 + 2e-4 * d - 2e-7 * q**2, 5e-4 * q + 1e-7 * q * d)
    i_d, i_q = RANDOM.uniform(-350.0, 50.0, shape), RANDOM.uniform(-350.0, 350.0, shape)
    for psi in (model.psi_d, model.psi_q):
        for orders in ((0, 0), (1, 0), (0, 1)):
            single = [float(psi(a, b, *orders)) for a, b in zip(i_d.ravel(), i_q.ravel(), strict=True)]
            np.testing.assert_array_equal(psi(i_d, i_q, *orders).ravel(), single)
