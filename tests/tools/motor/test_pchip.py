# SPDX-License-Identifier: Apache-2.0
"""The cubics through many curves are those of scipy, bit for bit."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from fluxtrue_tools.motor.pchip import Curve, pchips

CURVES, LONGEST, PLACES = 200, 40, 50


def drawn(rng: np.random.Generator, k: int) -> Curve:
    """Curves of two points and more: with extrema, monotone, and with a part that does not change."""
    points = 2 + k % LONGEST
    x = np.cumsum(rng.uniform(1e-3, 1.0, points)) - 5.0
    y = rng.normal(size=(points, 2))
    if k % 3 == 0:
        y = np.sort(y, axis=0)[::-1]
    if k % 4 == 0:
        y[: points // 2] = y[0]
    return x, y


@pytest.mark.parametrize("seed", range(3))
def test_they_agree_with_scipys_to_the_last_bit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    curves = [drawn(rng, k) for k in range(CURVES)]
    for (x, y), ours in zip(curves, pchips(curves), strict=True):
        at = np.concatenate((x, rng.uniform(x[0], x[-1], PLACES)))
        assert ours(at).tobytes() == PchipInterpolator(x, y)(at).tobytes()


def test_no_curve_has_no_interpolant() -> None:
    assert pchips([]) == []
