# SPDX-License-Identifier: Apache-2.0
"""flux_map.csv: reading, checking and symmetrising it, with a report of the change."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array, SplineModel
from fluxtrue_tools.motor.text_table import ROWS_MAX, SEPARATORS, cells, data_lines, number

COLUMNS = ("id_A", "iq_A", "psi_d_Vs", "psi_q_Vs")
MARK = "extrapolated"  # a further column, of imported maps: 1 where the source has no points
TORQUE = "torque_Nm"  # a further column, which no value is taken from
TORQUE_MAX = 1e9  # N·m
NODES_MIN = 4


@dataclass(frozen=True)
class Symmetry:
    """The parts that symmetrising removed: (f(i_q) -+ f(-i_q))/2 over the nodes, V·s."""

    source: str  # which part of the plane the file covers
    psi_d_max_Vs: float
    psi_d_rms_Vs: float
    psi_q_max_Vs: float
    psi_q_rms_Vs: float
    psi_q_offset_Vs: float  # mean of what was taken from psi_q, with its sign


@dataclass(frozen=True)
class FluxMap:
    """A map of the full i_q plane, psi_d even and psi_q odd in i_q, row-major [i_d][i_q]."""

    id_A: Array
    iq_A: Array
    psi_d_Vs: Array
    psi_q_Vs: Array
    symmetry: Symmetry
    marked: tuple[int, int] = (0, 0)  # rows of the file that are marked as extrapolated, and all rows


@dataclass(frozen=True)
class _Grid:
    id_A: Array
    iq_A: Array
    psi_d: Array
    psi_q: Array
    line_of: dict[tuple[float, float], int]
    marked: int


def _rows(path: Path) -> tuple[list[tuple[int, float, float, float, float]], int]:
    """The numbers with their lines, and how many rows are marked as extrapolated."""
    lines = data_lines(path, "machine.flux_map")
    if not lines:
        raise FluxtrueError(f"{path}: empty, wanted: a header line with {', '.join(COLUMNS)}")
    if len(lines) > ROWS_MAX:
        raise FluxtrueError(f"{path}: {len(lines)} rows, allowed: up to {ROWS_MAX}")
    header = cells(path, *lines[0])
    for sign, words in SEPARATORS.items():
        if len(header) == 1 and sign in lines[0][1]:
            raise FluxtrueError(
                f"{path}:{lines[0][0]}: columns separated by {words}, allowed: by ',' (and a decimal point)"
            )
    for column in COLUMNS:
        if header.count(column) != 1:
            raise FluxtrueError(
                f"{path}:{lines[0][0]}: column {column} found {header.count(column)} times, "
                f"wanted once: {', '.join(COLUMNS)}"
            )
    places = [header.index(column) for column in COLUMNS]
    mark = header.index(MARK) if header.count(MARK) == 1 else None
    torques = [k for k, name in enumerate(header) if name == TORQUE]
    rows, marked = [], 0
    for line, text in lines[1:]:
        row = cells(path, line, text)
        if len(row) != len(header):
            raise FluxtrueError(f"{path}:{line}: {len(row)} columns, wanted: {len(header)} as in the header")
        values = [number(path, line, column, row[k]) for column, k in zip(COLUMNS, places, strict=True)]
        for k in torques:  # a torque that is no number is the sign of a damaged export
            number(path, line, TORQUE, row[k], TORQUE_MAX)
        rows.append((line, *values))
        marked += mark is not None and row[mark] == "1"
    return rows, marked  # type: ignore[return-value]


def _grid(path: Path) -> _Grid:
    """Rows in any order to a rectangular grid; every cell exactly once."""
    rows, marked = _rows(path)
    id_A = np.array(sorted({row[1] for row in rows}))
    iq_A = np.array(sorted({row[2] for row in rows}))
    if len(id_A) < NODES_MIN or len(iq_A) < NODES_MIN:
        raise FluxtrueError(
            f"{path}: {len(id_A)} x {len(iq_A)} different (id_A, iq_A), wanted: at least {NODES_MIN} x {NODES_MIN}"
        )
    line_of: dict[tuple[float, float], int] = {}
    psi_d, psi_q = np.full((len(id_A), len(iq_A)), np.nan), np.full((len(id_A), len(iq_A)), np.nan)
    for line, d, q, flux_d, flux_q in rows:
        if (d, q) in line_of:
            raise FluxtrueError(
                f"{path}:{line}: id_A = {d:g}, iq_A = {q:g} again, first on line {line_of[d, q]}; "
                "wanted: every point once"
            )
        line_of[d, q] = line
        at = np.searchsorted(id_A, d), np.searchsorted(iq_A, q)
        psi_d[at], psi_q[at] = flux_d, flux_q
    holes = np.argwhere(np.isnan(psi_d))
    if len(holes):
        k, j = holes[0]
        lines = sorted(line for (d, _), line in line_of.items() if d == id_A[k])
        raise FluxtrueError(
            f"{path}: no row with id_A = {id_A[k]:g}, iq_A = {iq_A[j]:g} ({len(holes)} missing; "
            f"id_A = {id_A[k]:g} stands on lines {lines[0]} to {lines[-1]}); "
            "wanted: a full rectangular grid"
        )
    return _Grid(id_A, iq_A, psi_d, psi_q, line_of, marked)


def _check_cover(path: Path, grid: _Grid, i_max_A: float) -> None:
    reach = max(-grid.iq_A[0], grid.iq_A[-1])
    if grid.iq_A[0] < 0 < grid.iq_A[-1]:
        reach = min(-grid.iq_A[0], grid.iq_A[-1])
    slack = 1e-9 * i_max_A
    if grid.id_A[0] > -i_max_A + slack or grid.id_A[-1] < -slack or reach < i_max_A - slack:
        raise FluxtrueError(
            f"{path}: map too small: id_A {grid.id_A[0]:g} to {grid.id_A[-1]:g}, "
            f"iq_A {grid.iq_A[0]:g} to {grid.iq_A[-1]:g}; wanted for machine.i_max_A = {i_max_A:g}: "
            f"id_A from {-i_max_A:g} to 0 and iq_A to {i_max_A:g} in at least one half"
        )
    if not (grid.iq_A[0] < 0 < grid.iq_A[-1]) and 0.0 not in grid.iq_A:
        raise FluxtrueError(
            f"{path}: iq_A {grid.iq_A[0]:g} to {grid.iq_A[-1]:g} is one half of the plane "
            "without its edge; wanted: iq_A = 0 too"
        )


def _mirror(iq: Array, psi_d: Array, psi_q: Array) -> tuple[Array, Array, Array]:
    """Extend the map from i_q >= 0 to the full plane."""
    full_iq = np.concatenate((-iq[:0:-1], iq))
    full_d = np.concatenate((psi_d[:, :0:-1], psi_d), axis=1)
    full_q = np.concatenate((-psi_q[:, :0:-1], psi_q), axis=1)
    return full_iq, full_d, full_q


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def _both_halves(grid: _Grid) -> tuple[Array, Array, Array, Symmetry]:
    """Even part of psi_d, odd part of psi_q; nodes without a partner get it by interpolation."""
    reach = min(-grid.iq_A[0], grid.iq_A[-1])
    iq = np.unique(np.abs(np.concatenate((grid.iq_A, [0.0]))))
    iq = iq[iq <= reach]
    shared = np.isin(iq, grid.iq_A).all() and np.isin(-iq, grid.iq_A).all()
    if shared:
        plus, minus = np.searchsorted(grid.iq_A, iq), np.searchsorted(grid.iq_A, -iq)
        d_plus, d_minus = grid.psi_d[:, plus], grid.psi_d[:, minus]
        q_plus, q_minus = grid.psi_q[:, plus], grid.psi_q[:, minus]
    else:
        model = SplineModel(grid.id_A, grid.iq_A, grid.psi_d, grid.psi_q)
        d, q = np.meshgrid(grid.id_A, iq, indexing="ij")
        d_plus, d_minus = model.psi_d(d, q), model.psi_d(d, -q)
        q_plus, q_minus = model.psi_q(d, q), model.psi_q(d, -q)
    lost_d, lost_q = (d_plus - d_minus) / 2, (q_plus + q_minus) / 2
    source = "both halves" if shared else "both halves, mirrored nodes interpolated"
    # The removed parts over the whole plane: every node except those at i_q = 0 counts twice.
    both = np.concatenate((np.arange(len(iq)), np.arange(1, len(iq))))
    symmetry = Symmetry(
        source,
        float(np.abs(lost_d).max()),
        _rms(lost_d[:, both]),
        float(np.abs(lost_q).max()),
        _rms(lost_q[:, both]),
        float(lost_q[:, both].mean()),
    )
    return iq, (d_plus + d_minus) / 2, (q_plus - q_minus) / 2, symmetry


def _one_half(grid: _Grid) -> tuple[Array, Array, Array, Symmetry]:
    """One half mirrored. psi_q(i_q = 0) must become 0: that offset is taken from its whole i_d row."""
    negative = grid.iq_A[0] < 0
    iq = -grid.iq_A[::-1] if negative else grid.iq_A
    iq = np.abs(iq)  # avoids minus zero
    psi_d = grid.psi_d[:, ::-1] if negative else grid.psi_d
    psi_q = -grid.psi_q[:, ::-1] if negative else grid.psi_q
    offset = psi_q[:, :1]
    half = "i_q <= 0" if negative else "i_q >= 0"
    symmetry = Symmetry(
        f"{half}, mirrored",
        0.0,
        0.0,
        float(np.abs(offset).max()),
        _rms(offset),
        float(offset.mean()) * (-1.0 if negative else 1.0),
    )
    return iq, psi_d, psi_q - offset, symmetry


def _place(grid: _Grid, i_d: float, i_q: float) -> str:
    """The point of the file that belongs to a point of the symmetrised half plane."""
    for q in (i_q, -i_q):
        line = grid.line_of.get((i_d, q + 0.0)) or grid.line_of.get((i_d, -0.0 if q == 0.0 else q))
        if line is not None:
            return f"id_A = {i_d:g}, iq_A = {q + 0.0:g} (line {line})"
    return f"id_A = {i_d:g}, iq_A = +-{i_q:g}"


def _check_rising(path: Path, grid: _Grid, iq: Array, name: str, psi: Array, axis: int) -> None:
    """Refuse a flux that falls while its own current rises, and name the place in the file."""
    steps = np.diff(psi, axis=axis)
    falls = steps <= 0
    if not falls.any():
        return
    k, j = np.argwhere(falls)[0]
    current = "id_A" if axis == 0 else "iq_A"
    here, there = (grid.id_A[k], iq[j]), (grid.id_A[k + (axis == 0)], iq[j + (axis == 1)])
    sign = f"; everywhere: its sign is the other way round, wanted: {name} rising with {current}"
    turned = sign if np.all(steps < 0) else "; it is the same everywhere" if not steps.any() else ""
    raise FluxtrueError(
        f"{path}: {name} does not rise with {current} from {_place(grid, *here)} to "
        f"{_place(grid, *there)}{turned}; wanted: positive incremental inductances everywhere"
    )


def _check_physics(path: Path, grid: _Grid, iq: Array, psi_d: Array, psi_q: Array) -> None:
    """On the half plane i_q >= 0, after symmetrising."""
    psi_f = float(np.interp(0.0, grid.id_A, psi_d[:, 0]))
    if psi_f <= 0:
        raise FluxtrueError(
            f"{path}: psi_d_Vs = {psi_f:g} V·s at id_A = 0, iq_A = 0, allowed: above 0 "
            "(the d axis lies along the magnet)"
        )
    _check_rising(path, grid, iq, "psi_d_Vs", psi_d, 0)
    _check_rising(path, grid, iq, "psi_q_Vs", psi_q, 1)


def load_flux_map(path: Path, i_max_A: float) -> FluxMap:
    """Read, check and symmetrise a map."""
    grid = _grid(path)
    _check_cover(path, grid, i_max_A)
    both = grid.iq_A[0] < 0 < grid.iq_A[-1]
    iq, psi_d, psi_q, symmetry = _both_halves(grid) if both else _one_half(grid)
    psi_q[:, 0] = 0.0
    _check_physics(path, grid, iq, psi_d, psi_q)
    full_iq, full_d, full_q = _mirror(iq, psi_d, psi_q)
    return FluxMap(grid.id_A, full_iq, full_d, full_q, symmetry, (grid.marked, len(grid.line_of)))
