# SPDX-License-Identifier: Apache-2.0
"""Resistance and voltage error of the inverter by direct currents along the magnet: (CM-12).

The firmware's own measurement needs a current control that is tuned to the machine. Here voltage pulses hold both
currents between two bounds instead, for a time that is too short for the rotor to turn far.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from fluxtrue_tools.commission.bursts import FAILURES, Burst, Linkage, Raw, integrate, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.plan import First
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

LEVELS = (0.45, 0.6, 0.72, 0.85)  # of i_max: where the ripple does not change the sign of a phase current
BAND = 0.05  # of i_max: half the width of a level
STEP = 0.015  # of i_max: change of the current in a period
SECONDS = 0.05  # of a level
LEAST_D, LEAST_Q, MOST = 0.08, 0.1, 0.5  # of the largest voltage: more than the drop of R, more than a leg loses
RESOLUTION = 1.5e-4  # of the largest voltage: what a mean voltage is certain to
TRIES = 3
LEAST_PERIODS = 100  # at a level
UNLIMITED = 1000  # reversals: the time ends a level
TIME = FAILURES[4]
REPEATS = 2


@dataclass(frozen=True)
class Resistance:
    """What the levels gave: sigma is what noise and the resolution of the voltage leave."""

    r_ohm: float
    r_sigma_ohm: float
    level_V: float  # lost by a leg, beyond what is compensated
    compensated_V: float
    currents_A: Array  # mean of each level
    volts: Array

    @property
    def total_V(self) -> float:
        """Lost by a leg."""
        return self.level_V + self.compensated_V

    def dead_time_s(self, vdc_V: float, pwm_hz: float) -> float:
        """Which dead time alone would lose this voltage."""
        return max(self.total_V, 0.0) / (vdc_V * pwm_hz)


def duration_s() -> float:
    """Of all currents."""
    return 2 * REPEATS * len(LEVELS) * SECONDS


def _equations(linkages: list[Linkage]) -> tuple[Array, Array]:
    """(CM-12): unknown are resistance, voltage of a leg, and for each level an inductance and a flux linkage."""
    blocks, right = [], []
    for n, linkage in enumerate(linkages):
        block = np.zeros((len(linkage.i), 2 + 2 * len(linkages)))
        block[:, 0], block[:, 1] = -linkage.of_r.real, -linkage.of_level.real
        block[:, 2 + 2 * n], block[:, 3 + 2 * n] = linkage.i.real, 1.0
        blocks.append(block)
        right.append(linkage.psi.real)
    return np.vstack(blocks), np.concatenate(right)


def solve(raws: list[Raw], knee_A: float, compensated_V: float = 0.0) -> Resistance:
    """All levels at once."""
    rows, values = _equations([integrate(raw, 0.0, knee_A) for raw in raws])
    scale = np.linalg.norm(rows, axis=0)
    x, *_ = np.linalg.lstsq(rows / scale, values, rcond=None)
    left = values - (rows / scale) @ x
    x = x / scale
    variance = float(left @ left) / (len(values) - len(x))
    sigma = float(np.sqrt(variance * np.linalg.inv((rows / scale).T @ (rows / scale))[0, 0])) / float(scale[0])
    means = np.array([(raw.i.real.mean(), raw.u.real.mean()) for raw in raws])
    return Resistance(float(x[0]), sigma, float(x[1]), compensated_V, means[:, 0], means[:, 1])


def measure(drive: Capture, known: Nameplate, first: First, knee_A: float) -> Resistance:
    """Both polarities of each level."""
    i_max_A = known.i_max_A
    per_period = STEP * i_max_A / (drive.period_s * first.volts)
    v_d = min(max(per_period * first.l_d_H, LEAST_D), MOST)
    v_q = min(max(per_period * first.l_q_H, LEAST_Q), MOST)
    band, raws = BAND * i_max_A, []
    for level in (sign * level * i_max_A for _ in range(REPEATS) for level in LEVELS for sign in (1.0, -1.0)):
        burst = Burst(v_d, v_q, (level - band, level + band), (-band, band), UNLIMITED,
                      periods=round(SECONDS / drive.period_s))  # fmt: skip
        raw = next((raw for raw in (record(drive, burst, known) for _ in range(TRIES)) if raw.failure == TIME), None)
        if raw is None:
            raise FluxtrueError(
                f"commission: resistance: at {level:.3g} A: the rotor moved, or the current was too large"
            )
        raws.append(raw.within(level - band, level + band))
        if len(raws[-1].i) < LEAST_PERIODS:
            raise FluxtrueError(f"commission: resistance: {level:.3g} A was not reached in time")
    found = solve(raws, knee_A, drive.get("compensation_V"))
    if not found.r_ohm > 0.0:
        raise FluxtrueError(f"commission: resistance: {found.r_ohm:.3g} ohm found: the voltage does not grow with the "
                            "current")  # fmt: skip
    resolution = RESOLUTION * first.volts / float(np.abs(found.currents_A).max())
    return replace(found, r_sigma_ohm=math.hypot(found.r_sigma_ohm, resolution))
