# SPDX-License-Identifier: Apache-2.0
"""One burst along q after the other, each planned so that it moves the rotor little: (CM-45)."""

import math
from dataclasses import dataclass, replace

from fluxtrue_tools.commission.bursts import TOO_LARGE, Burst, Raw, record, shift
from fluxtrue_tools.commission.drive import STANDING_RPM, Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.shown import Losses, Shown, drift, machine, magnet_Vs, rad_per_torque, shown
from fluxtrue_tools.commission.swing import REVERSALS, Waves, quietest

TRIED = (1.0, 1.25, 1.55, 1.9)  # times a burst's voltage: what the computed movement and current choose from
SMALLER = 0.7  # times its bound, if no current is small enough
HIGHEST = 0.68  # share of the largest voltage up to which they may raise it
NEWEST = 6  # bursts that show how heavy the rotor is
SHOWN = 10  # samples of the pulses along q: with fewer a burst shows nothing of the machine


@dataclass(frozen=True)
class Taken:
    """A burst along q from which the next one is planned."""

    of: Shown
    share: float  # of the largest voltage
    along_d_A: float = 0.0
    delay: int = 0


@dataclass(frozen=True)
class Next:
    """A burst along q that is to be planned."""

    share: float  # of the largest voltage: the lowest that is tried
    top_A: float
    along_d_A: float = 0.0  # the bias
    off_A: float = 0.0  # the largest current along d
    delay: int = 0


def burst(v_d: float, share: float, d: tuple[float, float], waves: Waves, delay: int = 0) -> Burst:
    """What the firmware is asked for."""
    return Burst(v_d, share, d, (waves.low_A, waves.high_A), REVERSALS, delay, waves.first)


class AlongQ:
    """The bursts along q, each planned with what the last ones have shown."""

    def __init__(self, drive: Capture, known: Nameplate, losses: Losses, volts: float, l_d_H: float) -> None:
        """volts: of a share of 1."""
        self._drive, self._known, self._losses = drive, known, losses
        self._volts, self._l_d_H = volts, l_d_H
        self.taken: list[Taken] = []  # the valid ones
        self._newest: Taken | None = None  # also one whose current was too large: it shows the machine none the less

    def _quietest(self, following: Next, newest: Taken) -> tuple[float, Waves] | None:
        """Share of the voltage and half waves, chosen by (CM-45); None if the current of each may be too large."""
        known, losses = self._known, self._losses
        bursts = [each.of for each in self.taken]
        psi_f_Vs = magnet_Vs(bursts, known.psi_f_Vs)
        turns = rad_per_torque(bursts[-NEWEST:], psi_f_Vs)
        more_A = following.along_d_A - newest.along_d_A
        pulses = newest.of.since(newest.delay)
        along = machine(pulses, losses, psi_f_Vs, turns, known.i_max_A, following.along_d_A, more_A,
                        self._l_d_H * more_A)  # fmt: skip
        along = replace(along, offset_A=shift(self._drive, known).imag)
        before = drift(newest.of, psi_f_Vs, turns, newest.delay, following.delay)
        left_rad_s = STANDING_RPM * math.pi / 30.0 * known.pole_pairs
        before = replace(before, uncertain_rad=left_rad_s * newest.of.raw.period_s)
        limit_A = math.sqrt(known.i_max_A**2 - following.off_A**2)
        shares = sorted({min(step * following.share, max(following.share, HIGHEST)) for step in TRIED})
        chosen = quietest(along, [share * self._volts for share in shares], following.top_A, limit_A, before,
                          self._drive.rest)  # fmt: skip
        return None if chosen is None else (chosen[0] / self._volts, chosen[1])

    def waves(self, following: Next) -> tuple[float, Waves]:
        """Share of the voltage and half waves. The first burst, and one that has no current that is small enough, have
        the balance of a machine without saturation; the latter has a smaller bound, as has a first burst that is taken
        again."""
        plain = Waves(-following.top_A, following.top_A, Burst.first)
        if self._newest is None:
            return following.share, plain
        smaller = Waves(SMALLER * plain.low_A, SMALLER * plain.high_A, plain.first)
        return (self._quietest(following, self._newest) if self.taken else None) or (following.share, smaller)

    def record(self, v_d: float, share: float, d: tuple[float, float], waves: Waves, following: Next) -> Raw:
        """A burst, from which the next one is planned."""
        raw = record(self._drive, burst(v_d, share, d, waves, following.delay), self._known)
        taken = Taken(shown(raw, self._losses), share, following.along_d_A, following.delay)
        if (raw.is_valid or raw.failure == TOO_LARGE) and len(raw.i) > following.delay + SHOWN:
            self._newest = taken
        if raw.is_valid:
            self.taken.append(taken)
        return raw
