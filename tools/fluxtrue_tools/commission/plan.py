# SPDX-License-Identifier: Apache-2.0
"""Which bursts measure the flux map: small ones first, whose inductances choose the voltage of the large ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Burst, Raw, integrate, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

FIRST_VOLTAGE = 0.15  # with the smallest inductance that is allowed for, 0.2 of i_max in a period
FIRST_CURRENT = 0.1  # of i_max
VOLTAGES = (0.12, 0.55)
STEP_D, STEP_Q = 0.12, 0.13  # of i_max: change of the current in a period at most
BIAS_STEPS = (0.15, 0.2)  # of i_max: the same at a bias, where the last burst has shown the steepest change
MISSED = 0.5  # of what the change is larger than the first of the two: by so much less is the bound
BAND_STEP = 0.04  # of i_max: change of the current along d in a period at a bias, so that it stays in its band
FASTER = 2.0  # at most, from one bias to the next
GROWTH = 1.3  # of the steepest change, from one level to the next
LEVELS = (0.35, 0.65, 0.93)  # of i_max
TOP_D = 0.1  # of i_max: the magnetising side
BAND = 0.05  # of i_max: half the width of the bias
BIASES = (0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.85)  # of -i_max
BURSTS = 2  # at each of them: a short one moves the rotor less than a long one with as many samples
LOST_MAX = 2  # bursts of all that may fail
TRAVEL = 1.5  # of the time to the bias without saturation
REVERSALS_D, REVERSALS_Q = 4, 3
MOVED_RAD = 0.004  # electrical: by which a burst at a bias may move the rotor without a higher voltage for the next
MAGNET = 3.0  # times the guess of the magnet's flux linkage at most
FIRST = (0.2, 0.9)  # share of its bound at which the first half wave may end


@dataclass(frozen=True)
class First:
    """The inductances of the small bursts, and the voltage of a share of 1."""

    l_d_H: float
    l_q_H: float
    volts: float


@dataclass(frozen=True)
class Losses:
    """What is known of the voltages' errors."""

    r_ohm: float
    level_V: float


def _inductance(raw: Raw, losses: Losses, of_q: bool) -> float:
    """Slope of the flux linkage over the current of one axis."""
    linkage = integrate(raw, losses.r_ohm)
    psi = linkage.psi + losses.level_V * linkage.of_level
    slope = float(np.polyfit(*((linkage.i.imag, psi.imag) if of_q else (linkage.i.real, psi.real)), 1)[0])
    if not slope > 0.0:
        raise FluxtrueError(f"commission: an inductance of {slope:g} H in the {'q' if of_q else 'd'} axis: phases or "
                            "sensors are not connected as assumed")  # fmt: skip
    return slope


def first(drive: Capture, known: Nameplate, losses: Losses) -> First:
    """Small bursts along d and q."""
    small, v = FIRST_CURRENT * known.i_max_A, FIRST_VOLTAGE
    band = (-small, small)
    along_d = record(drive, Burst(v, 0.0, band, band, 5), known)
    along_q = record(drive, Burst(0.0, v, band, band, 5), known)
    for raw, axis in ((along_d, "d"), (along_q, "q")):
        if raw.failure:
            raise FluxtrueError(f"commission: first pulses along {axis}: {raw.failure}")
    volts = float(np.abs(along_d.u).max()) / v
    return First(_inductance(along_d, losses, of_q=False), _inductance(along_q, losses, of_q=True), volts)


def _voltage(steepest_A: float, i_max_A: float, step: float) -> float:
    """The share at which the current changes by a step in a period; steepest_A: its change with a share of 1."""
    return float(np.clip(step * i_max_A / steepest_A, *VOLTAGES))


def _steepest(raw: Raw, share: float, of_q: bool) -> float:
    """The largest change of a current in a period, for a share of 1."""
    i = raw.i.imag if of_q else raw.i.real
    return float(np.abs(np.diff(i)).max()) / share


def _steepest_within(raw: Raw, share: float, top_A: float) -> float:
    """The largest change of the current along q in a period that begins or ends within a bound, for a share of 1."""
    i = raw.i.imag
    changes = np.abs(np.diff(i))
    inside = np.minimum(np.abs(i[1:]), np.abs(i[:-1])) < top_A
    return float(changes[inside].max()) / share


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
    raw: Raw, losses: Losses, psi_f_Vs: float, top_A: float, more_A: float = 0.0, more_Vs: float = 0.0
) -> float:
    """The share of its bound at which the first half wave along q ends with half of the impulse of the others: (CM-27).

    top_A             bound of the next burst
    more_A, more_Vs   current and flux linkage along d that the next burst has more than this one
    """
    psi, turned = _linkages(raw, losses)
    rise = _rise(raw.i.imag)
    torque = _torque(psi + psi_f_Vs * turned + more_Vs, raw.i + more_A)[rise]
    i_q = raw.i.imag[rise]
    impulse = np.maximum.accumulate(np.cumsum(torque * np.sign(i_q[-1])))
    reached = np.maximum.accumulate(np.abs(i_q))
    half = 0.5 * float(np.interp(top_A, reached, impulse))
    return float(np.clip(np.interp(half, impulse, reached) / min(top_A, float(reached[-1])), *FIRST))


def at_bias(last: Raw, share: float, off_A: float, i_max_A: float) -> tuple[float, float]:
    """Voltage and bound of the next burst along q. The movement falls with the square of the voltage (CM-28); a higher
    one than needed leaves fewer samples, and the current misses its bound by more.

    share   of the last burst
    off_A   the largest current along d
    """
    reach_A = LEVELS[-1] * i_max_A
    steepest_A = _steepest_within(last, share, math.sqrt(reach_A**2 - off_A**2))
    low, high = (_voltage(steepest_A, i_max_A, step) for step in BIAS_STEPS)
    wanted = share * math.sqrt(last.moved_rad / MOVED_RAD)
    following = min(max(wanted, low), high, FASTER * share)
    reach_A -= MISSED * max(following * steepest_A - BIAS_STEPS[0] * i_max_A, 0.0)
    return following, math.sqrt(reach_A**2 - off_A**2)


def _ladder(drive: Capture, known: Nameplate, losses: Losses, steepest_A: float,
            of_q: bool) -> list[Raw]:  # fmt: skip
    """Larger and larger currents along one axis: each level's steepest change limits the voltage of the next."""
    raws: list[Raw] = []
    i_max_A = known.i_max_A
    for level in LEVELS:
        top = level * i_max_A
        share = _voltage(GROWTH * steepest_A, i_max_A, STEP_Q if of_q else STEP_D)
        free = (-top, top)
        if of_q:
            half = balanced(raws[-1], losses, magnet_Vs(raws, losses, known.psi_f_Vs), top) if raws else Burst.first
            burst = Burst(0.0, share, free, free, REVERSALS_Q, first=half)
        else:
            burst = Burst(share, 0.0, (-top, TOP_D * i_max_A), free, REVERSALS_D)
        raws.append(record(drive, burst, known))
        if raws[-1].failure:
            raise FluxtrueError(
                f"commission: pulses along {'q' if of_q else 'd'} up to {top:.3g} A: {raws[-1].failure}"
            )
        steepest_A = max(_steepest(raws[-1], share, of_q), steepest_A)
    return raws


def sweep(drive: Capture, found: First, known: Nameplate, losses: Losses) -> list[Raw]:
    """d alone, q alone, then q at each bias of d."""
    period_s, i_max_A = drive.period_s, known.i_max_A
    along_d = _ladder(drive, known, losses, found.volts * period_s / found.l_d_H, of_q=False)
    along_q = _ladder(drive, known, losses, found.volts * period_s / found.l_q_H, of_q=True)
    raws = [*along_d, *along_q]
    steep_d = found.volts * period_s / found.l_d_H
    v_d = _voltage(steep_d, i_max_A, BAND_STEP)
    band, v_q = BAND * i_max_A, float(np.abs(along_q[-1].u.imag).max()) / found.volts
    last, centre = along_q[-1], 0.0  # the last burst that is valid, from which the next one is planned
    for bias in np.repeat(BIASES, BURSTS):
        target, delay = -bias * i_max_A, math.ceil(TRAVEL * bias * i_max_A / (v_d * steep_d))
        more_A = target - centre
        share, top = at_bias(last, v_q, abs(target) + band, i_max_A)
        psi_f_Vs = magnet_Vs([raw for raw in raws[len(along_d) :] if raw.is_valid], losses, known.psi_f_Vs)
        half = balanced(last, losses, psi_f_Vs, top, more_A, found.l_d_H * more_A)
        raws.append(record(drive, Burst(v_d, share, (target - band, target + band), (-top, top), REVERSALS_Q, delay,
                                        half), known))  # fmt: skip
        if raws[-1].is_valid:
            last, centre, v_q = raws[-1], target, share
    return raws
