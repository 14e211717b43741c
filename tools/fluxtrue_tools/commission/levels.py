# SPDX-License-Identifier: Apache-2.0
"""Resistance and voltage error of the inverter by direct currents along the magnet: (CM-12).

The firmware's own measurement needs a current control that is tuned to the machine. Here voltage pulses hold both
currents between two bounds instead, for a time that is too short for the rotor to turn far.
"""

import math
from dataclasses import dataclass

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
RESOLUTION_V = 0.005  # rms: what a mean voltage is certain to beyond the noise
TRIES = 3
QUIET_RAD = 0.07  # electrical: a level that moved the rotor further is repeated, (CM-26) has the guess of psi_f
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
    """The duration of all currents."""
    return 2 * REPEATS * len(LEVELS) * SECONDS


def _inductance(linkage: Linkage, seconds: Array, of_q: bool) -> float:
    """Slope of a flux linkage over its current, beside what errors of the voltages and a movement change slowly."""
    one = np.imag if of_q else np.real
    slow = (np.ones(len(seconds)), seconds, one(linkage.of_level), one(linkage.turned))
    matrix = np.column_stack((one(linkage.i), *slow))
    scale = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
    return float(np.linalg.lstsq(matrix / scale, one(linkage.psi), rcond=None)[0][0] / scale[0])


def _of_movement(linkage: Linkage, seconds: Array, psi_f_Vs: float) -> Array:
    """What the integral of u_d contains because the flux linkages of the start stay where they were, V·s: (CM-26)."""
    i = linkage.i
    psi_d = psi_f_Vs + float(i.real.mean()) * _inductance(linkage, seconds, of_q=False)
    psi_q = float(i[0].imag) * _inductance(linkage, seconds, of_q=True)
    return psi_d * (1.0 - linkage.turned.real) + psi_q * linkage.turned.imag


def _local(i: Array) -> Array:
    """Columns of a level's own unknowns: psi_d is a quadratic of both currents there, as ripple and saturation need."""
    x, y = i.real - i.real.mean(), i.imag
    return np.column_stack((np.ones(len(i)), x, y, x * x, x * y, y * y))


def _equations(linkages: list[Linkage], period_s: float, psi_f_Vs: float) -> tuple[Array, Array]:
    """(CM-12): unknown are resistance, voltage of a leg, error of the mean voltage, and those of each level."""
    blocks, right = [], []
    for n, linkage in enumerate(linkages):
        seconds, local = period_s * np.arange(len(linkage.i)), _local(linkage.i)
        block = np.zeros((len(seconds), 3 + local.shape[1] * len(linkages)))
        block[:, :3] = np.column_stack((-linkage.of_r.real, -linkage.of_level.real, seconds))
        first = 3 + local.shape[1] * n
        block[:, first : first + local.shape[1]] = local
        blocks.append(block)
        right.append(linkage.psi.real - _of_movement(linkage, seconds, psi_f_Vs))
    return np.vstack(blocks), np.concatenate(right)


def solve(raws: list[Raw], psi_f_Vs: float, compensated_V: float = 0.0) -> Resistance:
    """All levels at once; compensated_V: by the drive, contained in the voltages."""
    rows, values = _equations([integrate(raw, 0.0) for raw in raws], raws[0].period_s, psi_f_Vs)
    scale = np.linalg.norm(rows, axis=0)
    x, *_ = np.linalg.lstsq(rows / scale, values, rcond=None)
    left = values - (rows / scale) @ x
    x = x / scale
    variance = float(left @ left) / (len(values) - len(x))
    noise = float(np.sqrt(variance * np.linalg.inv((rows / scale).T @ (rows / scale))[0, 0])) / float(scale[0])
    means = np.array([(raw.i.real.mean(), raw.u.real.mean()) for raw in raws])
    resolution = RESOLUTION_V / float(np.abs(means[:, 0]).max())
    if not x[0] > 0.0:
        raise FluxtrueError(f"commission: resistance: {x[0]:.3g} ohm found: the voltage does not grow with the current")
    return Resistance(float(x[0]), math.hypot(noise, resolution), float(x[1]) - compensated_V, compensated_V,
                      means[:, 0], means[:, 1])  # fmt: skip


def _record(drive: Capture, burst: Burst, known: Nameplate) -> Raw | None:
    """The one of the first tries that moved the rotor least; None: none has lasted as long as it should."""
    best: Raw | None = None
    for _ in range(TRIES):
        raw = record(drive, burst, known)
        if raw.failure == TIME and (best is None or raw.moved_rad < best.moved_rad):
            best = raw
        if best is not None and best.moved_rad < QUIET_RAD:
            break
    return best


def measure(drive: Capture, known: Nameplate, first: First) -> list[Raw]:
    """Both polarities of each level; the voltages contain the drive's compensation."""
    i_max_A = known.i_max_A
    per_period = STEP * i_max_A / (drive.period_s * first.volts)
    v_d = min(max(per_period * first.l_d_H, LEAST_D), MOST)
    v_q = min(max(per_period * first.l_q_H, LEAST_Q), MOST)
    compensation = known.offset_A, drive.get("compensation_V"), drive.get("compensation_knee_A")
    band, raws = BAND * i_max_A, []
    for level in (sign * level * i_max_A for _ in range(REPEATS) for level in LEVELS for sign in (1.0, -1.0)):
        burst = Burst(v_d, v_q, (level - band, level + band), (-band, band), UNLIMITED,
                      periods=round(SECONDS / drive.period_s))  # fmt: skip
        raw = _record(drive, burst, known)
        if raw is None:
            raise FluxtrueError(
                f"commission: resistance: at {level:.3g} A: the rotor moved, or the current was too large"
            )
        raws.append(raw.within(level - band, level + band))
        if len(raws[-1].i) < LEAST_PERIODS:
            raise FluxtrueError(f"commission: resistance: {level:.3g} A was not reached in time")
        raws[-1] = raws[-1].compensated(*compensation)
    return raws
