# SPDX-License-Identifier: Apache-2.0
"""How far the pulses along q would move a rotor: the firmware's rule (CM-9) repeated with the machine's response.

Where a voltage changes the current slowly the swing is large, and what is left of the impulses counts: a half wave ends
at a sample, by up to a whole change of the current below its bound. Bounds at which it ends at the same sample in spite
of the noise are found by trying many.
"""

from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Raw
from fluxtrue_tools.motor.flux_model import Array

DRAWS = 12  # of the noise
PERIODS = 1200  # that are computed; what has not ended by then is not taken
UNCERTAIN = 0.015  # of the response
FIRSTS, OTHERS = np.linspace(0.4, 0.8, 21), np.linspace(0.8, 1.0, 11)  # shares of the bound that are tried
SHORT, LONG = 3, 5  # reversals
SWING_RAD = 0.0115  # electrical, 0.66 degrees: up to one degree remains for a speed at the start
SHARES = (1.0, 0.95, 0.9, 0.85, 0.8, 0.75)  # of the bound


@dataclass(frozen=True)
class Response:
    """Of the current along q: its change in a period, and what it turns."""

    per_volt: float
    per_A: float
    of_legs_A: float  # against the current
    noise_A: float
    rad_per_A: float  # electrical, in the square of a period


def response(raw: Raw) -> Response:
    """From a burst without much saturation."""
    i, u = raw.i.imag, raw.u.imag
    middle = 0.5 * (i[1:] + i[:-1])
    rows = np.column_stack((u[:-1], middle, np.sign(middle)))
    found = np.linalg.lstsq(rows, np.diff(i), rcond=None)[0]
    left = np.diff(i) - rows @ found
    way = np.cumsum(np.cumsum(i))
    drift = np.column_stack((way, np.arange(len(i)), np.ones(len(i))))
    turned = float(np.linalg.lstsq(drift, raw.theta, rcond=None)[0][0])
    return Response(*map(float, found), float(np.std(left)) / 2.0**0.5, abs(turned))


class _Pulses:
    """firmware/drive/pulses.c for many bursts at once; bounds in A."""

    def __init__(self, low_A: Array, high_A: Array, first: Array, reversals: int) -> None:
        self._low, self._high, self._first, self._all = low_A, high_A, first, reversals
        zero = np.zeros(np.broadcast_shapes(low_A.shape, high_A.shape, first.shape))
        self.sign, self.ended = zero.copy(), zero > 0.0
        self._before, self._slope, self._i = zero.copy(), zero.copy(), zero.copy()
        self._count, self._sum, self._half = zero.copy(), zero.copy(), zero.copy()

    def step(self, i: Array) -> None:
        """With the sample of a period: the sign of the voltage that acts in the next one."""
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


def farthest_rad(of: Response, volts: float, top_A: float, first: Array, other: Array, reversals: int) -> Array:
    """The largest distance of the rotor from its start, for each of the shares, with the worst of some noises."""
    rng = np.random.default_rng(0)
    low, high = -other[:, None] * top_A, np.full((1, 1), top_A)
    pulses = _Pulses(low, high, np.broadcast_to(first[:, None], (len(first), DRAWS)), reversals)
    gain = of.per_volt * volts * (1.0 + UNCERTAIN * rng.standard_normal((1, DRAWS)))
    i = speed = angle = far = np.zeros((len(first), DRAWS))
    acting = np.zeros_like(i)
    for _ in range(PERIODS):
        pulses.step(i + of.noise_A * rng.standard_normal((1, DRAWS)))
        changed = i + gain * acting + of.per_A * i + of.of_legs_A * np.sign(i)
        i = np.where(pulses.ended & (acting * i <= 0.0) & (changed * i <= 0.0), 0.0, changed)
        acting = pulses.sign
        goes_on = ~(pulses.ended & (i == 0.0))
        speed = speed + of.rad_per_A * i
        angle = np.where(goes_on, angle + speed, angle)
        far = np.maximum(far, np.abs(angle))
        if not goes_on.any():
            break
    return np.asarray(np.where(goes_on, np.inf, far).max(axis=1))


@dataclass(frozen=True)
class Waves:
    """Half waves along q; where the bounds differ the firmware begins towards the one further from zero."""

    low_A: float
    high_A: float
    first: float  # share of its bound at which the first one ends
    reversals: int


def _best(of: Response, volts: float, top_A: float, reversals: int, others: Array) -> tuple[float, Waves]:
    """The shares that move the rotor least, and how far."""
    first, other = (grid.ravel() for grid in np.meshgrid(FIRSTS, others, indexing="ij"))
    moved = farthest_rad(of, volts, top_A, first, other, reversals)
    at = int(np.argmin(moved))
    return float(moved[at]), Waves(-float(other[at]) * top_A, top_A, float(first[at]), reversals)


def quietest(of: Response, volts: float, top_A: float) -> Waves:
    """Three half waves, by which the rotor swings to one side; if that is too far, five of which those against the
    first one are smaller, so that it swings by half of it to each side (CM-41); and if even that is too far, a smaller
    bound. If none is small enough, the last one: the rotor then moves by more than SWING_RAD."""
    for share in SHARES:
        for reversals, others in ((SHORT, np.ones(1)), (LONG, OTHERS)):
            moved_rad, waves = _best(of, volts, share * top_A, reversals, others)
            if moved_rad < SWING_RAD:
                return waves
    return waves
