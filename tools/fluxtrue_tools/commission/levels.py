# SPDX-License-Identifier: Apache-2.0
"""Resistance and voltage error of the inverter by direct currents along the magnet: (CM-12).

The firmware's own measurement needs a current control that is tuned to the machine. Here voltage pulses hold both
currents between two bounds instead, for a time that is too short for the rotor to turn far.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from fluxtrue_tools.commission.bursts import FAILURES, Burst, Linkage, Raw, integrate, level_linkage, record
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.noise import Noise, of_phases
from fluxtrue_tools.commission.plan import First
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

LEVELS = (0.3, 0.45, 0.6, 0.85)  # of i_max: where the ripple does not change the sign of a phase current
BAND = 0.05  # of i_max: half the width of a level
STEP = 0.015  # of i_max: change of the current in a period
SECONDS = 0.05  # of a level
LEAST_D, LEAST_Q, MOST = 0.08, 0.1, 0.5  # of the largest voltage: more than the drop of R, more than a leg loses
RESOLUTION_V = 0.005  # rms: what a mean voltage is certain to beyond the noise
TRIES = 3
QUIET_RAD = 0.07  # electrical: a level that moved the rotor further is repeated, (CM-26) has the guess of psi_f
KNEES, KNEE_STEPS = (1e-4, 0.02), 24  # of the largest level: where the legs' knee is looked for
EXPLAINS = 0.01  # of the residuals' sum of squares: twice what a knee removes by chance
NEAR = 1.05  # for the slope over the knee
COMMON = 3  # unknowns of all levels
LEAST_PERIODS = 100  # at a level
STRONGER, LEAST_TIME = 1.5, 0.5  # of the voltage, after a level that was held for less of its time
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
    knee_A: float = 0.0  # of the voltage that a leg loses, (CM-33); 0: none that shows

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


def _psi_d(linkage: Linkage, seconds: Array, psi_f_Vs: float) -> float:
    """Flux linkage along d at a level's mean current, V·s."""
    return psi_f_Vs + float(linkage.i.real.mean()) * _inductance(linkage, seconds, of_q=False)


def _of_movement(linkage: Linkage, seconds: Array, psi_f_Vs: float) -> Array:
    """What the integral of u_d contains because the flux linkages of the start stay where they were, V·s: (CM-26)."""
    psi_d = _psi_d(linkage, seconds, psi_f_Vs)
    psi_q = float(linkage.i[0].imag) * _inductance(linkage, seconds, of_q=True)
    return psi_d * (1.0 - linkage.turned.real) + psi_q * linkage.turned.imag


def _local(i: Array) -> Array:
    """Columns of a level's own unknowns: psi_d is a quadratic of both currents there, as ripple and saturation need."""
    x, y = i.real - i.real.mean(), i.imag
    return np.column_stack((np.ones(len(i)), x, y, x * x, x * y, y * y))


class _Level:
    """A level's equations, multiplied so that their errors have a variance of one, without what its own unknowns can
    explain."""

    def __init__(self, raw: Raw, noise: Noise) -> None:
        self.raw, self.linkage, self._noise = raw, integrate(raw, 0.0), noise
        self.seconds = raw.period_s * np.arange(len(raw.i))
        local = noise.whitened(_local(raw.i))
        self._own = np.linalg.qr(local / np.linalg.norm(local, axis=0))[0]
        self.spare = len(raw.i) - local.shape[1]

    def left(self, column: Array) -> Array:
        """What the level's own unknowns cannot explain of a column."""
        of_all = self._noise.whitened(column[:, None])[:, 0]
        return np.asarray(of_all - self._own @ (self._own.T @ of_all))


class _Equations:
    """(CM-12) of all levels. The common unknowns: resistance, voltage of a leg, error of the mean voltage."""

    def __init__(self, raws: Sequence[Raw], noises: Sequence[Noise], psi_f_Vs: float) -> None:
        self.levels = [_Level(raw, noise) for raw, noise in zip(raws, noises, strict=True)]
        self._of_r = self._all(lambda level: -level.linkage.of_r.real)
        self._seconds = self._all(lambda level: level.seconds)
        self._values = self._all(
            lambda level: level.linkage.psi.real - _of_movement(level.linkage, level.seconds, psi_f_Vs)
        )
        self.spare = sum(level.spare for level in self.levels) - COMMON

    def _all(self, column: Callable[[_Level], Array]) -> Array:
        return np.concatenate([level.left(column(level)) for level in self.levels])

    def rows(self, knee_A: float) -> Array:
        """A column for each common unknown."""
        of_level = self._all(lambda level: -level_linkage(level.raw, knee_A).real)
        return np.column_stack((self._of_r, of_level, self._seconds))

    def solve(self, rows: Array) -> tuple[Array, float]:
        """The unknowns, and the sum of the squares of what they leave."""
        scale = np.linalg.norm(rows, axis=0)
        x = np.linalg.lstsq(rows / scale, self._values, rcond=None)[0] / scale
        left = self._values - rows @ x
        return x, float(left @ left)

    def knee_A(self, largest_A: float) -> float:
        """The one that leaves least, if a knee shows."""

        def left(log: float) -> float:
            return self.solve(self.rows(math.exp(log)))[1]

        logs = np.log(largest_A * np.geomspace(*KNEES, KNEE_STEPS))
        best = min(range(1, len(logs) - 1), key=lambda k: left(logs[k]))
        found = minimize_scalar(left, bounds=(logs[best - 1], logs[best + 1]), method="bounded")
        (sharp, sharp_left), (soft, _) = (self.solve(self.rows(knee_A)) for knee_A in (0.0, math.exp(found.x)))
        shows = found.fun < (1.0 - EXPLAINS) * sharp_left and abs(soft[0] - sharp[0]) * largest_A > RESOLUTION_V
        return math.exp(found.x) if shows else 0.0

    def sigma(self, rows: Array, left: float) -> float:
        """Of the resistance, by the noise."""
        scale = np.linalg.norm(rows, axis=0)
        covariance = left / self.spare * np.linalg.inv((rows / scale).T @ (rows / scale))
        return math.sqrt(covariance[0, 0]) / float(scale[0])


def _of_angle(linkage: Linkage, seconds: Array, psi_f_Vs: float, angle_rad: float) -> Array:
    """What the integral of u_d contains of the linkage that a movement gives to the other axis, with an error of the
    angle: (CM-42)."""
    return np.asarray(angle_rad * _psi_d(linkage, seconds, psi_f_Vs) * linkage.turned.imag)


def _noises(raws: Sequence[Raw], noise_A: float, psi_f_Vs: float, angle_rad: float) -> list[Noise]:
    """Where a ripple touches zero from one side, noise shifts the mean sign in one direction: the error is one of the
    whole level, as that of the angle. A first solution without them says how large all other errors are."""
    plain = [Noise(np.ones(len(raw.i)), np.zeros((len(raw.i), 0))) for raw in raws]
    first = _Equations(raws, plain, psi_f_Vs)
    x, left = first.solve(first.rows(0.0))
    sigma = math.sqrt(left / first.spare)
    noises = []
    for level in first.levels:
        of_signs = x[1] * of_phases(level.raw, noise_A).real
        of_angle = _of_angle(level.linkage, level.seconds, psi_f_Vs, angle_rad)
        noises.append(Noise(np.full(len(of_angle), sigma), np.column_stack((of_signs, of_angle))))
    return noises


def solve(raws: list[Raw], psi_f_Vs: float, compensated_V: float = 0.0, noise_A: float = 0.0,
          angle_rad: float = 0.0) -> Resistance:  # fmt: skip
    """All levels at once.

    compensated_V   by the drive, contained in the voltages
    noise_A         standard deviation of a current's component
    angle_rad       the same of the angle where the rotor stands
    """
    equations = _Equations(raws, _noises(raws, noise_A, psi_f_Vs, angle_rad), psi_f_Vs)
    means = np.array([(raw.i.real.mean(), raw.u.real.mean()) for raw in raws])
    largest_A = float(np.abs(means[:, 0]).max())
    knee_A = equations.knee_A(largest_A)
    rows = equations.rows(knee_A)
    x, left = equations.solve(rows)
    if not x[0] > 0.0:
        raise FluxtrueError(f"commission: resistance: {x[0]:.3g} ohm found: the voltage does not grow with the current")
    if knee_A > 0.0:  # it is an unknown, too
        rows = np.column_stack((rows, equations.rows(NEAR * knee_A)[:, 1] - rows[:, 1]))
    sigma = math.hypot(equations.sigma(rows, left), RESOLUTION_V / largest_A)
    return Resistance(float(x[0]), sigma, float(x[1]) - compensated_V, compensated_V, means[:, 0], means[:, 1], knee_A)


def _record(drive: Capture, burst: Burst, known: Nameplate) -> Raw | None:
    """The one of the first tries that moved the rotor least. If the rotor has ended all of them, which an error of the
    angle sensor where the shaft rests can do, the longest one; None: the current was too large in each."""
    raws: list[Raw] = []
    for _ in range(TRIES):
        raws.append(record(drive, burst, known))
        if raws[-1].failure == TIME and raws[-1].moved_rad < QUIET_RAD:
            break
    lasted = [raw for raw in raws if raw.failure == TIME]
    if lasted:
        return min(lasted, key=lambda raw: raw.moved_rad)
    return max((raw for raw in raws if raw.is_valid), key=lambda raw: len(raw.i), default=None)


def _held(drive: Capture, burst: Burst, known: Nameplate) -> tuple[Raw, float]:
    """One level, and the voltage that held it. The resistance is only guessed: where the winding and the legs drop more
    than the voltage, the current does not reach its level, and a higher voltage follows."""
    level = 0.5 * sum(burst.d)
    while True:
        raw = _record(drive, burst, known)
        if raw is None:
            raise FluxtrueError(f"commission: resistance: at {level:.3g} A: the current was too large")
        held = raw.within(*burst.d)
        if raw.failure != TIME or len(held.i) >= LEAST_TIME * burst.periods or burst.v_d >= MOST:
            break
        burst = replace(burst, v_d=min(STRONGER * burst.v_d, MOST))
    if len(held.i) < LEAST_PERIODS:
        raise FluxtrueError(f"commission: resistance: {level:.3g} A was not reached in time")
    return held, burst.v_d


def measure(drive: Capture, known: Nameplate, first: First) -> list[Raw]:
    """Both polarities of each level; the voltages contain the drive's compensation."""
    i_max_A = known.i_max_A
    per_period = STEP * i_max_A / (drive.period_s * first.volts)
    v_d = min(max(per_period * first.l_d_H, LEAST_D), MOST)
    v_q = min(max(per_period * first.l_q_H, LEAST_Q), MOST)
    compensation = known.offset_A, drive.get("compensation_V"), drive.get("compensation_knee_A")
    band, raws = BAND * i_max_A, []
    enough: dict[float, float] = {}  # by level: at a smaller one, the voltage of a larger one makes too much ripple
    for level in (sign * level * i_max_A for _ in range(REPEATS) for level in LEVELS for sign in (1.0, -1.0)):
        volts = max([v_d, *(needed for other, needed in enough.items() if other <= abs(level))])
        burst = Burst(volts, v_q, (level - band, level + band), (-band, band), UNLIMITED,
                      periods=round(SECONDS / drive.period_s))  # fmt: skip
        held, enough[abs(level)] = _held(drive, burst, known)
        raws.append(held.compensated(*compensation))
    return raws
