# SPDX-License-Identifier: Apache-2.0
"""Shape-preserving cubics through many curves at once.

A motor has more than a hundred contours of constant torque. Constructing a scipy.interpolate.PchipInterpolator for each
took more than a third of the time to prepare a motor. Here the slopes of all curves are computed together, by the same
operations in the same order, so the results agree with scipy's to the last bit.

Source   F. N. Fritsch, J. Butland: A method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci.
         Comput. 5(2), 1984; slopes at the ends: C. Moler, Numerical Computing with MATLAB, 2004, section 3.6
"""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PPoly

from fluxtrue_tools.motor.flux_model import Array

Curve = tuple[Array, Array]  # x [n], rising, n >= 2; y [n][k]


def _inner(h: Array, secant: Array) -> Array:
    """Slopes between the ends: the weighted harmonic mean of the secants on both sides, 0 at an extremum."""
    before, after = secant[:-1], secant[1:]
    w1, w2 = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    mean = 1.0 / ((w1 / before + w2 / after) / (w1 + w2))
    extremum = (np.sign(before) != np.sign(after)) | (before == 0.0) | (after == 0.0)
    return np.where(extremum, 0.0, mean)


def _end(h0: Array, h1: Array, m0: Array, m1: Array) -> Array:
    """Slopes of the parabolas through the last three points, limited so that no extremum appears."""
    slope = ((2 * h0 + h1) * m0 - h0 * m1) / (h0 + h1)
    steep = (np.sign(m0) != np.sign(m1)) & (np.abs(slope) > 3.0 * np.abs(m0))
    return np.where(np.sign(slope) != np.sign(m0), 0.0, np.where(steep, 3.0 * m0, slope))


def _slopes(h: Array, secant: Array, first: Array, last: Array) -> Array:
    """At every point of the joined curves, which begin and end at the points first and last."""
    slopes = np.empty((len(h) + 1, secant.shape[1]))
    slopes[1:-1] = _inner(h, secant)
    longer = last - first >= 2
    a, z = first[longer], last[longer]
    slopes[a] = _end(h[a], h[a + 1], secant[a], secant[a + 1])
    slopes[z] = _end(h[z - 1], h[z - 2], secant[z - 1], secant[z - 2])
    two = first[~longer]
    slopes[two] = slopes[two + 1] = secant[two]
    return slopes


def pchips(curves: Sequence[Curve]) -> list[PPoly]:
    """The interpolant of each curve; where one curve is joined to the next, nothing is computed that is used."""
    if not curves:
        return []
    lengths = np.array([len(x) for x, _ in curves])
    last = np.cumsum(lengths) - 1
    first = last - lengths + 1
    x = np.concatenate([x for x, _ in curves])
    y = np.concatenate([y for _, y in curves])
    h = np.diff(x)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = np.diff(y, axis=0) / h
        slopes = _slopes(h, secant, first, last)
        bend = (slopes[:-1] + slopes[1:] - 2 * secant) / h
        cubics = np.stack((bend / h, (secant - slopes[:-1]) / h - bend, slopes[:-1], y[:-1]))
    return [PPoly.construct_fast(cubics[:, a:z], x[a : z + 1]) for a, z in zip(first, last, strict=True)]
