# SPDX-License-Identifier: Apache-2.0
"""Which pulses along q move the rotor little: the firmware's rule (CM-9) repeated with the machine that the last bursts
have shown, for many voltages and bounds, (CM-45).

A half wave ends at a sample, by up to a whole change of the current below its bound or beyond it. What that leaves of
the impulses moves the rotor as far as the swing itself, but it is known beforehand: bounds are found at which a half
wave ends at the same sample in spite of the noise and of what is not known of the machine.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from fluxtrue_tools.commission.bursts import CLOSER
from fluxtrue_tools.commission.drive import nothing
from fluxtrue_tools.commission.rule import Rule
from fluxtrue_tools.motor.flux_model import Array

DRAWS = 16  # of the noise and of what is uncertain
PERIODS = 1200  # that are computed; what has not ended by then is not taken
NOISE = 0.003  # of i_max
UNCERTAIN = 0.04  # of the voltage, which also stands for the flux linkage
UNCERTAIN_DRIFT = 0.6  # of the drift before the pulses
UNCERTAIN_BEYOND = 0.3  # of the slope of the flux linkage beyond the largest current that was shown
LEAST_BEYOND = 0.3  # of it
LATE = 0.15  # of the largest change in a period: by so much more may the current be than is computed
FIRSTS, OTHERS = np.linspace(0.25, 0.9, 20), np.linspace(0.75, 1.0, 6)  # shares of the bound that are tried
TOPS = (1.0, 0.9, 0.8)  # the same
REVERSALS = 3
SWING_RAD = 0.011  # electrical, 0.63 degrees: a larger movement counts much more than a smaller current
REACHED, REACHED_IF_FAR = 0.75, 0.85  # of the largest current that is possible: only choices that reach it count
TOO_FAR_RAD = 0.02  # if all of these move the rotor further, REACHED_IF_FAR takes the place of REACHED
OF_MOVEMENT = 0.15  # of the bound: what a movement of SWING_RAD counts
OF_FAR_MOVEMENT = 2.5  # the same, more for what is beyond SWING_RAD
OF_VOLTAGE = 0.1  # what the highest voltage counts, since it leaves few samples


@dataclass(frozen=True)
class Machine:
    """The machine along q at one current along d.

    Flux linkage and torque are odd functions of the current along q and are stored for positive currents. The legs'
    voltage is not odd: at a bias the signs of the phase currents are mostly those of the current along d.
    """

    i_A: Array
    psi_Vs: Array
    torque: Array  # over 1.5 times the pole pairs, in V·s·A
    r_ohm: float
    legs_A: Array  # current along q, from the most negative one on
    legs_V: Array  # along q
    rad_per_torque: float  # electrical angle, in the square of a period
    noise_A: float
    period_s: float
    offset_A: float = 0.0  # along q, that the sensors show without current

    def current_A(self, psi_Vs: Array, beyond: Array | float = 1.0) -> Array:
        """At a flux linkage.

        beyond   times its slope over the current, beyond the largest one that was shown
        """
        size = np.abs(psi_Vs)
        (shown_Vs, last_Vs), (shown_A, last_A) = self.psi_Vs[-2:], self.i_A[-2:]
        more_A = np.maximum(size - shown_Vs, 0.0) * (last_A - shown_A) / ((last_Vs - shown_Vs) * beyond)
        return np.asarray(np.sign(psi_Vs) * (np.interp(np.minimum(size, shown_Vs), self.psi_Vs, self.i_A) + more_A))

    def linkage_Vs(self, i_A: Array) -> Array:
        """The inverse."""
        return np.asarray(np.sign(i_A) * np.interp(np.abs(i_A), self.i_A, self.psi_Vs))

    def torque_of(self, i_A: Array) -> Array:
        """At a current."""
        return np.asarray(np.sign(i_A) * np.interp(np.abs(i_A), self.i_A, self.torque))

    def lost_V(self, i_A: Array) -> Array:
        """By winding and legs."""
        return np.asarray(self.r_ohm * i_A + np.interp(i_A, self.legs_A, self.legs_V))


@dataclass(frozen=True)
class Drift:
    """What there is before the pulses: nothing holds the current along q while the one along d goes to its bias."""

    i_A: float = 0.0
    speed_rad: float = 0.0  # electrical, in a period
    angle_rad: float = 0.0
    uncertain_rad: float = 0.0  # of the speed: the rotor stands only about


@dataclass(frozen=True)
class Waves:
    """Half waves along q; the firmware begins towards the bound that is further from zero, the upper one if both
    are as far."""

    low_A: float
    high_A: float
    first: float  # share of its bound at which the first one ends

    @property
    def top_A(self) -> float:
        """The larger bound."""
        return max(self.high_A, -self.low_A)

    def mirrored(self) -> "Waves":
        """To begin in the other direction; equal bounds would begin upwards."""
        return Waves(-self.high_A, -self.low_A if self.high_A > -self.low_A else CLOSER * self.high_A, self.first)


@dataclass(frozen=True)
class Course:
    """Movement and current of each computed burst."""

    moved_rad: Array  # the largest distance of the rotor from its start, with the worst of the draws
    largest_A: Array  # current along q, the same, and LATE
    reach_A: Array  # mean of the draws' largest currents


def course(of: Machine, volts: float, waves: Sequence[Waves], drift: Drift, sign: float = 1.0) -> Course:
    """Movement and currents of bursts with these half waves. All begin upwards; with a sign of -1 all are mirrored."""
    rng = np.random.default_rng(0)
    low, high, first = (np.array([getattr(each, name) for each in waves])[:, None] * np.ones((1, DRAWS))
                        for name in ("low_A", "high_A", "first"))  # fmt: skip
    offset = sign * of.offset_A
    rule = Rule(np.maximum(low + offset, -high - offset), high + offset, first, REVERSALS)  # shown_bounds()
    gain = of.period_s * volts * (1.0 + UNCERTAIN * rng.standard_normal((1, DRAWS)))
    drifts = 1.0 + UNCERTAIN_DRIFT * rng.standard_normal((1, DRAWS))
    beyond = np.maximum(1.0 + UNCERTAIN_BEYOND * rng.standard_normal((1, DRAWS)), LEAST_BEYOND)
    i, speed, angle = (np.broadcast_to(drifts * value, low.shape)
                       for value in (drift.i_A, drift.speed_rad, drift.angle_rad))  # fmt: skip
    speed = speed + drift.uncertain_rad * rng.standard_normal((1, DRAWS))
    psi, moved, largest = of.linkage_Vs(i), np.abs(angle), np.abs(i)
    acting = step = np.zeros(low.shape)
    has_ended = np.zeros(low.shape, bool)
    for _ in range(PERIODS):
        rule.step(sign * i + offset + of.noise_A * rng.standard_normal((1, DRAWS)))
        changed = psi + gain * acting - of.period_s * of.lost_V(i)
        returns = (acting == 0.0) | ((acting * psi <= 0.0) & (changed * psi <= 0.0))
        has_ended = has_ended | (rule.ended & returns)
        psi = np.where(has_ended, 0.0, changed)
        before, i = i, of.current_A(psi, beyond)
        step = np.maximum(step, np.abs(i) - np.abs(before))
        acting = sign * rule.sign
        speed = speed + of.rad_per_torque * of.torque_of(i)
        angle = np.where(has_ended, angle, angle + speed)
        moved, largest = np.maximum(moved, np.abs(angle)), np.maximum(largest, np.abs(i))
        if has_ended.all():
            break
    worst = np.where(has_ended, moved, np.inf).max(axis=1)
    return Course(worst, (largest + LATE * step).max(axis=1), largest.mean(axis=1))


def _tried(top_A: float) -> list[Waves]:
    """Of a voltage."""
    return [Waves(-other * top * top_A, top * top_A, first)
            for top, other, first in product(TOPS, map(float, OTHERS), map(float, FIRSTS))]  # fmt: skip


def _best(moved_rad: Array, reach_A: Array, price: Array, top_A: float) -> int:
    """Index of the choice with the largest current as a share of top_A, less what its movement and its voltage count.
    Only those count that reach enough current, so that the map is good.

    price   of the voltages
    """
    possible = np.isfinite(moved_rad)
    enough = possible & (reach_A >= REACHED * reach_A[possible].max())
    if moved_rad[enough].min() > TOO_FAR_RAD:
        enough = possible & (reach_A >= REACHED_IF_FAR * reach_A[possible].max())
    farther = moved_rad / SWING_RAD
    counts = OF_FAR_MOVEMENT * np.maximum(farther - 1.0, 0.0) + OF_MOVEMENT * farther + price
    return int(np.argmin(np.where(enough, counts - reach_A / top_A, np.inf)))


def quietest(of: Machine, volts: Sequence[float], top_A: float, limit_A: float, drift: Drift,
             rest: Callable[[float], None] = nothing) -> tuple[float, Waves] | None:  # fmt: skip
    """One of the voltages, and the bounds: up to top_A, with a current of less than limit_A; None if there are none.
    The first half wave may go in either direction.

    rest   lets the drive run for some seconds: called after each voltage and direction, because all of them can take
           longer than an inverter may be without a sign of life
    """
    moved, reach, price, made = [], [], [], []
    tried = _tried(top_A)
    for volt, sign in product(volts, (1.0, -1.0)):
        found = course(of, volt, tried, drift, sign)
        moved.append(np.where(found.largest_A < limit_A, found.moved_rad, np.inf))
        reach.append(found.reach_A)
        price.append(np.full(len(tried), OF_VOLTAGE * volt / max(volts)))
        rest(0.0)
        made += [(volt, each if sign > 0.0 else each.mirrored()) for each in tried]
    moved_rad, reach_A, prices = (np.concatenate(parts) for parts in (moved, reach, price))
    return made[_best(moved_rad, reach_A, prices, top_A)] if np.isfinite(moved_rad).any() else None
