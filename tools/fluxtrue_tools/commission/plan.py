# SPDX-License-Identifier: Apache-2.0
"""Which bursts measure the flux map: small ones first, whose inductances choose the voltage of the large ones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.bursts import Burst, Raw, integrate, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.impulse import Losses, balanced, magnet_Vs
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.swing import LONG, SHORT, SWING_RAD, Waves, quietest, response
from fluxtrue_tools.errors import FluxtrueError

FIRST_VOLTAGE = 0.15  # with the smallest inductance that is allowed for, 0.2 of i_max in a period
FIRST_CURRENT = 0.1  # of i_max
VOLTAGES = (0.12, 0.69)
TOGETHER = 0.8  # root of the sum of the squares of both axes' voltages: beyond it the duties of a phase reach what the
# bridge can make, (MO-8)
UNSEEN = 0.55  # the largest voltage if that of VOLTAGES would change the current by SLOW or more in a period: a
# saturation that is not known yet would let the current miss its bound
SLOW = 0.06  # of i_max
ABOVE_DROP = 1.8  # times what the winding drops
STEP_D, STEP_Q = 0.12, 0.13  # of i_max: change of the current in a period at most
BIAS_STEPS = (0.15, 0.2)  # of i_max: the same at a bias, where the last burst has shown the steepest change
MISSED = 0.5  # of what the change is larger than the first of the two: by so much less is the bound
BAND_STEP = 0.04  # of i_max: change of the current along d in a period at a bias, so that it stays in its band
NEAR = 0.9  # of a bound: beyond it the steepest change is known
FASTER = 2.0  # at most, from one bias to the next
GROWTH = 1.3  # of the steepest change, from one level to the next
LEVELS = (0.35, 0.65, 0.93)  # of i_max
TOP_D = 0.1  # of i_max: the magnetising side
BAND = 0.05  # of i_max: half the width of the bias
BIASES = (0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.85)  # of -i_max
BURSTS = 2  # at each of them: a short one moves the rotor less than a long one with as many samples
LOST_MAX = 2  # bursts of all that may fail
TRAVEL = 1.5  # of the time to the bias without saturation
REVERSALS_D = 4
FAR_RAD = 0.0087  # electrical, half a degree: what is expected to move the rotor further is planned for less movement:
FAR_PART = 0.47  # the impulse of the first half wave, of the next one's: the rotor swings to both sides, (CM-43)
FAR_STEP = 0.18  # of i_max: change of a current that rises
FAR_VOLTAGE = 0.68  # at most
FAR_NEXT = 1.25  # of the last bound along q: a larger one has a level between them
MOVED_RAD = 0.004  # electrical: by which a burst at a bias may move the rotor without a higher voltage for the next
SMALLER = 0.9  # at least, of its bound, for a burst after one that has moved the rotor far
LONG_LESS = 2.0  # times less than three half waves move five of them the rotor, (CM-41)


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


def _inductance(raw: Raw, losses: Losses, of_q: bool, knee_A: float = 0.0) -> float:
    """Slope of the flux linkage over the current of one axis."""
    linkage = integrate(raw, losses.r_ohm, knee_A)
    psi = linkage.psi + losses.level_V * linkage.of_level
    slope = float(np.polyfit(*((linkage.i.imag, psi.imag) if of_q else (linkage.i.real, psi.real)), 1)[0])
    if not slope > 0.0:
        raise FluxtrueError(f"commission: an inductance of {slope:g} H in the {'q' if of_q else 'd'} axis: phases or "
                            "sensors are not connected as assumed")  # fmt: skip
    return slope


def _exact(raw: Raw, known: Nameplate, r_ohm: float, legs: Legs, of_q: bool) -> float:
    """With the voltage that the drive's compensation has added, (CM-12), and all that the legs lose."""
    acting = raw.compensated(known.offset_A, legs.compensated_V, legs.compensated_knee_A)
    return _inductance(acting, Losses(r_ohm, legs.total_V), of_q, legs.knee_A)


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


def _steepest_within(raw: Raw, share: float, top_A: float, is_rising: bool = False) -> float:
    """The largest change of the current along q in a period that begins or ends within a bound, for a share of 1;
    is_rising: only of those away from zero."""
    i = raw.i.imag
    changes = np.abs(np.diff(i))
    inside = np.minimum(np.abs(i[1:]), np.abs(i[:-1])) < top_A
    if is_rising:
        inside &= np.abs(i[1:]) > np.abs(i[:-1])
    return float(changes[inside].max()) / share


@dataclass(frozen=True)
class Taken:
    """A burst along q from which the next one is planned."""

    raw: Raw
    share: float  # of the largest voltage
    waves: Waves
    along_d_A: float = 0.0

    def expected_rad(self, top_A: float, share: float) -> float:
        """The movement by three half waves, (CM-28)."""
        as_short = LONG_LESS if self.waves.reversals == LONG else 1.0
        return as_short * self.raw.moved_rad * (top_A / self.waves.high_A) ** 3 * (self.share / share) ** 2

    def quiet_A(self, top_A: float, share: float) -> float:
        """The bound of a burst of three half waves: smaller if it would move the rotor too far."""
        moved_rad = self.expected_rad(top_A, share)
        return top_A * min(max((SWING_RAD / max(moved_rad, SWING_RAD)) ** (1.0 / 3.0), SMALLER), 1.0)

    def far_share(self, top_A: float, i_max_A: float) -> float:
        """The voltage at which the current rises by FAR_STEP in a period. It falls faster, because winding and legs
        help, but then its bound cannot be missed. Beyond what this burst has reached saturation goes on."""
        growth = max(top_A / float(np.abs(self.raw.i.imag).max()), 1.0)
        steepest_A = growth * _steepest_within(self.raw, self.share, top_A, is_rising=True)
        return min(_voltage(steepest_A, i_max_A, FAR_STEP), FAR_VOLTAGE)


def _expected_rad(taken: Sequence[Taken], top_A: float, share: float) -> float:
    """By the one of the last bursts that moved the rotor most: that another one was balanced better was chance."""
    return max(each.expected_rad(top_A, share) for each in taken)


def _waves(taken: Sequence[Taken], share: float, volts: float, top_A: float, losses: Losses, guess_Vs: float,
           more_A: float = 0.0, more_Vs: float = 0.0) -> Waves:  # fmt: skip
    """Of the next burst. What moves the rotor less is a higher voltage; only where there is none is it slow enough, and
    of so little saturation, that its movement can be computed.

    volts             of a share of 1
    guess_Vs          of the magnet
    more_A, more_Vs   current and flux linkage along d that the next burst has more than the last one
    """
    last = taken[-1]
    if share >= VOLTAGES[1]:
        return quietest(response(last.raw), share * volts, top_A)
    part = FAR_PART if _expected_rad(taken[-2:], top_A, share) > FAR_RAD else 0.5
    top_A = last.quiet_A(top_A, share)
    psi_f_Vs = magnet_Vs([each.raw for each in taken], losses, guess_Vs)
    return Waves(-top_A, top_A, balanced(last.raw, losses, psi_f_Vs, top_A, more_A, more_Vs, part), SHORT)


def _along_q(v_d: float, share: float, d: tuple[float, float], waves: Waves, delay: int = 0) -> Burst:
    return Burst(v_d, share, d, (waves.low_A, waves.high_A), waves.reversals, delay, waves.first)


def at_bias(seen: Sequence[Taken], off_A: float, i_max_A: float) -> tuple[float, float]:
    """Voltage and bound of the next burst along q. The movement falls with the square of the voltage (CM-28); a higher
    one than needed leaves fewer samples, and the current misses its bound by more.

    seen    the last bursts; of one that ended far below the bound the steepest change is not known
    off_A   the largest current along d
    """
    last, reach_A = seen[-1], LEVELS[-1] * i_max_A
    top_A = math.sqrt(reach_A**2 - off_A**2)
    trusted = seen[-1:] if np.abs(last.raw.i.imag).max() > NEAR * top_A else seen
    steepest_A = max(_steepest_within(each.raw, each.share, top_A) for each in trusted)
    low, high = (_voltage(steepest_A, i_max_A, step) for step in BIAS_STEPS)
    wanted = last.share * math.sqrt(last.raw.moved_rad / MOVED_RAD)
    highest = _highest(_steepest(last.raw, last.share, of_q=True), i_max_A)
    following = min(max(wanted, low), high, FASTER * last.share, highest)
    if _expected_rad(seen, top_A, following) > FAR_RAD:
        following = max(following, min(last.far_share(top_A, i_max_A), FASTER * last.share))
    reach_A -= MISSED * max(following * steepest_A - BIAS_STEPS[0] * i_max_A, 0.0)
    return following, math.sqrt(reach_A**2 - off_A**2)


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
        raws += [_checked(record(drive, burst, known), "d", top_A) for _ in range(parts)]
        moved = raws[-1].moved_rad * (share / top_A) ** 3
        steepest_A = max(*(_steepest(raw, share, of_q=False) for raw in raws[-parts:]), steepest_A)
    return raws


def _not_far_beyond(top_A: float, last_A: float) -> float:
    """A bound for which the last burst shows how the machine saturates: the next one, or one in the middle."""
    return top_A if top_A <= FAR_NEXT * last_A else max(0.5 * (top_A + last_A), last_A)


def _ladder_q(drive: Capture, known: Nameplate, losses: Losses, volts: float, steepest_A: float) -> list[Taken]:
    """The same along q, with little movement of the rotor."""
    taken: list[Taken] = []
    levels = [level * known.i_max_A for level in LEVELS]
    while levels:
        top_A = levels[0]
        share = _of_level(top_A, steepest_A, STEP_Q, known, losses, volts)
        waves = Waves(-top_A, top_A, Burst.first, SHORT)
        if taken:
            last = taken[-1]
            if share < VOLTAGES[1] and last.expected_rad(top_A, share) > FAR_RAD:
                top_A = _not_far_beyond(top_A, last.waves.high_A)
                share = max(share, last.far_share(top_A, known.i_max_A))
            waves = _waves(taken, share, volts, top_A, losses, known.psi_f_Vs)
        burst = _along_q(0.0, share, (-top_A, top_A), waves)
        raw = _checked(record(drive, burst, known), "q", waves.high_A)
        taken.append(Taken(raw, share, waves))
        steepest_A = max(_steepest(raw, share, of_q=True), steepest_A)
        levels = levels[1:] if top_A == levels[0] else levels
    return taken


def _at_biases(drive: Capture, found: First, known: Nameplate, losses: Losses,
               along_q: list[Taken]) -> list[Raw]:  # fmt: skip
    """Along q at each bias of d, each planned from the last burst that is valid."""
    i_max_A, steep_d = known.i_max_A, found.volts * drive.period_s / found.l_d_H
    band = BAND * i_max_A
    taken, raws = list(along_q), []
    for bias in np.repeat(BIASES, BURSTS):
        target = -bias * i_max_A
        share, top_A = at_bias(taken[-2:], abs(target) + band, i_max_A)
        v_d = min(_voltage(steep_d, i_max_A, BAND_STEP), math.sqrt(TOGETHER**2 - share**2))
        delay = math.ceil(TRAVEL * bias * i_max_A / (v_d * steep_d))
        more_A = target - taken[-1].along_d_A
        waves = _waves(taken, share, found.volts, top_A, losses, known.psi_f_Vs, more_A, found.l_d_H * more_A)
        raws.append(record(drive, _along_q(v_d, share, (target - band, target + band), waves, delay), known))
        if raws[-1].is_valid:
            taken.append(Taken(raws[-1], share, waves, target))
    return raws


def sweep(drive: Capture, found: First, known: Nameplate, losses: Losses) -> list[Raw]:
    """d alone, q alone, then q at each bias of d."""
    per_period = found.volts * drive.period_s
    along_d = _ladder_d(drive, known, losses, found.volts, per_period / found.l_d_H)
    along_q = _ladder_q(drive, known, losses, found.volts, per_period / found.l_q_H)
    return [*along_d, *(each.raw for each in along_q), *_at_biases(drive, found, known, losses, along_q)]
