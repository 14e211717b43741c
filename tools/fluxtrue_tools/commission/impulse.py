# SPDX-License-Identifier: Apache-2.0
"""How a burst's torque turned the rotor, from its own recording: (CM-27), (CM-34)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Raw, integrate
from fluxtrue_tools.motor.flux_model import Array

MAGNET = 3.0  # times the guess of the magnet's flux linkage at most
FIRST = (0.2, 0.9)  # share of its bound at which the first half wave may end


@dataclass(frozen=True)
class Losses:
    """What is known of the voltages' errors."""

    r_ohm: float
    level_V: float


def _linkages(raw: Raw, losses: Losses) -> tuple[Array, Array]:
    """What the voltages of the axes in use show, and what the magnet's at the start is multiplied by (CM-11)."""
    linkage = integrate(raw, losses.r_ohm)
    psi, (of_d, of_q) = linkage.psi + losses.level_V * linkage.of_level, raw.axes
    return of_d * psi.real + 1j * of_q * psi.imag, linkage.turned


def _torque(psi: Array, i: Array) -> Array:
    """Of 1.5 times the pole pairs, in V·s·A."""
    return np.asarray((np.conj(psi) * i).imag)


def magnet_Vs(raws: Sequence[Raw], losses: Losses, guess_Vs: float) -> float:
    """The magnet's flux linkage, by the share that it has in the movements of the rotor: (CM-34)."""
    rows, moved = [], []
    for raw in raws:
        psi, turned = _linkages(raw, losses)
        of_parts = np.column_stack((_torque(turned, raw.i), _torque(psi, raw.i)))
        rows.append(raw.period_s**2 * np.cumsum(np.cumsum(of_parts, axis=0), axis=0))
        moved.append(raw.theta - raw.theta[0])
    of_magnet, of_others = np.linalg.lstsq(np.vstack(rows), np.concatenate(moved), rcond=None)[0]
    found = of_magnet / of_others if of_others > 0.0 else guess_Vs
    return float(np.clip(found, guess_Vs / MAGNET, guess_Vs * MAGNET))


def _rise(i_q: Array) -> slice:
    """From zero to the largest current of a half wave."""
    top = int(np.argmax(np.abs(i_q)))
    other = np.flatnonzero(i_q[:top] * i_q[top] <= 0.0)
    return slice(int(other[-1]) + 1 if len(other) else 0, top + 1)


def balanced(
    raw: Raw, losses: Losses, psi_f_Vs: float, top_A: float, more_A: float = 0.0, more_Vs: float = 0.0,
    part: float = 0.5,
) -> float:  # fmt: skip
    """The share of its bound at which the first half wave along q ends with a part of the impulse of the others: with
    half of it the rotor swings to one side, (CM-27).

    top_A             bound of the next burst
    more_A, more_Vs   current and flux linkage along d that the next burst has more than this one
    """
    psi, turned = _linkages(raw, losses)
    rise = _rise(raw.i.imag)
    torque = _torque(psi + psi_f_Vs * turned + more_Vs, raw.i + more_A)[rise]
    i_q = raw.i.imag[rise]
    impulse = np.maximum.accumulate(np.cumsum(torque * np.sign(i_q[-1])))
    reached = np.maximum.accumulate(np.abs(i_q))
    wanted = part * float(np.interp(top_A, reached, impulse))
    return float(np.clip(np.interp(wanted, impulse, reached) / min(top_A, float(reached[-1])), *FIRST))
