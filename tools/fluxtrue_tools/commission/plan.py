# SPDX-License-Identifier: Apache-2.0
"""Which bursts measure the flux map: small ones first, whose inductances choose the voltage of the large ones."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Burst, Raw, integrate, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.errors import FluxtrueError

FIRST_VOLTAGE = 0.15  # with the smallest inductance that is allowed for, 0.2 of i_max in a period
FIRST_CURRENT = 0.1  # of i_max
VOLTAGES = (0.12, 0.55)
STEP = 0.12  # of i_max: change of the current in a period at most
GROWTH = 1.3  # of the steepest change, from one level to the next
LEVELS = (0.35, 0.65, 0.93)  # of i_max
TOP_D = 0.1  # of i_max: the magnetising side
BAND = 0.05  # of i_max: half the width of the bias
BIASES = (0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.85)  # of -i_max
BIAS_SLOWER = 3.5  # the current in d changes more slowly than that in q, and stays in its band
LOST_MAX = 2  # bursts of all that may fail
TRAVEL = 1.5  # of the time to the bias without saturation
REVERSALS_D, REVERSALS_Q = 6, 5
FIRST = (0.4, 0.9)  # share of its bound at which the first half wave may end
BEGUN = 0.1  # of the range of the impulse: beyond the noise


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


def _voltage(steepest_A: float, i_max_A: float) -> float:
    """The share at which the current changes by STEP in a period; steepest_A: its change with a share of 1."""
    return float(np.clip(STEP * i_max_A / steepest_A, *VOLTAGES))


def _steepest(raw: Raw, share: float, of_q: bool) -> float:
    """The largest change of a current in a period, for a share of 1."""
    i = raw.i.imag if of_q else raw.i.real
    return float(np.abs(np.diff(i)).max()) / share


def _balanced(share: float, raw: Raw) -> float:
    """The share of its bound at which the first half wave of q should have ended: (CM-27). The impulse is about the
    sum of i_q, and that of a half wave grows with about the square of its largest current."""
    impulse = np.cumsum(raw.i.imag)
    both = float(np.ptp(impulse))  # the second half wave
    begins = np.sign(impulse[np.argmax(np.abs(impulse) > BEGUN * both)])
    first_one = max(float((begins * impulse).max()), BEGUN * both)
    return float(np.clip(share * math.sqrt(0.5 * both / first_one), *FIRST))


def _ladder(drive: Capture, known: Nameplate, steepest_A: float, of_q: bool) -> tuple[list[Raw], float]:
    """Larger and larger currents along one axis: each level's steepest change limits the voltage of the next."""
    raws: list[Raw] = []
    i_max_A = known.i_max_A
    for level in LEVELS:
        top = level * i_max_A
        share = _voltage(GROWTH * steepest_A, i_max_A)
        free = (-top, top)
        burst = (Burst(0.0, share, free, (-top, top), REVERSALS_Q) if of_q else
                 Burst(share, 0.0, (-top, TOP_D * i_max_A), free, REVERSALS_D))  # fmt: skip
        raws.append(record(drive, burst, known))
        if raws[-1].failure:
            raise FluxtrueError(
                f"commission: pulses along {'q' if of_q else 'd'} up to {top:.3g} A: {raws[-1].failure}"
            )
        steepest_A = max(_steepest(raws[-1], share, of_q), steepest_A)
    return raws, steepest_A


def sweep(drive: Capture, found: First, known: Nameplate) -> list[Raw]:
    """d alone, q alone, then q at each bias of d."""
    period_s, i_max_A = drive.period_s, known.i_max_A
    along_d, steep_d = _ladder(drive, known, found.volts * period_s / found.l_d_H, of_q=False)
    along_q, steep_q = _ladder(drive, known, found.volts * period_s / found.l_q_H, of_q=True)
    raws = [*along_d, *along_q]
    v_d, v_q = _voltage(BIAS_SLOWER * steep_d, i_max_A), _voltage(steep_q, i_max_A)
    per_period = v_d * found.volts * period_s / found.l_d_H
    band = BAND * i_max_A
    share = _balanced(Burst.first, along_q[-1])
    for bias in BIASES:
        centre, delay = -bias * i_max_A, math.ceil(TRAVEL * bias * i_max_A / per_period)
        top = math.sqrt((LEVELS[-1] * i_max_A) ** 2 - (abs(centre) + band) ** 2)
        raws.append(record(drive, Burst(v_d, v_q, (centre - band, centre + band), (-top, top), REVERSALS_Q, delay,
                                        share), known))  # fmt: skip
        share = _balanced(share, raws[-1])
    return raws
