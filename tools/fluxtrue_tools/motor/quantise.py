# SPDX-License-Identifier: Apache-2.0
"""Numbers to fixed point: nearest, and refused when they do not fit."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluxtrue_tools.errors import FluxtrueError

Q15_ONE = 1 << 15
Q16_ONE = 1 << 16
Q31_ONE = 1 << 31


def _fixed(value: float, one: int, low: int, high: int, name: str) -> int:
    scaled = math.floor(value * one + 0.5)
    if not low <= scaled <= high:
        raise FluxtrueError(f"{name} = {value:.6g} does not fit the firmware's format, allowed: "
                            f"{low / one:g} to {high / one:g} per unit")
    return scaled


def q15(value: float, name: str) -> int:
    """Per unit to Q15."""
    return _fixed(value, Q15_ONE, -Q15_ONE, Q15_ONE - 1, name)


def q31(value: float, name: str) -> int:
    """Per unit to Q31."""
    return _fixed(value, Q31_ONE, -Q31_ONE, Q31_ONE - 1, name)


def q16(value: float, name: str) -> int:
    """A gain to Q15.16."""
    return _fixed(value, Q16_ONE, -Q31_ONE, Q31_ONE - 1, name)


def u16(value: float, one: int, name: str) -> int:
    """An unsigned 16-bit number with the given unit."""
    return _fixed(value, one, 0, 0xFFFF, name)


def q15_table(values: ArrayLike, name: str) -> NDArray[np.int64]:
    """A whole table to Q15."""
    scaled = np.floor(np.asarray(values, float) * Q15_ONE + 0.5).astype(np.int64)
    if scaled.min() < -Q15_ONE or scaled.max() > Q15_ONE - 1:
        worst = float(np.asarray(values).flat[int(np.argmax(np.abs(np.asarray(values))))])
        raise FluxtrueError(f"table {name}: {worst:.6g} does not fit the firmware's format, allowed: -1 to 1 per unit")
    return scaled


def shift_for(largest: float) -> int:
    """The smallest n with largest / 2^n < 1 in Q15."""
    n = 0
    while math.floor(largest / (1 << n) * Q15_ONE + 0.5) > Q15_ONE - 1:
        n += 1
    return n
