# SPDX-License-Identifier: Apache-2.0
"""The L_d/L_q service's tables, docs/theory/flux-tables.md, and their error as the firmware reads them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.bases import Bases
from fluxtrue_tools.motor.config import Machine
from fluxtrue_tools.motor.flux_model import Array, FluxModel, torque
from fluxtrue_tools.motor.quantise import Q15_ONE, q15_table, shift_for

SHIFT_COARSE, SHIFT_FINE = 10, 8
ERROR_WANTED = 0.002  # of torque_max
NODES_MAX = 255
SHIFT_MAX = 13
G_MAX, POLE_GAIN_MAX = 0.99, 0.999  # of their formats
OBSERVER_M_MAX = 4.0  # the largest that motor.toml and calibration take

IntTable = NDArray[np.int64]


@dataclass(frozen=True)
class FluxTables:
    """SI tables [ix][iy] over i_d = id_A[ix], |i_q| = iq_A[iy], and what the firmware stores of them."""

    shift: int  # node spacing in q15 counts is 2^shift
    id_A: Array
    iq_A: Array
    l_d_H: Array
    l_q_H: Array
    l_dd_H: Array
    l_qq_H: Array
    psi_f0_Vs: Array
    l_shift: int
    g_shift: int  # g is stored as g / 2^g_shift
    x0: int
    stored: dict[str, IntTable]

    @property
    def flash_bytes(self) -> int:
        """psi_f0 depends on i_q alone: one row of it is stored."""
        return sum(2 * (table[:1] if name == "psi_f0" else table).size for name, table in self.stored.items())


@dataclass(frozen=True)
class TableError:
    """Firmware look-up minus map over the i_max half disc i_d <= 0."""

    psi_d_max_Vs: float
    psi_q_max_Vs: float
    torque_max_Nm: float
    torque_rms_Nm: float


def _nodes(i_max_A: float, step_A: float) -> tuple[Array, Array]:
    """i_d: from beyond -i_max to one node above 0; |i_q|: from 0 to beyond i_max."""
    count = math.ceil(i_max_A / step_A - 1e-9)
    return np.arange(-count, 2) * step_A, np.arange(0, count + 1) * step_A


def _chord(f: Array, g: Array, width: float) -> Array:
    return (f - g) / width


def _inductances(model: FluxModel, id_A: Array, iq_A: Array) -> dict[str, Array]:
    d, q = np.meshgrid(id_A, iq_A, indexing="ij")
    step = iq_A[1] - iq_A[0]
    half = step / 2
    psi_f0 = np.broadcast_to(model.psi_d(0.0, iq_A), d.shape)
    # Apparent: 0/0 on the axes, where the limit is the slope. (FT-2), (FT-3)
    at_d, at_q = d == 0.0, q == 0.0
    l_d = np.where(at_d, model.psi_d(0.0, q, nd=1), (model.psi_d(d, q) - psi_f0) / np.where(at_d, 1.0, d))
    l_q = np.where(at_q, model.psi_q(d, 0.0, nq=1), model.psi_q(d, q) / np.where(at_q, 1.0, q))
    # Incremental: the mean slope over one node spacing, so that no detail of the map is aliased. (FT-4)
    l_dd = _chord(model.psi_d(d + half, q), model.psi_d(d - half, q), step)
    l_qq = _chord(model.psi_q(d, q + half), model.psi_q(d, q - half), step)
    return {"l_d": l_d, "l_q": l_q, "l_dd": l_dd, "l_qq": l_qq, "psi_f0": np.array(psi_f0)}


def _g_shift(g_max: float, r_per_unit: float) -> int:
    """The shift nearest to 0 with which g and pole_gain fit; where they cannot both, pole_gain (FT-5)."""
    least = math.ceil(math.log2(g_max / G_MAX))
    most = math.floor(math.log2(POLE_GAIN_MAX / (4.0 * OBSERVER_M_MAX * r_per_unit)))
    return min(max(0, least), most)


def _build(model: FluxModel, bases: Bases, machine: Machine, shift: int) -> FluxTables:
    i_max_A = machine.i_max_A
    step_A = (1 << shift) / Q15_ONE * bases.current_A
    id_A, iq_A = _nodes(i_max_A, step_A)
    if max(len(id_A), len(iq_A)) > NODES_MAX:
        raise FluxtrueError(f"flux tables: {len(id_A)} x {len(iq_A)} nodes, allowed: up to {NODES_MAX} per axis")
    si = _inductances(model, id_A, iq_A)
    if min(si["l_q"].min(), si["l_dd"].min(), si["l_qq"].min()) <= 0:
        raise FluxtrueError(
            "flux tables: an inductance is not positive within machine.i_max_A; "
            "wanted: positive incremental inductances everywhere"
        )
    per_unit = {name: si[name] / bases.inductance_H for name in ("l_d", "l_q", "l_dd", "l_qq")}
    omega_ts = bases.omega_rad_s * bases.period_s
    inverse = omega_ts / 2 * (1 / per_unit["l_dd"] + 1 / per_unit["l_qq"])
    l_shift = shift_for(max(float(np.abs(table).max()) for table in per_unit.values()))
    if l_shift > SHIFT_MAX:
        raise FluxtrueError(
            f"flux tables: inductances span more than 2^{SHIFT_MAX} around L_b = "
            f"{bases.inductance_H:.3g} H; check ld/lq, current_full_scale_A and speed_max_rpm"
        )
    stored = {name: q15_table(per_unit[name] / (1 << l_shift), name) for name in ("l_d", "l_q", "l_qq")}
    inside = np.hypot(*np.meshgrid(id_A, iq_A, indexing="ij")) <= i_max_A * (1 + 1e-9)
    g_shift = _g_shift(float(inverse[inside].max()), machine.r_ohm / bases.resistance_ohm)
    # What exceeds the format is limited: corners beyond the current circle, and poles faster than s2 = 1/4. (FT-5)
    stored["g"] = q15_table(np.minimum(inverse / 2.0**g_shift, 1 - 1 / Q15_ONE), "g")
    stored["psi_f0"] = q15_table(si["psi_f0"] / bases.flux_Vs, "psi_f0")
    for name in ("l_q", "l_qq", "g"):
        if stored[name].min() <= 0:
            raise FluxtrueError(f"flux tables: {name} is too small for its format; inductances span too wide a range")
    x0 = -(len(id_A) - 2) << shift
    return FluxTables(
        shift, id_A, iq_A, si["l_d"], si["l_q"], si["l_dd"], si["l_qq"], si["psi_f0"], l_shift, g_shift, x0,
        stored,
    )  # fmt: skip


def _axis(x: IntTable, x0: int, shift: int, n: int) -> tuple[IntTable, IntTable]:
    """fx_axis(): cell and Q14 weight, clamped at both ends, the last node one weight short of itself."""
    cells = (np.clip(x - x0, 0, (1 << 17) - 1) << 14) >> shift
    position = np.minimum(cells, (n << 14) - 0x4001)
    return position >> 14, position & 0x3FFF


def _sum(table: IntTable, x: IntTable, y: IntTable, origin: tuple[int, int], shift: int) -> IntTable:
    """fx_cell() and fx_cell_sum(): Q14 weights that sum to one, nothing rounded."""
    nx, ny = table.shape
    ix, wx = _axis(x, origin[0], shift, nx)
    iy, wy = _axis(y, origin[1], shift, ny)
    w11 = (wx * wy + 0x2000) >> 14
    w10, w01 = wx - w11, wy - w11
    w00 = 0x4000 - wx - w01
    return w00 * table[ix, iy] + w01 * table[ix, iy + 1] + w10 * table[ix + 1, iy] + w11 * table[ix + 1, iy + 1]


def bilinear(table: IntTable, x: IntTable, y: IntTable, origin: tuple[int, int], shift: int) -> IntTable:
    """fx_cell_interp(): one rounding."""
    return (_sum(table, x, y, origin, shift) + 0x2000) >> 14


def lookup_flux(tables: FluxTables, i_d: IntTable, i_q: IntTable) -> tuple[IntTable, IntTable]:
    """flux_table_step(): psi_d, psi_q in q15 from currents in q15."""
    y = np.abs(i_q)
    where = (i_d, y, (tables.x0, 0), tables.shift)
    l_d, l_q = (_sum(tables.stored[name], *where) for name in ("l_d", "l_q"))
    scale, half = 8 << tables.l_shift, 1 << 31
    psi_d = bilinear(tables.stored["psi_f0"], *where) + ((l_d * i_d * scale + half) >> 32)
    return psi_d, (l_q * i_q * scale + half) >> 32


def error_plane(
    tables: FluxTables, model: FluxModel, bases: Bases, i_max_A: float, pole_pairs: int
) -> tuple[Array, Array, Array, Array, Array]:
    """i_d, i_q and the errors of psi_d, psi_q, torque there: stored tables, read as the firmware does, minus map."""
    reach = int(i_max_A / bases.current_A * Q15_ONE)
    d, q = np.meshgrid(
        np.linspace(-reach, 0, 151).astype(np.int64), np.linspace(0, reach, 151).astype(np.int64), indexing="ij"
    )
    psi_d, psi_q = lookup_flux(tables, d, q)
    i_d, i_q = d / Q15_ONE * bases.current_A, q / Q15_ONE * bases.current_A
    read_d, read_q = psi_d / Q15_ONE * bases.flux_Vs, psi_q / Q15_ONE * bases.flux_Vs
    error_t = 1.5 * pole_pairs * (read_d * i_q - read_q * i_d) - torque(model, pole_pairs, i_d, i_q)
    return i_d, i_q, read_d - model.psi_d(i_d, i_q), read_q - model.psi_q(i_d, i_q), error_t


def table_error(tables: FluxTables, model: FluxModel, bases: Bases, i_max_A: float, pole_pairs: int) -> TableError:
    """The worst and the mean of error_plane() inside the current circle."""
    i_d, i_q, *errors = error_plane(tables, model, bases, i_max_A, pole_pairs)
    inside = np.hypot(i_d, i_q) <= i_max_A
    e_d, e_q, e_t = (error[inside] for error in errors)
    return TableError(
        float(np.abs(e_d).max()), float(np.abs(e_q).max()), float(np.abs(e_t).max()), float(np.sqrt(np.mean(e_t**2)))
    )


def make_flux_tables(model: FluxModel, bases: Bases, machine: Machine) -> tuple[FluxTables, TableError]:
    """The coarsest grid whose torque error is within 0.2 % of torque_max; else the finest."""
    for shift in range(SHIFT_COARSE, SHIFT_FINE - 1, -1):
        tables = _build(model, bases, machine, shift)
        error = table_error(tables, model, bases, machine.i_max_A, machine.pole_pairs)
        if error.torque_max_Nm <= ERROR_WANTED * machine.torque_max_Nm:
            break
    return tables, error
