# SPDX-License-Identifier: Apache-2.0
"""Which bursts measure the flux map: small ones first, whose inductances choose the voltage of the large ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fluxtrue_tools.commission.along_q import AlongQ, Next, Taken
from fluxtrue_tools.commission.bursts import TOO_LARGE, Burst, Raw, integrate, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.first_inductance import inductance_H
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.shown import Losses
from fluxtrue_tools.errors import FluxtrueError

FIRST_VOLTAGE = 0.15  # with the smallest inductance that is allowed for, 0.2 of i_max in a period
FIRST_CURRENT = 0.1  # of i_max
VOLTAGES = (0.12, 0.69)  # shares of the largest one
TOGETHER = 0.8  # root of the sum of the squares of both axes' voltages: beyond it the duties of a phase reach what the
# bridge can make, (MO-8)
UNSEEN = 0.55  # along q of the lowest voltage that is tried: at most so much if the highest would change the current by
# SLOW or more in a period, because a saturation that is not known yet would let the current miss its bound
SLOW = 0.06  # of i_max
ABOVE_DROP = 1.8  # times what the winding drops
STEP_D = 0.12  # of i_max: change of the current in a period at most
STEP_Q = 0.13  # the same along q, at the lowest voltage that is tried
BIAS_STEP = 0.15  # the same at a bias, where the last burst has shown the steepest change
BAND_STEP = 0.06  # of i_max: change of the current along d in a period at a bias, so that it stays in its band
NEAR = 0.9  # of a bound: beyond it the steepest change is known
FASTER = 2.0  # times the last voltage at most: the lowest one that is tried at the next bias
GROWTH = 1.3  # of the steepest change, from one level to the next
LEVELS = (0.35, 0.65, 0.93)  # of i_max
LEVELS_Q = (0.35, 0.5, 0.65, 0.8, 0.93)  # the same along q: each shows how the machine saturates up to the next one
TOP_D = 0.1  # of i_max: the magnetising side
BAND = 0.05  # of i_max: half the width of the bias
BIASES = (0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.85)  # of -i_max
BURSTS = 2  # at each of them: a short one moves the rotor less than a long one with as many samples
LOST_MAX = 2  # bursts of all that may fail
AGAIN = 2  # a burst of a level whose current was too large is taken again, so often at most
TRAVEL = 1.5  # of the time to the bias without saturation
REVERSALS_D = 4
LESS = 0.95  # of its bound, for a burst along d after one whose current was too large
FAR_RAD = 0.0087  # electrical, half a degree: a level along d that is expected to move the rotor further has two bursts


@dataclass(frozen=True)
class First:
    """The inductances of the small bursts, and the voltage of a share of 1.

    The first two choose the voltages of what follows. Their legs' voltage is taken as constant although the drive
    compensates it one sample late, which makes them a fifth to a third too large. The last two are without this error.
    """

    l_d_H: float
    l_q_H: float
    volts: float
    exact_d_H: float = 0.0  # 0: the voltage that the legs lose was not measured yet
    exact_q_H: float = 0.0

    @property
    def found_H(self) -> tuple[float, float]:
        """Along d and q, as exact as they are known."""
        return self.exact_d_H or self.l_d_H, self.exact_q_H or self.l_q_H


@dataclass(frozen=True)
class Legs:
    """What a leg loses and what of it the drive compensates, as soon as it is measured."""

    total_V: float
    knee_A: float
    compensated_V: float
    compensated_knee_A: float


def _positive(found_H: float, of_q: bool) -> float:
    """An inductance, or the reason why there is none."""
    if not found_H > 0.0:
        raise FluxtrueError(f"commission: an inductance of {found_H:g} H in the {'q' if of_q else 'd'} axis: phases or "
                            "sensors are not connected as assumed")  # fmt: skip
    return found_H


def _inductance(raw: Raw, losses: Losses, of_q: bool) -> float:
    """Slope of the flux linkage over the current of one axis."""
    linkage = integrate(raw, losses.r_ohm)
    psi = linkage.psi + losses.level_V * linkage.of_level
    slope = float(np.polyfit(*((linkage.i.imag, psi.imag) if of_q else (linkage.i.real, psi.real)), 1)[0])
    return _positive(slope, of_q)


def _exact(raw: Raw, known: Nameplate, r_ohm: float, legs: Legs, of_q: bool) -> float:
    """With the voltage that the drive's compensation has added, (CM-12), and all that the legs lose."""
    acting = raw.compensated(known.offset_A, legs.compensated_V, legs.compensated_knee_A)
    return _positive(inductance_H(acting, r_ohm, legs.total_V, legs.knee_A, of_q), of_q)


def first(drive: Capture, known: Nameplate, losses: Losses, legs: Legs | None = None) -> First:
    """Small bursts along d and q."""
    small, v = FIRST_CURRENT * known.i_max_A, FIRST_VOLTAGE
    band = (-small, small)
    along_d = record(drive, Burst(v, 0.0, band, band, 5), known)
    along_q = record(drive, Burst(0.0, v, band, band, 5), known)
    for raw, axis in ((along_d, "d"), (along_q, "q")):
        if raw.failure:
            raise FluxtrueError(f"commission: first pulses along {axis}: {raw.failure}")
    volts = float(np.abs(along_d.u).max()) / v
    exact = (0.0, 0.0)
    if legs is not None:
        exact = (_exact(along_d, known, losses.r_ohm, legs, of_q=False),
                 _exact(along_q, known, losses.r_ohm, legs, of_q=True))  # fmt: skip
    return First(_inductance(along_d, losses, of_q=False), _inductance(along_q, losses, of_q=True), volts, *exact)


def _highest(steepest_A: float, i_max_A: float) -> float:
    """The largest share, by the steepest change of a current seen so far."""
    return VOLTAGES[1] if VOLTAGES[1] * steepest_A < SLOW * i_max_A else UNSEEN


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


def at_bias(seen: Sequence[Taken], off_A: float, i_max_A: float) -> tuple[float, float]:
    """Voltage and bound of the next burst along q.

    seen    the last bursts; of one that ended far below the bound the steepest change is not known
    off_A   the largest current along d
    """
    last, top_A = seen[-1], math.sqrt((LEVELS_Q[-1] * i_max_A) ** 2 - off_A**2)
    trusted = seen[-1:] if np.abs(last.of.raw.i.imag).max() > NEAR * top_A else seen
    steepest_A = max(_steepest_within(each.of.raw, each.share, top_A) for each in trusted)
    highest = _highest(_steepest(last.of.raw, last.share, of_q=True), i_max_A)
    return min(_voltage(steepest_A, i_max_A, BIAS_STEP), FASTER * last.share, highest), top_A


def _checked(raw: Raw, axis: str, top_A: float) -> Raw:
    if raw.failure:
        raise FluxtrueError(f"commission: pulses along {axis} up to {top_A:.3g} A: {raw.failure}")
    return raw


def _of_level(top_A: float, steepest_A: float, step: float, known: Nameplate, losses: Losses, volts: float) -> float:
    """The voltage of a larger current than before. It is well above what the winding drops: a current that rises
    slowly leaves time to turn the rotor.

    volts   of a share of 1
    """
    least = ABOVE_DROP * losses.r_ohm * top_A / volts
    return min(max(_voltage(GROWTH * steepest_A, known.i_max_A, step), least), _highest(steepest_A, known.i_max_A))


def _within(drive: Capture, burst: Burst, known: Nameplate) -> Raw:
    """A burst along d. If its current was too large it is taken again with a smaller lower bound: by how much a current
    misses its bound differs from burst to burst."""
    for _ in range(AGAIN):
        raw = record(drive, burst, known)
        if raw.failure != TOO_LARGE:
            return raw
        burst = replace(burst, d=(LESS * burst.d[0], burst.d[1]))
    return record(drive, burst, known)


def _ladder_d(drive: Capture, known: Nameplate, losses: Losses, volts: float, steepest_A: float) -> list[Raw]:
    """Larger and larger currents: each level's steepest change limits the voltage of the next.

    Nothing holds the current along q at zero: it grows with the time, and moves the rotor by the third power of it. A
    level that would move it far has two bursts with half of the reversals each."""
    raws: list[Raw] = []
    parts, moved = 1, 0.0  # bursts of a level; movement of the last one by the third power of its time
    for level in LEVELS:
        top_A = level * known.i_max_A
        share = _of_level(top_A, steepest_A, STEP_D, known, losses, volts)
        parts = 2 if moved * (top_A / share) ** 3 > FAR_RAD else parts
        burst = Burst(share, 0.0, (-top_A, TOP_D * known.i_max_A), (-top_A, top_A), REVERSALS_D // parts)
        raws += [_checked(_within(drive, burst, known), "d", top_A) for _ in range(parts)]
        moved = raws[-1].moved_rad * (share / top_A) ** 3
        steepest_A = max(*(_steepest(raw, share, of_q=False) for raw in raws[-parts:]), steepest_A)
    return raws


def _ladder_q(along: AlongQ, known: Nameplate, losses: Losses, volts: float, steepest_A: float) -> list[Raw]:
    """The same along q, with little movement of the rotor."""
    raws: list[Raw] = []
    for level in LEVELS_Q:
        top_A = level * known.i_max_A
        for _ in range(AGAIN + 1):
            share = _of_level(top_A, steepest_A, STEP_Q, known, losses, volts)
            following = Next(share, top_A)
            share, waves = along.waves(following)
            raw = along.record(0.0, share, (-top_A, top_A), waves, following)
            steepest_A = max(_steepest(raw, share, of_q=True), steepest_A)
            if raw.failure != TOO_LARGE:
                break
        raws.append(_checked(raw, "q", waves.top_A))
    return raws


def _at_biases(along: AlongQ, drive: Capture, found: First, known: Nameplate) -> list[Raw]:
    """Along q at each bias of d."""
    i_max_A, steep_d = known.i_max_A, found.volts * drive.period_s / found.l_d_H
    band = BAND * i_max_A
    v_d = min(_voltage(steep_d, i_max_A, BAND_STEP), math.sqrt(TOGETHER**2 - VOLTAGES[1] ** 2))
    raws = []
    for bias in np.repeat(BIASES, BURSTS):
        target, off_A = -bias * i_max_A, (bias + BAND) * i_max_A
        share, top_A = at_bias(along.taken[-2:], off_A, i_max_A)
        delay = math.ceil(TRAVEL * bias * i_max_A / (v_d * steep_d))
        following = Next(share, top_A, target, off_A, delay)
        share, waves = along.waves(following)
        raws.append(along.record(v_d, share, (target - band, target + band), waves, following))
    return raws


def sweep(drive: Capture, found: First, known: Nameplate, losses: Losses) -> list[Raw]:
    """d alone, q alone, then q at each bias of d."""
    per_period = found.volts * drive.period_s
    along_d = _ladder_d(drive, known, losses, found.volts, per_period / found.l_d_H)
    along = AlongQ(drive, known, losses, found.volts, found.l_d_H)
    along_q = _ladder_q(along, known, losses, found.volts, per_period / found.l_q_H)
    return [*along_d, *along_q, *_at_biases(along, drive, found, known)]
