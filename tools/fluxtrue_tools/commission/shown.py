# SPDX-License-Identifier: Apache-2.0
"""What a burst along q has shown of the machine, from its own recording: (CM-34), (CM-45)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Raw, integrate, legs_vector
from fluxtrue_tools.commission.swing import NOISE, Drift, Machine
from fluxtrue_tools.motor.flux_model import Array

MAGNET = 3.0  # times the guess of the magnet's flux linkage at most
BINS = 25  # of the current, up to the largest one
TOP = 0.4  # of the current: from its last part follows what is beyond it
BEYOND = 0.6  # times the slope of that part, since saturation goes on
SETTLED = 3  # samples
STRICTLY_VS = 1e-9
LEGS, LEGS_STEPS = 0.01, 150  # of i_max: the current within which the sign of a phase is uncertain; to both sides


@dataclass(frozen=True)
class Losses:
    """What is known of the voltages' errors."""

    r_ohm: float
    level_V: float


@dataclass(frozen=True)
class Shown:
    """A burst as flux linkages."""

    raw: Raw
    psi: Array  # complex, rotor frame: what the voltages of the axes in use show, (CM-11)
    turned: Array  # what the magnet's flux linkage of the start is multiplied by

    def torque(self, psi_f_Vs: float, more_A: float = 0.0, more_Vs: float = 0.0) -> Array:
        """Of 1.5 times the pole pairs, in V·s·A, with a magnet; more_A, more_Vs: along d, that there was not."""
        return _torque(self.psi + psi_f_Vs * self.turned + more_Vs, self.raw.i + more_A)

    def since(self, delay: int) -> "Shown":
        """Without the first periods, in which there are no pulses along q."""
        return Shown(self.raw.part(slice(delay, None)), self.psi[delay:], self.turned[delay:])


def shown(raw: Raw, losses: Losses) -> Shown:
    """Integrate a burst's voltages."""
    linkage = integrate(raw, losses.r_ohm)
    psi, (of_d, of_q) = linkage.psi + losses.level_V * linkage.of_level, raw.axes
    return Shown(raw, of_d * psi.real + 1j * of_q * psi.imag, linkage.turned)


def _torque(psi: Array, i: Array) -> Array:
    """Of 1.5 times the pole pairs, in V·s·A."""
    return np.asarray((np.conj(psi) * i).imag)


def magnet_Vs(bursts: Sequence[Shown], guess_Vs: float) -> float:
    """The magnet's flux linkage, by the share that it has in the movements of the rotor: (CM-34)."""
    rows, moved = [], []
    for each in bursts:
        raw = each.raw
        of_parts = np.column_stack((_torque(each.turned, raw.i), _torque(each.psi, raw.i)))
        rows.append(raw.period_s**2 * np.cumsum(np.cumsum(of_parts, axis=0), axis=0))
        moved.append(raw.theta - raw.theta[0])
    of_magnet, of_others = np.linalg.lstsq(np.vstack(rows), np.concatenate(moved), rcond=None)[0]
    found = of_magnet / of_others if of_others > 0.0 else guess_Vs
    return float(np.clip(found, guess_Vs / MAGNET, guess_Vs * MAGNET))


def rad_per_torque(bursts: Sequence[Shown], psi_f_Vs: float) -> float:
    """Electrical angle by a torque, in the square of a period: what the rotor's inertia makes of it."""
    way = np.concatenate([np.cumsum(np.cumsum(each.torque(psi_f_Vs))) for each in bursts])
    angle = np.concatenate([each.raw.theta - each.raw.theta[0] for each in bursts])
    return abs(float(way @ angle / (way @ way)))


def _rising(values: Array, i_A: Array) -> Array:
    """From zero on, and up to twice the largest current, with the slope of the last part."""
    rising = np.maximum.accumulate(np.maximum(values, 0.0))
    top = i_A > (1.0 - TOP) * i_A[-1]
    slope = float(np.polyfit(i_A[top], rising[top], 1)[0]) if np.count_nonzero(top) > 1 else rising[-1] / i_A[-1]
    return np.concatenate(([0.0], rising, [rising[-1] + BEYOND * slope * i_A[-1]]))


def machine(last: Shown, losses: Losses, psi_f_Vs: float, turns: float, i_max_A: float, along_d_A: float = 0.0,
            more_A: float = 0.0, more_Vs: float = 0.0) -> Machine:  # fmt: skip
    """From means of the samples in bins of the current. At the next bias the torque is that of the currents and flux
    linkages moved there; the flux linkage along q is taken from this one.

    turns             what rad_per_torque() has found
    along_d_A         the bias of the next burst
    more_A, more_Vs   current and flux linkage along d that the next burst has more than this one
    """
    raw, torque = last.raw, last.torque(psi_f_Vs, more_A, more_Vs)
    i_q, psi_q = raw.i.imag, last.psi.imag
    size = np.abs(i_q)
    number = np.minimum((BINS * size / size.max()).astype(int), BINS - 1)
    filled = np.bincount(number, minlength=BINS)

    def means(values: Array) -> Array:
        return np.asarray(np.bincount(number, weights=values, minlength=BINS)[filled > 0] / filled[filled > 0])

    i_A = means(size)
    psi_Vs, torques = (_rising(means(values * np.sign(i_q)), i_A) for values in (psi_q, torque))
    at_A = LEGS * i_max_A * np.arange(-LEGS_STEPS, LEGS_STEPS + 1)
    turn = np.exp(1j * raw.theta[-1])
    legs = (legs_vector((along_d_A + 1j * at_A) * turn, LEGS * i_max_A) * np.conj(turn)).imag
    strictly = STRICTLY_VS * np.arange(len(psi_Vs))  # the inverse needs a flux linkage that rises everywhere
    return Machine(np.concatenate(([0.0], i_A, [2.0 * i_A[-1]])), psi_Vs + strictly, torques,
                   losses.r_ohm, at_A, losses.level_V * legs, turns, NOISE * i_max_A,
                   raw.period_s)  # fmt: skip


def drift(last: Shown, psi_f_Vs: float, turns: float, delay: int, next_delay: int) -> Drift:
    """Before the next burst's pulses along q, by that before the last one's: the current grows with the time.

    turns               what rad_per_torque() has found
    delay, next_delay   periods until the last and the next burst's pulses along q begin; if the last one had no delay
                        its drift is not known and counts as zero
    """
    if delay < SETTLED:
        return Drift()
    longer = next_delay / delay
    speed = turns * np.cumsum(last.torque(psi_f_Vs)[:delay])
    current_A = float(last.raw.i.imag[delay - SETTLED : delay].mean())
    return Drift(current_A * longer, float(speed[-1]) * longer**2, float(speed.sum()) * longer**3)
