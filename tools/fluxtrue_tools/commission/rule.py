# SPDX-License-Identifier: Apache-2.0
"""The firmware's rule by which the pulses along q reverse, (CM-9), for many bursts at once."""

import numpy as np

from fluxtrue_tools.motor.flux_model import Array


class Rule:
    """The axis q of firmware/drive/pulses.c, with one value for each burst; bounds in A. The first half wave is a
    positive one. The ends by current, movement or time are not computed, and the last period has the full voltage."""

    def __init__(self, low_A: Array, high_A: Array, first: Array, reversals: int) -> None:
        self._low, self._high, self._first, self._all = low_A, high_A, first, reversals
        zero = np.zeros(np.broadcast_shapes(low_A.shape, high_A.shape, first.shape))
        self.sign, self.ended = zero.copy(), zero > 0.0
        self._before, self._slope, self._i = zero.copy(), zero.copy(), zero.copy()
        self._count, self._sum, self._half = zero.copy(), zero.copy(), zero.copy()

    def step(self, i: Array) -> None:
        """Take the samples of a period. Then `sign` is that of the voltage in the next one, 0 for none, and `ended`
        says whether all reversals have happened."""
        slope = self._before * (i - self._i)
        change = np.maximum(slope, 0.0) + np.maximum(slope - self._slope, 0.0)
        self._slope, self._i, self._before = np.maximum(slope, 0.0), i, self.sign
        following = i + self.sign * self._slope
        self._half = np.where(i * self._half >= 0.0, self._half + i, i)
        self._sum = self._sum + i
        share = np.where(self._count == 0, self._first, 1.0)
        down = (self.sign > 0.0) & (following + change >= share * self._high)
        up = following - change <= share * self._low
        sign = np.where(down, -1.0, np.where(up, 1.0, self.sign))
        is_last = (self._count + 1 == self._all) & (self._count > 0)
        closes = is_last & (self.sign * (self._sum + self._half) >= 0.0) & (self.sign * self._half > 0.0)
        sign = np.where(self.sign == 0.0, 1.0, np.where(closes, -self.sign, sign))
        self._count = self._count + (sign * self.sign < 0.0)
        was, self.ended = self.ended, self.ended | (self._count >= self._all)
        back = np.where(following > 0.0, -1.0, 1.0)
        back = np.where(was, np.where(self.sign * following >= 0.0, 0.0, self.sign), back)
        self.sign = np.where(self.ended, back, sign)
