# SPDX-License-Identifier: Apache-2.0
"""Inertia and drag over speed from an acceleration, a run-down and a braking: (CM-20) ... (CM-22)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.optimize import lsq_linear

from fluxtrue_tools.commission import spin, turning
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

NAME = "drag"
WINDOW_S = 0.02  # over which a speed and a mean torque are formed
COAST_S, COASTS = 0.25, 16  # the run-down ends at COAST_END of its speed
COAST_END = 0.4
SLOWEST = 0.1  # of the largest speed of the run: below it the drag is not evaluated
LEAST_SHARE = 0.2  # of the largest current of the run
BENDS = (-8.0, 1.0)  # of psi_f: what i_max along q may add to psi_d with the slope at small currents, the steepest
SLOPES = (0.0, 12.0)  # the same of i_max along d to psi_d and of i_max along q to psi_q; up to 8.8 was drawn
SHOWN = (0.4, 1.0)  # of the largest speed of the run: where the drag is shown
HEAVY = 3.0  # times the nameplate's guess of the inertia; of the simulated machines none has more than 1.9
FINE_KGM2 = 1e-3  # below it an inertia is shown in kg·mm²
D = TypeVar("D", bound=Capture)
STEADY_SHARE = 0.05  # change of a current within a window in which it counts as steady


@dataclass(frozen=True)
class Drag:
    """Torque against the rotation: constant + linear |w| + square w^2, mechanical speed."""

    inertia_kgm2: float
    inertia_sigma_kgm2: float
    constant_Nm: float
    linear_Nms: float
    square_Nms2: float
    from_rad_s: float
    to_rad_s: float
    slow_sigma_Nm: float = 0.0  # of the torque at SHOWN of to_rad_s, by the noise of the speed
    fast_sigma_Nm: float = 0.0

    def shown(self) -> list[tuple[float, float, float]]:
        """Speed, drag and its uncertainty at SHOWN of the speed of the run, rad/s and N·m."""
        return [(share * self.to_rad_s, float(self.torque_Nm(np.array(share * self.to_rad_s))), sigma_Nm)
                for share, sigma_Nm in zip(SHOWN, (self.slow_sigma_Nm, self.fast_sigma_Nm), strict=True)]  # fmt: skip

    def torque_Nm(self, speed_rad_s: Array) -> Array:
        """The torque at speeds between the two."""
        w = np.abs(np.asarray(speed_rad_s, float))
        return self.constant_Nm + self.linear_Nms * w + self.square_Nms2 * w**2


def _plain(value: float, digits: int) -> str:
    """Without an exponent."""
    places = digits - 1 - math.floor(math.log10(abs(value))) if value else 0
    return f"{round(value, places):.{max(places, 0)}f}"


def inertia_text(kgm2: float, digits: int, like_kgm2: float = 0.0) -> str:
    """With its unit, in a size that can be read.

    like_kgm2   in the unit of this inertia
    """
    scale, unit = (1e6, "kg·mm²") if (like_kgm2 or kgm2) < FINE_KGM2 else (1.0, "kg·m²")
    return f"{_plain(scale * kgm2, digits)} {unit}"


def coupled(found: Drag, known: Nameplate) -> str:
    """A warning where something heavy turns with the rotor; it costs nothing but time, and inertia and drag include it.

    known   before anything was measured: its inertia is the guess for a machine of this voltage, current and speed
    """
    times = found.inertia_kgm2 / known.inertia_kgm2
    if times <= HEAVY:
        return ""
    return (f"the inertia is {times:.1f} times the {inertia_text(known.inertia_kgm2, 2)} that are guessed for a rotor "
            "of this nameplate: is the shaft coupled? Inertia and drag then contain the load")  # fmt: skip


@dataclass(frozen=True)
class _Run:
    """One run in windows: at the middle of each, and what happened from one middle to the next."""

    speed: Array  # mechanical, in the electrical direction
    i: Array
    psi: Array  # u / (j w)
    is_steady: Array  # the current of a window did not change
    times: Array  # of the middles
    rows: Array
    starts: Array
    size: int


def _run(rows: Array, period_s: float, pole_pairs: int, periods: int) -> _Run:
    size = round(WINDOW_S / (periods * period_s))
    starts = np.arange(0, len(rows) - size, size)
    taken = []
    for start in starts:
        i, psi, omega = spin.voltages(rows[start : start + size + 1], period_s, periods)
        half = size // 2
        change = abs(float(i.imag[:half].mean() - i.imag[half:].mean()))
        taken.append((omega / pole_pairs, i.mean(), psi.mean(), change))
    speed, current, flux, change = np.array(taken).T
    middles = starts + 1 + size // 2
    steady = change.real < STEADY_SHARE * np.abs(current)
    return _Run(speed.real, current, flux, steady, periods * period_s * middles, rows, starts, size)


@dataclass(frozen=True)
class Flux:
    """Of small currents: psi_d = psi_f + l_d i_d + bend i_q^2, psi_q = l_q i_q."""

    psi_f_Vs: float
    l_d_H: float
    bend: float
    l_q_H: float

    def torque_Nm(self, i: Array, pole_pairs: int) -> Array:
        """1.5 p (psi_d i_q - psi_q i_d)."""
        psi_d = self.psi_f_Vs + self.l_d_H * i.real + self.bend * i.imag**2
        return 1.5 * pole_pairs * (psi_d * i.imag - self.l_q_H * i.imag * i.real)


def flux_under_current(runs: list[_Run], psi_f_Vs: float, i_max_A: float) -> Flux:
    """(CM-20): a part that is neither proportional to the speed nor independent of it is no flux.

    A light rotor is accelerated by so little current that the errors of the voltages are larger than the flux linkages
    of the currents, and along d it has none but those of the sensors' offsets: inductances and saturation have bounds.
    """
    speed, i, psi, steady = (np.concatenate([getattr(run, name) for run in runs])
                             for name in ("speed", "i", "psi", "is_steady"))  # fmt: skip
    used = steady & (np.abs(i.imag) > LEAST_SHARE * np.abs(i.imag).max()) & (speed > SLOWEST * speed.max())
    w, d, q = speed[used], i[used].real, i[used].imag
    inductance, bend = (np.array(shares) * psi_f_Vs / i_max_A**n for n, shares in ((1, SLOPES), (2, BENDS)))
    along = np.column_stack((d * w, q**2 * w, q, np.sign(q)))
    l_d, bent = _bounded(along, (psi[used].real - psi_f_Vs) * w, [inductance, bend])
    across = np.column_stack((q * w, d, np.ones(len(w))))
    (l_q,) = _bounded(across, psi[used].imag * w, [inductance])
    return Flux(psi_f_Vs, l_d, bent, l_q)


def _bounded(matrix: Array, values: Array, bounds: list[Array]) -> list[float]:
    """Least squares; of the unknowns that have bounds, which come first."""
    scale = np.linalg.norm(matrix, axis=0)
    least, most = np.full(len(scale), -np.inf), np.full(len(scale), np.inf)
    least[: len(bounds)], most[: len(bounds)] = np.transpose(bounds)
    found = lsq_linear(matrix / scale, values, (least * scale, most * scale))
    return [float(each) for each in (found.x / scale)[: len(bounds)]]


def _impulse(run: _Run, torque: Array, spacing_s: float) -> Array:
    """The impulse of the torque until each window, averaged as the fit of a window averages the speed: the slope of its
    angles is their change from sample to sample, weighted by a parabola."""
    until = spacing_s * (np.cumsum(torque) - 0.5 * torque)
    between = 0.5 * (until[1:] + until[:-1])
    n = np.arange(1, run.size)
    weights = n * (run.size - n)
    return np.array([np.average(between[start + 1 : start + run.size], weights=weights) for start in run.starts])


def _changes(run: _Run, torque: Array, spacing_s: float, slowest: float) -> tuple[Array, Array]:
    """From middle to middle: impulse of the torque, time, angle, integral of the squared speed; the change of speed."""
    impulse = _impulse(run, torque, spacing_s)
    time, w = np.diff(run.times), run.speed
    angle, square = 0.5 * time * (w[1:] + w[:-1]), time * (w[1:] ** 2 + w[1:] * w[:-1] + w[:-1] ** 2) / 3.0
    used = np.minimum(w[1:], w[:-1]) > slowest
    return np.column_stack((np.diff(impulse), -time, -angle, -square))[used], np.diff(w)[used]


def evaluate(parts: list[Array], period_s: float, known: Nameplate, periods: int = 1) -> Drag:
    """(CM-21), (CM-22) over all windows. What is noisy is the change of the speed, by errors of the angle sensor: it
    is the side that least squares take the noise on. As a factor of J it would make J smaller the noisier it is.

    known   with pole pairs, magnet and offsets as they have been measured
    """
    spacing_s, pole_pairs = periods * period_s, known.pole_pairs
    runs = [_run(spin.machine_currents(rows, known.offset_A), period_s, pole_pairs, periods) for rows in parts
            if len(rows) > 2 * WINDOW_S / spacing_s]  # fmt: skip
    top = max(float(run.speed.max()) for run in runs)
    flux = flux_under_current(runs, known.psi_f_Vs, known.i_max_A)
    changes = [_changes(run, flux.torque_Nm(run.rows[:, 0] + 1j * run.rows[:, 1], pole_pairs), spacing_s, SLOWEST * top)
               for run in runs]  # fmt: skip
    matrix, change = np.vstack([part for part, _ in changes]), np.concatenate([part for _, part in changes])
    x, covariance = _least_squares(matrix, change)
    inertia = 1.0 / float(x[0])
    constant, linear, square = (float(inertia * each) for each in x[1:])
    sigmas = [_torque_sigma(x, covariance, share * top) for share in SHOWN]
    return Drag(
        inertia, math.sqrt(covariance[0, 0]) * inertia**2, constant, linear, square, SLOWEST * top, top, *sigmas
    )


def _torque_sigma(x: Array, covariance: Array, w: float) -> float:
    """Of (x1 + x2 w + x3 w^2) / x0."""
    powers = np.array([1.0, w, w * w])
    slope = np.concatenate(([-float(x[1:] @ powers) / x[0]], powers)) / x[0]
    return math.sqrt(float(slope @ covariance @ slope))


def _least_squares(matrix: Array, values: Array) -> tuple[Array, Array]:
    """The solution and its covariance."""
    scale = np.linalg.norm(matrix, axis=0)
    x, *_ = np.linalg.lstsq(matrix / scale, values, rcond=None)
    left = values - matrix / scale @ x
    variance = float(left @ left) / max(len(values) - len(x), 1)
    inverse = np.linalg.inv((matrix / scale).T @ (matrix / scale))
    return x / scale, variance * inverse / np.outer(scale, scale)


def _coast(drive: Capture, wanted_rad_s: float) -> Array:
    """Run down without current until much of the speed is gone."""
    rows: list[Array] = []
    for _ in range(COASTS):
        rows.append(turning.advance(drive, COAST_S, NAME))
        if abs(turning.speed_rad_s(rows[-1], drive.period_s)) < COAST_END * wanted_rad_s:
            break
    return np.vstack(rows)


def runs(drive: Capture, known: Nameplate, wanted_rad_s: float) -> tuple[list[Array], int]:
    """Accelerated, without current, and braked with the current of the acceleration; PWM periods from row to row."""
    driven = spin.accelerate(drive, known, wanted_rad_s, NAME)
    turning.currents(drive, 0.0, 0.0)
    coasting = _coast(drive, wanted_rad_s)
    return [driven, coasting, spin.brake(drive, known, wanted_rad_s, NAME)], 1


def measure(drive: D, known: Nameplate, spun: Spun,
            run: Callable[[D, Nameplate, float], tuple[list[Array], int]]) -> Drag:  # fmt: skip
    """The balance of torque and acceleration.

    run   runs(), or that of a drive over CAN
    """
    wanted = turning.SPEED_SHARE * known.speed_max_rpm * math.pi / 30.0
    try:
        turning.connect(drive, spun.connection, known, NAME)
        parts, periods = run(drive, known, wanted)
    finally:
        turning.release(drive)
    found = evaluate(parts, drive.period_s, known, periods)
    if not found.inertia_kgm2 > 0.0:
        raise FluxtrueError(f"commission: {NAME}: an inertia of {found.inertia_kgm2:.3g} kg m^2: the shaft is driven "
                            "from outside")  # fmt: skip
    return found
