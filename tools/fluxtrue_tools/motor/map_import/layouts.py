# SPDX-License-Identifier: Apache-2.0
"""Where other programs keep a flux map in their files.

- SyR-e (github.com/SyR-e/syre_public, commit 736d008: mfiles/syreMMM/MMM_load.m, MMM_load_fdfq.m, MMM_save_fdfq.m,
  MMM_sr2pm.m, MMM_defaultMotorModel.m, MMM_back_compatibility.m, calcIronLoss.m): `motorModel.FluxMap_dq` (formerly
  `fdfq`) with Id, Iq, Fd, Fq, T and `motorModel.data` with axisType, p, Rs, tempCu, Imax, nmax, Vdc, J; or the same
  five arrays by themselves (fdfq_idiq_n256.mat). A map that is not computed yet is an empty array. Peak values,
  T = 1.5 p (Fd Iq - Fq Id); Iq changes from row to row (meshgrid); axisType SR is d along the larger inductance.
- motulator (github.com/Aalto-Electric-Drives/motulator, motulator/drive/utils): complex i_s_dq, psi_s_dq and tau_M of
  its MagneticModel, i_s, psi_s, tau_M up to version 0.5, or the real arrays id_map, iq_map, psid_map, psiq_map of its
  measured example. Peak values, d along the magnet.
- pyleecan 1.4.2 (pyleecan/Classes/LUTdq.py, OPMatrix.py, Functions/Save): Phi_dqh_mean, one row of d, q, h for each
  operating point, rms values; the operating points are OP_matrix with columns N0, Id, Iq, or an object with Id_ref and
  Iq_ref below simu.var_simu.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.arrays import Tree, array, at, load, names, scalar
from fluxtrue_tools.motor.map_import.source import FLUXES, PLACES, QUANTITIES, Losses, Raw, known_as, mapping, place_of

COPPER_PER_K = 0.00393
# Names of the maps of a machine, the present one and that of older files.
SYRE_FLUXES = ("motorModel.FluxMap_dq", "motorModel.fdfq")
SYRE_IRON = ("motorModel.IronPMLossMap_dq", "motorModel.ironLoss")
SYRE_SPEEDS = (0.5, 1.0, 2.0)  # of the one at which SyR-e's losses were computed


def _spread(path: Path, found: dict[str, Array], rows: str | None) -> dict[str, Array]:
    """Two axes and matrices, or arrays of one shape, as columns."""
    sizes = {name: values.size for name, values in found.items()}
    if len(set(sizes.values())) == 1:
        return {name: np.ravel(values) for name, values in found.items()}
    pair = next(pair for pair in PLACES if {*pair} <= {*found})
    first, second = (np.ravel(found[name]) for name in pair)
    matrices = {name: values for name, values in found.items() if name not in pair}
    shapes = {values.shape for values in matrices.values()}
    straight, turned = (first.size, second.size), (second.size, first.size)
    if len(shapes) != 1 or not shapes <= {straight, turned}:
        told = ", ".join(f"{name} {'x'.join(map(str, values.shape))}" for name, values in found.items())
        raise FluxtrueError(f"{path}: {told}; wanted: arrays of one size, or axes and matrices that fit them")
    if straight == turned and rows is None:
        raise FluxtrueError(f"{path}: {first.size} x {second.size} matrices over two axes; wanted: --rows {pair[0]} or "
                            f"{pair[1]}, the current that changes from row to row")  # fmt: skip
    by_first = rows == pair[0] if straight == turned else shapes == {straight}
    a, b = np.meshgrid(first, second, indexing="ij" if by_first else "xy")
    return {pair[0]: a.ravel(), pair[1]: b.ravel(), **{name: values.ravel() for name, values in matrices.items()}}


def _real(path: Path, tree: Tree, name: str) -> Array:
    values = array(path, tree, name)
    if np.iscomplexobj(values):
        raise FluxtrueError(f"{path}: {name} is complex, allowed: real numbers")
    return values


def named(path: Path, columns: tuple[str, ...], rows: str | None) -> Raw:
    """Arrays by the names on the command line, or the usual ones."""
    tree = load(path)
    chosen = mapping(columns, "--column", QUANTITIES)
    present = dict(chosen)
    everything = names(tree)
    for quantity in QUANTITIES:
        usual = [name for name in everything if known_as(quantity, name.rpartition(".")[2])]
        if quantity not in present and len(usual) == 1:
            present[quantity] = usual[0]
    pair = place_of(set(present), chosen, path, "--column")
    present = {name: where for name, where in present.items() if name in (*pair, *FLUXES, "torque")}
    missing = [name for name in FLUXES if name not in present]
    if missing:
        shown = ", ".join(everything[:20]) or "nothing"
        raise FluxtrueError(
            f"{path}: no {' and no '.join(missing)}, found: {shown}; name them with --column NAME=ARRAY"
        )
    return Raw(path, _spread(path, {name: _real(path, tree, where) for name, where in present.items()}, rows))


def _five(path: Path, tree: Tree, prefix: str) -> dict[str, Array]:
    theirs = {"i_d": "Id", "i_q": "Iq", "psi_d": "Fd", "psi_q": "Fq"}
    found = {name: _real(path, tree, prefix + their) for name, their in theirs.items()}
    torque = at(tree, f"{prefix}T")
    if torque is not None and np.size(torque) == found["psi_d"].size and np.all(np.isfinite(torque)):
        found["torque"] = _real(path, tree, f"{prefix}T")
    return _spread(path, found, "i_q")


def _syre_map(tree: Tree, names_of_it: tuple[str, ...]) -> str | None:
    """The name of a map that the file has, newest name first."""
    return next((name for name in names_of_it if isinstance(at(tree, name), dict)), None)


def _syre_facts(tree: Tree) -> Iterator[tuple[str, Any]]:
    data = "motorModel.data."
    pole_pairs, resistance = scalar(tree, f"{data}p"), scalar(tree, f"{data}Rs")
    if pole_pairs:
        yield "machine.pole_pairs", round(pole_pairs)
    if resistance and resistance > 0.0:
        copper = scalar(tree, f"{data}tempCu")
        yield "machine.r_ohm", float(f"{resistance / (1.0 + COPPER_PER_K * ((copper or 20.0) - 20.0)):.6g}")
    keys = (("machine.i_max_A", "Imax"), ("machine.speed_max_rpm", "nmax"), ("machine.inertia_kgm2", "J"),
            ("inverter.vdc_V", "Vdc"))  # fmt: skip
    for key, theirs in keys:
        value = scalar(tree, data + theirs)
        if value is not None and value > 0.0:
            yield key, value


def _syre_losses(path: Path, tree: Tree) -> Losses | None:
    """P = P_h (f/f0)^expH + P_c (f/f0)^expC + segPM P_pm (f/f0)^expPM of a loss map, at some speeds."""
    prefix = f"{_syre_map(tree, SYRE_IRON)}."
    if at(tree, f"{prefix}type") != "map" or at(tree, f"{prefix}Pfes_h") is None:
        return None
    frequency = scalar(tree, f"{prefix}f0")
    if not frequency:
        return None
    i_d, i_q = (np.ravel(_real(path, tree, prefix + name)) for name in ("Id", "Iq"))

    def part(*theirs: str) -> Array:
        return np.asarray(sum(np.ravel(_real(path, tree, prefix + name)) for name in theirs))

    def exponent(name: str, usual: float) -> float:
        return scalar(tree, prefix + name) or usual

    terms = ((part("Pfes_h", "Pfer_h"), exponent("expH", 1.0)), (part("Pfes_c", "Pfer_c"), exponent("expC", 2.0)),
             (exponent("segPM", 1.0) * part("Ppm"), exponent("expPM", 2.0)))  # fmt: skip
    losses = [np.sum([values * speed**power for values, power in terms], axis=0) for speed in SYRE_SPEEDS]
    omega = np.repeat(2.0 * math.pi * frequency * np.array(SYRE_SPEEDS), i_d.size)
    return Losses(np.tile(i_d, len(SYRE_SPEEDS)), np.tile(i_q, len(SYRE_SPEEDS)), omega, np.concatenate(losses))


def syre(path: Path) -> Raw:
    """SyR-e: motorModel or fdfq."""
    tree = load(path)
    whole = _syre_map(tree, SYRE_FLUXES)
    if whole is None and at(tree, "Fd") is None:
        if at(tree, "motorModel") is not None or at(tree, "dataSet") is not None:
            raise FluxtrueError(f"{path}: this machine of SyR-e has no dq flux map yet; wanted: one loaded or computed "
                                "in its magnetic model manipulation, and the machine saved with it")  # fmt: skip
        raise FluxtrueError(f"{path}: neither motorModel.FluxMap_dq nor Id, Iq, Fd, Fq; wanted: a file of SyR-e's "
                            "magnetic model manipulation")  # fmt: skip
    quantities = _five(path, tree, "" if whole is None else f"{whole}.")
    phases = scalar(tree, "motorModel.data.n3phase") or 1.0
    if phases != 1.0:
        raise FluxtrueError(f"{path}: motorModel.data.n3phase = {phases:g}, allowed: 1, one three-phase winding")
    fixed = {"current": "peak", "flux": "peak", "flux_unit": "Vs", "counting": "motor"}
    axes = at(tree, "motorModel.data.axisType")
    if axes in ("SR", "PM"):
        fixed["axes"] = "synrm" if axes == "SR" else "pm"
    notes = []
    copper, magnet = scalar(tree, "motorModel.data.tempCu"), scalar(tree, "motorModel.data.tempPM")
    if whole and copper is not None:
        notes.append(f"Rs                 taken as that at tempCu = {copper:g} °C, brought to 20 °C")
    if magnet is not None:
        notes.append(f"magnets            the map is that of tempPM = {magnet:g} °C")
    return Raw(path, quantities, fixed, dict(_syre_facts(tree)), notes, _syre_losses(path, tree) if whole else None)


def motulator(path: Path) -> Raw:
    """motulator: complex arrays, or the four maps of its measured example."""
    tree = load(path)
    fixed = {"current": "peak", "flux": "peak", "flux_unit": "Vs", "counting": "motor", "axes": "pm"}
    for current, flux in (("i_s_dq", "psi_s_dq"), ("i_s", "psi_s")):
        if at(tree, current) is None or at(tree, flux) is None:
            continue
        i, psi = (np.ravel(array(path, tree, name)) for name in (current, flux))
        if i.size != psi.size:
            raise FluxtrueError(f"{path}: {current} has {i.size} values, {flux} {psi.size}; wanted: as many")
        found = {"i_d": i.real, "i_q": i.imag, "psi_d": psi.real, "psi_q": psi.imag}
        if np.size(at(tree, "tau_M")) == i.size:
            found["torque"] = np.ravel(_real(path, tree, "tau_M"))
        return Raw(path, found, fixed)
    if at(tree, "psid_map") is not None:
        theirs = {"i_d": "id_map", "i_q": "iq_map", "psi_d": "psid_map", "psi_q": "psiq_map"}
        return Raw(path, _spread(path, {name: _real(path, tree, their) for name, their in theirs.items()}, None), fixed)
    shown = ", ".join(names(tree)[:20]) or "nothing"
    raise FluxtrueError(f"{path}: found {shown}; wanted: i_s_dq and psi_s_dq, i_s and psi_s, or id_map, "
                        "iq_map, psid_map, psiq_map")  # fmt: skip


def _operating_points(path: Path, tree: Tree) -> tuple[Array, Array]:
    for name in ("OP_matrix", "simu.var_simu.OP_matrix", "simu.input.OP_matrix"):
        node = at(tree, name)
        if isinstance(node, dict) and "Id_ref" in node:
            return _real(path, tree, f"{name}.Id_ref").ravel(), _real(path, tree, f"{name}.Iq_ref").ravel()
        if node is not None and not isinstance(node, dict | str):
            matrix = _real(path, tree, name)
            if matrix.ndim == 2 and matrix.shape[1] >= 3:
                return matrix[:, 1], matrix[:, 2]
    raise FluxtrueError(f"{path}: no operating points, wanted: OP_matrix with columns N0, Id, Iq, or "
                        "simu.var_simu.OP_matrix with Id_ref, Iq_ref")  # fmt: skip


def pyleecan(path: Path) -> Raw:
    """pyleecan's table of fluxes over operating points."""
    tree = load(path)
    flux = _real(path, tree, "Phi_dqh_mean")
    i_d, i_q = _operating_points(path, tree)
    if flux.ndim != 2 or flux.shape[1] < 2 or len(flux) != len(i_d) or len(i_d) != len(i_q):
        raise FluxtrueError(f"{path}: Phi_dqh_mean is {' x '.join(map(str, flux.shape))}, wanted: {len(i_d)} rows of "
                            "d, q, h, one for each operating point")  # fmt: skip
    facts = {}
    pole_pairs = scalar(tree, "simu.machine.stator.winding.p")
    if pole_pairs:
        facts["machine.pole_pairs"] = round(pole_pairs)
    fixed = {"current": "rms", "flux": "rms", "flux_unit": "Vs", "counting": "motor", "axes": "pm"}
    return Raw(path, {"i_d": i_d, "i_q": i_q, "psi_d": flux[:, 0], "psi_q": flux[:, 1]}, fixed, facts)
