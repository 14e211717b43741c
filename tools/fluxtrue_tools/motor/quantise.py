# SPDX-License-Identifier: Apache-2.0
"""Numbers to fixed point: nearest, and refused when they do not fit."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fluxtrue_tools.errors import FluxtrueError

Q15_ONE = 1 << 15
Q16_ONE = 1 << 16
Q31_ONE = 1 << 31


class Unfit(FluxtrueError):
    """A number that follows from the user's values and does not fit the firmware's format."""


def _words(low: int, high: int, one: int) -> str:
    """The range of a format: its upper end is one step below a round number."""
    upper = f"below {(high + 1) / one:g}"
    return upper if low == 0 else f"from {low / one:g} and {upper}"


def _fixed(value: float, one: int, low: int, high: int, name: str) -> int:
    scaled = math.floor(value * one + 0.5)
    if not low <= scaled <= high:
        raise Unfit(
            f"the number that the firmware derives from it ({name}) is {value:.6g} per unit, allowed: "
            f"{_words(low, high, one)}"
        )
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
        raise Unfit(f"a number in the firmware's table {name} is {worst:.6g} per unit, allowed: from -1 and below 1")
    return scaled


def shift_for(largest: float) -> int:
    """The smallest n with largest / 2^n < 1 in Q15."""
    n = 0
    while math.floor(largest / (1 << n) * Q15_ONE + 0.5) > Q15_ONE - 1:
        n += 1
    return n
