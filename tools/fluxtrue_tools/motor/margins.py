# SPDX-License-Identifier: Apache-2.0
"""Margins read from an open loop that is known at some frequencies of both signs, computed or measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.motor.current_loop import Response
from fluxtrue_tools.motor.flux_model import Array

JUMP = 180.0  # a larger difference is a phase that has been folded, not a crossing


@dataclass(frozen=True)
class Margins:
    """The smaller ones of both directions; infinite where the loop never crosses."""

    phase_deg: float
    gain_dB: float
    crossover_Hz: float  # highest frequency with a gain of 1


def _crossings(x: Array, y: Array) -> NDArray[np.float64]:
    """Where the straight lines between the points are zero, as indices."""
    k = np.flatnonzero((np.diff(np.sign(y)) != 0) & (np.abs(np.diff(y)) < JUMP))
    return np.asarray(k + y[k] / (y[k] - y[k + 1]))


def _direction(frequency_Hz: Array, gain: NDArray[np.complex128]) -> tuple[Array, Array, Array]:
    """Of ascending frequencies: phase margins, gain margins, crossovers."""
    index = np.arange(len(gain), dtype=float)
    gain_dB = 20.0 * np.log10(np.abs(gain))
    phase = np.degrees(np.unwrap(np.angle(-gain)))  # 0: the point -1
    ones = _crossings(index, gain_dB)
    phases = (np.interp(ones, index, phase) + 180.0) % 360.0 - 180.0
    turns = 360.0 * np.round(phase / 360.0)
    through = _crossings(index, phase - turns)
    return np.abs(phases), -np.interp(through, index, gain_dB), np.exp(np.interp(ones, index, np.log(frequency_Hz)))


def margins(response: Response) -> Margins:
    """Phase and gain interpolated over the logarithm of the frequency."""
    found = []
    for sign in (-1.0, 1.0):
        frequency = sign * response.frequency_Hz
        order = np.argsort(frequency)
        order = order[frequency[order] > 0.0]
        found.append(_direction(frequency[order], response.gain[order]))
    phase, gain, crossover = (np.concatenate(parts) for parts in zip(*found, strict=True))
    rising = gain[gain > 0.0]
    return Margins(
        float(phase.min()) if len(phase) else np.inf,
        float(rising.min()) if len(rising) else np.inf,
        float(crossover.max()) if len(crossover) else np.nan,
    )
