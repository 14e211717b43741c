# SPDX-License-Identifier: Apache-2.0
"""The spectrum of a capture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope.scope import Capture

SAMPLES_MIN = 8


@dataclass(frozen=True)
class Spectrum:
    """Peak amplitudes of each signal over the frequency; the first is the mean value."""

    step_Hz: float
    columns: dict[str, NDArray[np.float64]]


def _amplitudes(column: NDArray[np.float64], window: NDArray[np.float64]) -> NDArray[np.float64]:
    """The mean is taken out first, so that it does not leak into the lowest frequencies."""
    mean = column.mean()
    spectrum: NDArray[np.float64] = 2.0 * np.abs(np.fft.rfft((column - mean) * window)) / window.sum()
    spectrum[0] = abs(mean)
    if len(column) % 2 == 0:
        spectrum[-1] /= 2.0  # half of the sampling rate has no mirror image
    return spectrum


def spectrum_of(capture: Capture) -> Spectrum:
    """With a Hann window: a sine between two frequencies of the spectrum is shown up to 15 % too small."""
    count = len(capture.time_s)
    if count < SAMPLES_MIN:
        raise FluxtrueError(f"{count} samples, a spectrum needs {SAMPLES_MIN} or more")
    window = np.hanning(count + 1)[:-1]
    step_s = (capture.time_s[-1] - capture.time_s[0]) / (count - 1)
    return Spectrum(1.0 / (count * step_s), {name: _amplitudes(column, window)
                                             for name, column in capture.columns.items()})  # fmt: skip
