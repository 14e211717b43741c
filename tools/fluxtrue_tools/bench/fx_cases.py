# SPDX-License-Identifier: Apache-2.0
"""The arguments each function of firmware/fx is measured with, and what it should return.

References are double precision and take nothing from the functions: angles by numpy, quotients
and roots by definition.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

RANDOM_ROWS = 2000
Q15, Q31 = 2.0**15, 2.0**31
CORNERS_Q15 = (-32768, -32767, -16384, -1, 0, 1, 2, 16384, 32766, 32767)
CORNERS_Q31 = (-(2**31), -(2**31) + 1, -(2**30), -1, 0, 1, 2, 3, 2**16, 2**30, 2**31 - 1)


@dataclass(frozen=True)
class Case:
    """One function: its group for comparison, arguments, and error against the reference."""

    name: str  # bench_<name>
    title: str
    group: str
    rows: Ints
    error: Callable[[Ints, Ints], Floats] | None = None  # of (rows, r0 | r1 << 32)
    unit: str = ""


def signed(value: Ints, bits: int) -> Ints:
    """The lowest bits as a two's complement number."""
    half = 1 << (bits - 1)
    return ((value & ((1 << bits) - 1)) ^ half) - half


def _grid(*columns: tuple[int, ...]) -> Ints:
    return np.stack([axis.ravel() for axis in np.meshgrid(*columns)], axis=1).astype(np.int64)


def _arguments(bits: int, number: int, unsigned: bool = False) -> Ints:
    """Every combination of the extreme values, then random rows of uniformly distributed magnitude."""
    rng = np.random.default_rng(20140101 + bits + number)
    corners = CORNERS_Q15 if bits == 16 else CORNERS_Q31
    shape = (RANDOM_ROWS, number)
    half = 1 << (bits - 1)
    random = rng.integers(-half, half, shape) >> rng.integers(0, bits - 1, shape)
    rows = np.concatenate([_grid(*([corners] * number)), random])
    return rows & ((1 << bits) - 1) if unsigned else rows


def _sincos_error(rows: Ints, got: Ints) -> Floats:
    angle = rows[:, 0] * (2.0 * np.pi / 65536.0)
    sine, cosine = signed(got, 32) / Q15, signed(got >> 32, 32) / Q15
    return np.maximum(np.abs(sine - np.sin(angle)), np.abs(cosine - np.cos(angle)))


def _clipped_error(reference: Callable[..., Floats], bits: int) -> Callable[[Ints, Ints], Floats]:
    """The error in units of 1 of a function whose result saturates."""
    half = float(1 << (bits - 1))

    def error(rows: Ints, got: Ints) -> Floats:
        columns = [rows[:, i].astype(np.float64) for i in range(rows.shape[1])]
        want = np.clip(reference(*columns), -half, half - 1.0)
        return np.abs(signed(got, bits) - want) / half

    return error


def _quotient(scale: float) -> Callable[[Floats, Floats], Floats]:
    def quotient(num: Floats, den: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(num * scale / den, nan=0.0)

    return quotient


def _every_angle() -> Ints:
    angles = np.arange(0, 65536, 7)
    return np.concatenate([angles, np.arange(0, 65536, 64)])[:, None]


def cases() -> list[Case]:
    """Every measured function."""
    two15, two31 = _arguments(16, 2), _arguments(32, 2)
    one31 = _arguments(32, 1)
    table = _arguments(16, 2)
    q15_root = _clipped_error(np.sqrt, 16)
    return [
        Case("sincos", "sine and cosine", "sincos", _every_angle(), _sincos_error, "of 1"),
        Case("sincos_struct", "the same, packed into r0", "", _every_angle()),
        Case("sqrt_q30", "sqrt, q15 result", "sqrt", _arguments(32, 1, True), q15_root, "of 1"),
        Case("magnitude", "magnitude", "", two15, _clipped_error(np.hypot, 16), "of 1"),
        Case("div_q15", "divide, q15", "divide", two15, _clipped_error(_quotient(Q15), 16), "of 1"),
        Case("div_q31", "divide, q31", "divide", two31, _clipped_error(_quotient(Q31), 32), "of 1"),
        Case("mul_q15", "multiply, q15", "", two15,
             _clipped_error(lambda x, y: x * y / Q15, 16), "of 1"),
        Case("mul_q31", "multiply, q31", "", two31,
             _clipped_error(lambda x, y: x * y / Q31, 32), "of 1"),
        Case("mul_gain_q15", "gain * q15", "", _arguments(32, 2) >> [[0, 16]],
             _clipped_error(lambda g, x: g * x / 65536.0, 16), "of 1"),
        Case("mul_gain_q31", "gain * q31", "", two31,
             _clipped_error(lambda g, x: g * x / 65536.0, 32), "of 1"),
        Case("round_q15", "narrow q30 to q15", "", one31,
             _clipped_error(lambda x: x / Q15, 16), "of 1"),
        Case("add_q15", "add, q15", "", two15, _clipped_error(np.add, 16), "of 1"),
        Case("lookup1", "one 1-D table", "", table[:, :1]),
        Case("one_table", "cell and one 2-D table", "", table),
        Case("five_tables", "cell and five 2-D tables", "", table),
    ]  # fmt: skip
