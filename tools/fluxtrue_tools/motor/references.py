# SPDX-License-Identifier: Apache-2.0
"""MTPA, field weakening and MTPV over (torque, available flux), docs/theory/current-reference.md."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, identity
from scipy.sparse.linalg import spsolve

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import Bases
from fluxtrue_tools.motor.flux_model import Array, FluxModel, flux, torque
from fluxtrue_tools.motor.flux_tables import IntTable, bilinear
from fluxtrue_tools.motor.pchip import pchips
from fluxtrue_tools.motor.quantise import Q15_ONE, q15_table

SHIFT_COARSE, SHIFT_FINE = 10, 8  # node spacing 2^shift q15 counts on both axes
ERROR_WANTED, ERROR_WANTED_WEAK = 0.0025, 0.005  # of torque_max: along MTPA, in field weakening
NODES_MAX = 255
POINTS = 301  # along each contour of constant torque
PARTS = 5  # samples per table cell and axis


@dataclass(frozen=True)
class Contour:
    """One contour of constant torque from its MTPA point to its point of least flux."""

    torque_Nm: float
    id_A: Array  # falling
    iq_A: Array
    psi_Vs: Array  # falling

    def at(self, psi_Vs: Array) -> tuple[Array, Array]:
        """The currents of a torque at each flux."""
        i_d, i_q = at_flux([self], psi_Vs)
        return i_d[0], i_q[0]


def at_flux(contours: Sequence[Contour], psi_Vs: Array) -> tuple[Array, Array]:
    """Currents [contour][psi]: the point with the smallest current whose flux is psi or less (clamped to the ends)."""
    currents = np.empty((len(contours), len(psi_Vs), 2))
    lines = {k: c for k, c in enumerate(contours) if len(c.id_A) > 1}
    curves = [(c.psi_Vs[::-1], np.column_stack((c.id_A, c.iq_A))[::-1]) for c in lines.values()]
    for (k, contour), curve in zip(lines.items(), pchips(curves), strict=True):
        currents[k] = curve(np.clip(psi_Vs, contour.psi_Vs[-1], contour.psi_Vs[0]))
    for k, contour in enumerate(contours):
        if k not in lines:
            currents[k] = contour.id_A[0], contour.iq_A[0]
    return currents[..., 0], currents[..., 1]


class Solver:
    """Contours of constant torque of one machine inside its current circle."""

    def __init__(self, model: FluxModel, pole_pairs: int, i_max_A: float) -> None:
        self.model, self.pole_pairs, self.i_max_A = model, pole_pairs, i_max_A
        self.id_A = np.linspace(-i_max_A, 0.0, POINTS)
        self.iq_A = np.linspace(0.0, i_max_A, POINTS)
        reach = np.sqrt(np.maximum(i_max_A**2 - self.id_A * self.id_A, 0.0)) + i_max_A / POINTS * 3
        self.points = np.maximum(np.searchsorted(self.iq_A, reach), 2)  # of iq_A, up to beyond the current circle
        d, q = np.meshgrid(self.id_A, self.iq_A, indexing="ij")
        self.plane = torque(model, pole_pairs, d, q)
        inside = np.hypot(d, q) <= i_max_A
        if np.any((np.diff(self.plane, axis=1) <= 0) & inside[:, 1:]):
            k, j = np.argwhere((np.diff(self.plane, axis=1) <= 0) & inside[:, 1:])[0]
            raise FluxtrueError(
                f"flux map: torque does not rise with i_q at i_d = {self.id_A[k]:.4g} A, i_q = "
                f"{self.iq_A[j]:.4g} A; wanted: a machine whose torque does, inside machine.i_max_A"
            )
        self.torque_top_Nm, self.id_top_A, self.iq_top_A = self._top()

    def _top(self) -> tuple[float, float, float]:
        """The largest torque on the current circle."""
        low, high = 0.5 * math.pi, math.pi
        for _ in range(4):
            angle = np.linspace(low, high, 201)
            t = torque(self.model, self.pole_pairs, self.i_max_A * np.cos(angle), self.i_max_A * np.sin(angle))
            best = int(np.argmax(t))
            low, high = angle[max(best - 1, 0)], angle[min(best + 1, 200)]
        i_d, i_q = self.i_max_A * math.cos(angle[best]), self.i_max_A * math.sin(angle[best])
        return float(t[best]), min(i_d, 0.0), i_q

    def iq_for(self, t: Array, d: Array, q: Array) -> Array:
        """Newton on torque(d, q) = t from a start that is already near."""
        m, of_flux = self.model, 1.5 * self.pole_pairs
        for _ in range(3):
            psi_d, psi_q = m.psi_d(d, q), m.psi_q(d, q)
            torque_Nm = np.asarray(of_flux * (psi_d * q - psi_q * d))
            slope = of_flux * (psi_d + m.psi_d(d, q, nq=1) * q - m.psi_q(d, q, nq=1) * d)
            q = np.maximum(q - (torque_Nm - t) / slope, 0.0)
        return q

    def _start(self, torques: Array) -> Array:
        rows = [
            np.interp(torques, row[:n], self.iq_A[:n], right=np.nan)
            for row, n in zip(self.plane, self.points, strict=True)
        ]
        return np.array(rows)

    def contours(self, torques: Array) -> list[Contour]:
        """Contours for several torques at once, each within [0, torque_top)."""
        start = self._start(torques)
        d = np.repeat(self.id_A[:, None], len(torques), axis=1)
        ok = np.isfinite(start)
        q = np.full_like(start, np.nan)
        q[ok] = self.iq_for(np.broadcast_to(torques, d.shape)[ok], d[ok], start[ok])
        return self._solved(torques, self._near(q))

    def _near(self, q: Array) -> list[tuple[Array, Array]]:
        """Currents near each contour, from its MTPA point to the current circle; q: i_q over self.id_A [i_d][contour].

        What all contours have in common is found of all at once: a call of NumPy takes longer than its work on one.
        """
        q = np.ascontiguousarray(q.T)
        current = np.hypot(self.id_A, q)
        inside = current <= self.i_max_A  # not where it is NaN
        best = np.argmin(np.where(inside, current, np.inf), axis=1)
        first = np.argmax(inside, axis=1)
        known, reached = np.isfinite(q), inside.any(axis=1)
        return [
            self._near_one(q[k], current[k], inside[k], known[k], int(best[k]), int(first[k]))
            if reached[k]
            else (np.array([self.id_top_A]), np.array([self.iq_top_A]))
            for k in range(len(q))
        ]

    def _near_one(
        self, q: Array, current: Array, inside: Array, known: Array, best: int, first: int
    ) -> tuple[Array, Array]:
        id_A = self.id_A
        d_best = id_A[best]
        if 0 < best < POINTS - 1 and known[best - 1] and known[best + 1]:
            left, mid, right = (current[best + k] ** 2 for k in (-1, 0, 1))
            d_best += 0.5 * (left - right) / (left - 2 * mid + right) * (id_A[1] - id_A[0])
        ids = id_A[:best][inside[:best]][::-1]
        if len(ids) and d_best - ids[0] < 1e-6:
            ids = ids[1:]
        ids = np.concatenate(([d_best], ids))
        ids = ids[ids <= d_best]
        qs = np.interp(ids, id_A[known], q[known])
        if first > 0 and known[first - 1]:
            inner, outer = current[first] - self.i_max_A, current[first - 1] - self.i_max_A
            share = inner / (inner - outer)
            d_rim = id_A[first] + share * (id_A[first - 1] - id_A[first])
            if d_rim < ids[-1] - 1e-6:
                q_rim = q[first] + share * (q[first - 1] - q[first])
                ids, qs = np.concatenate((ids, [d_rim])), np.concatenate((qs, [q_rim]))
        return ids, qs

    def _solved(self, torques: Array, near: list[tuple[Array, Array]]) -> list[Contour]:
        """Contours through the given currents; all are solved at once, because each call of the model takes long."""
        lengths = [len(d) for d, _ in near]
        t = np.repeat(torques, lengths)
        d = np.concatenate([d for d, _ in near])
        q = self.iq_for(t, d, np.concatenate([q for _, q in near]))
        psi = flux(self.model, d, q)
        rises = np.diff(psi) >= 0
        return [
            _falling(float(t), d[end - n : end], q[end - n : end], psi[end - n : end], rises[end - n : end - 1])
            for t, n, end in zip(torques, lengths, np.cumsum(lengths).tolist(), strict=True)
        ]


def _falling(t: float, d: Array, q: Array, psi: Array, rises: Array) -> Contour:
    """A contour up to its least flux: beyond it the flux rises again (maximum torque per volt)."""
    last = int(np.argmax(rises)) + 1 if rises.any() else len(psi)
    return Contour(t, d[:last], q[:last], psi[:last])


@dataclass(frozen=True)
class References:
    """SI tables [ix][iy] over torque_Nm[ix], psi_Vs[iy], and what the firmware stores of them."""

    shift: int
    torque_Nm: Array
    psi_Vs: Array
    id_A: Array
    iq_A: Array
    torque_max_Nm: Array
    y0: int
    stored: dict[str, IntTable]
    torque_top_Nm: float

    @property
    def flash_bytes(self) -> int:
        return sum(2 * table.size for table in self.stored.values())


@dataclass(frozen=True)
class ReferenceErrors:
    """Currents of the stored tables, read as the firmware does."""

    torque_mtpa_max_Nm: float
    torque_weak_max_Nm: float
    torque_weak_rms_Nm: float
    current_excess: float  # beyond i_max, ratio
    flux_excess: float  # beyond psi_avail, ratio


@dataclass(frozen=True)
class Limits:
    """T_max over psi and its inverse, from a dense set of contours."""

    torque_Nm: Array
    psi_min_Vs: Array
    psi_mtpa_Vs: Array
    current_end_A: Array  # at psi_min_Vs

    def torque_max(self, psi_Vs: Array) -> Array:
        psi, first = np.unique(self.psi_min_Vs, return_index=True)
        return np.interp(psi_Vs, psi, self.torque_Nm[first], left=0.0)


def limits_of(solver: Solver) -> Limits:
    """Dense in torque, denser near the top, where T_max(psi) flattens."""
    s = np.linspace(0.0, 1.0, 161)
    torques = solver.torque_top_Nm * (1.0 - (1.0 - s) ** 2)
    torques[-1] = solver.torque_top_Nm * (1 - 1e-6)
    contours = solver.contours(torques)
    psi_min = np.maximum.accumulate([c.psi_Vs[-1] for c in contours])
    current_end = np.array([np.hypot(c.id_A[-1], c.iq_A[-1]) for c in contours])
    return Limits(torques, psi_min, np.array([c.psi_Vs[0] for c in contours]), current_end)


PRIOR_WEIGHT = 0.02


def _extend(values: Array, known: Array, prior: Array, samples: tuple[Array, Array, Array]) -> Array:
    """Nodes outside the possible region: what makes the cells cut by its edge read right (CR-8).

    Linear least squares on samples inside the region, drawn weakly towards the prior, the edge's
    own solution. samples: place x, y in cells and the value wanted there.
    """
    nx, ny = values.shape
    x, y, wanted = samples
    ix, iy = np.minimum(x.astype(int), nx - 2), np.minimum(y.astype(int), ny - 2)
    fx, fy = x - ix, y - iy
    weights = [(ix + a, iy + b, (fx if a else 1 - fx) * (fy if b else 1 - fy)) for a in (0, 1) for b in (0, 1)]
    free = np.flatnonzero(~known.ravel())
    flat = np.where(known, values, np.broadcast_to(prior, values.shape)).ravel()
    at = np.concatenate([jx * ny + jy for jx, jy, _ in weights])
    weight = np.concatenate([w for _, _, w in weights])
    full = coo_matrix((weight, (np.tile(np.arange(len(x)), 4), at)), shape=(len(x), nx * ny)).tocsc()
    part = full[:, free]
    normal = part.T @ part + PRIOR_WEIGHT**2 * identity(len(free), format="csc")
    flat[free] += spsolve(normal, part.T @ (wanted - full @ flat))
    return flat.reshape(nx, ny)


@dataclass(frozen=True)
class _Samples:
    """Exact references on a raster finer than the table; NaN where impossible."""

    torque_Nm: Array
    psi_Vs: Array
    id_A: Array
    iq_A: Array
    psi_mtpa_Vs: Array  # per torque, first and last flux of its contour
    psi_end_Vs: Array


def _sample(solver: Solver, limits: Limits, torque_Nm: Array, psi_Vs: Array) -> _Samples:
    fine_t = np.interp(np.arange((len(torque_Nm) - 1) * PARTS + 1) / PARTS, np.arange(len(torque_Nm)), torque_Nm)
    fine_p = np.interp(np.arange((len(psi_Vs) - 1) * PARTS + 1) / PARTS, np.arange(len(psi_Vs)), psi_Vs)
    fine_t = fine_t[fine_t < solver.torque_top_Nm]
    shape = (len(fine_t), len(fine_p))
    i_d, i_q = np.full(shape, np.nan), np.full(shape, np.nan)
    mtpa, end = np.zeros(len(fine_t)), np.zeros(len(fine_t))
    possible = limits.torque_max(fine_p)
    contours = solver.contours(fine_t)
    d, q = at_flux(contours, fine_p)
    for k, contour in enumerate(contours):
        inside = contour.torque_Nm <= possible
        i_d[k, inside], i_q[k, inside] = d[k, inside], q[k, inside]
        mtpa[k], end[k] = contour.psi_Vs[0], contour.psi_Vs[-1]
    return _Samples(fine_t, fine_p, i_d, i_q, mtpa, end)


def _psi_range(limits: Limits, unit: float, psi_low_Vs: float) -> tuple[int, int]:
    """First and last node in units of the node spacing."""
    last = max(math.ceil(float(limits.psi_mtpa_Vs.max()) / unit), 2)
    first = min(max(int(psi_low_Vs / unit), 1), last - 1)  # a slow machine never needs less than its MTPA flux
    return first, last


def _build(
    solver: Solver, limits: Limits, bases: Bases, psi_low_Vs: float, shift: int
) -> tuple[References, ReferenceErrors]:
    unit = (1 << shift) / Q15_ONE
    first, last = _psi_range(limits, unit * bases.flux_Vs, psi_low_Vs)
    rows = max(math.ceil(solver.torque_top_Nm / (unit * bases.torque_Nm)), 1) + 1
    if max(rows, last - first + 1) > NODES_MAX:
        raise FluxtrueError(f"reference tables: {rows} x {last - first + 1} nodes, allowed: up to {NODES_MAX} per axis")
    psi_Vs = np.arange(first, last + 1) * unit * bases.flux_Vs
    torque_Nm = np.arange(rows) * unit * bases.torque_Nm
    samples = _sample(solver, limits, torque_Nm, psi_Vs)
    torque_max = limits.torque_max(psi_Vs)
    ends = solver.contours(torque_max)
    edge = np.array([c.id_A[-1] for c in ends]), np.array([c.iq_A[-1] for c in ends])
    i_d, i_q = _tables(samples, len(torque_Nm), len(psi_Vs), edge)
    largest = bases.current_A * (1 - 1 / Q15_ONE)  # only extended nodes can come near it
    i_d, i_q = np.maximum(i_d, -largest), np.minimum(i_q, largest)
    stored = {
        "i_d": q15_table(i_d / bases.current_A, "reference i_d"),
        "i_q": q15_table(i_q / bases.current_A, "reference i_q"),
        "torque_max": q15_table(torque_max / bases.torque_Nm, "torque_max"),
    }
    references = References(
        shift, torque_Nm, psi_Vs, i_d, i_q, torque_max, first << shift, stored, solver.torque_top_Nm
    )
    return references, _error(references, samples, solver, bases)


def make_references(
    solver: Solver, bases: Bases, psi_low_Vs: float, torque_max_Nm: float
) -> tuple[References, Limits, ReferenceErrors]:
    """Tables over torque 0 ... T_top and psi psi_low ... largest MTPA flux, as coarse as the error allows."""
    limits = limits_of(solver)
    for shift in range(SHIFT_COARSE, SHIFT_FINE - 1, -1):
        references, error = _build(solver, limits, bases, psi_low_Vs, shift)
        mtpa, weak = error.torque_mtpa_max_Nm / torque_max_Nm, error.torque_weak_max_Nm / torque_max_Nm
        if mtpa <= ERROR_WANTED and weak <= ERROR_WANTED_WEAK:
            break
    return references, limits, error


def _tables(samples: _Samples, rows: int, columns: int, edge: tuple[Array, Array]) -> tuple[Array, Array]:
    node_d, node_q = np.full((rows, columns), np.nan), np.full((rows, columns), np.nan)
    known_rows = samples.id_A[::PARTS, ::PARTS]
    node_d[: known_rows.shape[0]] = known_rows
    node_q[: known_rows.shape[0]] = samples.iq_A[::PARTS, ::PARTS]
    known = np.isfinite(node_d)
    ok = np.isfinite(samples.id_A)
    x, y = np.nonzero(ok)
    place = (x / PARTS, y / PARTS)
    filled = [
        _extend(np.nan_to_num(node), known, end, (*place, wanted[ok]))
        for node, wanted, end in ((node_d, samples.id_A, edge[0]), (node_q, samples.iq_A, edge[1]))
    ]
    return np.minimum(filled[0], 0.0), np.maximum(filled[1], 0.0)


def lookup_references(references: References, t: IntTable, psi: IntTable) -> tuple[IntTable, IntTable]:
    """current_reference_step() between T_max and the circle: i_d, i_q in q15 from torque and flux in q15."""
    origin = (0, references.y0)
    return (
        bilinear(references.stored["i_d"], t, psi, origin, references.shift),
        bilinear(references.stored["i_q"], t, psi, origin, references.shift),
    )


def _error(references: References, samples: _Samples, solver: Solver, bases: Bases) -> ReferenceErrors:
    t, psi = np.meshgrid(samples.torque_Nm, samples.psi_Vs, indexing="ij")
    mtpa = psi >= samples.psi_mtpa_Vs[:, None]
    limit = np.interp(psi, references.psi_Vs, references.stored["torque_max"] / Q15_ONE * bases.torque_Nm)
    asked = np.minimum(t, limit)
    ok = np.isfinite(samples.id_A)
    read = lookup_references(
        references,
        np.round(asked / bases.torque_Nm * Q15_ONE).astype(np.int64),
        np.round(psi / bases.flux_Vs * Q15_ONE).astype(np.int64),
    )
    i_d, i_q = (x / Q15_ONE * bases.current_A for x in read)
    error = np.where(ok, torque(solver.model, solver.pole_pairs, i_d, i_q) - asked, 0.0)
    weak = error[ok & ~mtpa] if np.any(ok & ~mtpa) else np.zeros(1)
    reachable = psi >= np.nanmin(np.where(ok, samples.psi_end_Vs[:, None], np.nan))
    excess = np.where(ok & reachable, flux(solver.model, i_d, i_q) / psi - 1.0, 0.0)
    return ReferenceErrors(
        torque_mtpa_max_Nm=float(np.abs(error[ok & mtpa]).max()),
        torque_weak_max_Nm=float(np.abs(weak).max()),
        torque_weak_rms_Nm=float(np.sqrt(np.mean(weak**2))),
        current_excess=float(np.where(ok, np.hypot(i_d, i_q) / solver.i_max_A - 1.0, -1.0).max()),
        flux_excess=float(excess.max()),
    )
