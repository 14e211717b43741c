# SPDX-License-Identifier: Apache-2.0
"""Files of arrays: SyR-e, motulator, pyleecan, and any .mat by the names of its arrays.

scipy, h5py, numpy and json write the files in the layouts that fluxtrue_tools/motor/map_import/layouts.py cites;
motulator's own reader is the second opinion on SyR-e's.
"""

import gzip
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import POLE_PAIRS, Array, Importer, plane, psi, torque

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.map_import import frame
from fluxtrue_tools.motor.map_import.layouts import motulator, named, pyleecan, syre
from fluxtrue_tools.motor.map_import.source import Raw

SIDE = 15
AXIS = np.linspace(0.0, 250.0, SIDE)
D, Q = plane(-AXIS[::-1], AXIS)
PSI = psi(D, Q)
K_H, K_E, SPEED = 10.0, 0.008, 2.0 * math.pi * 200.0


def sorted_table(raw: Raw) -> Array:
    points = frame.to_frame(raw, frame.Convention(**raw.fixed)).points
    columns = [points.i_d, points.i_q, points.psi_d, points.psi_q]
    columns += [] if points.torque is None else [points.torque]
    table = np.column_stack(columns)
    return np.asarray(table[np.lexsort((table[:, 1].round(6), table[:, 0].round(6)))])


OURS = np.column_stack((D, Q, *PSI, torque(D, Q)))
OURS = OURS[np.lexsort((Q.round(6), D.round(6)))]


def syre_model(axes: str) -> dict[str, Any]:
    """motorModel over a meshgrid; with SR axes the magnet lies along -q: Id = our i_q, Iq = -(our i_d)."""
    i_d, i_q = np.meshgrid(AXIS if axes == "SR" else -AXIS[::-1], AXIS)
    ours = (-i_q, i_d) if axes == "SR" else (i_d, i_q)
    psi_d, psi_q = psi(*ours)
    flux = (psi_q, -psi_d) if axes == "SR" else (psi_d, psi_q)
    squared = (psi_d**2 + psi_q**2) * SPEED
    none = np.zeros_like(i_d)
    losses = {"type": "map", "Id": i_d, "Iq": i_q, "f0": 200.0, "n0": 3000.0, "expH": 1.0, "expC": 2.0, "expPM": 2.0,
              "segPM": 1.0, "Pfes_h": 0.6 * K_H * squared, "Pfer_h": 0.4 * K_H * squared,
              "Pfes_c": 0.7 * K_E * SPEED * squared, "Pfer_c": 0.3 * K_E * SPEED * squared, "Ppm": none}  # fmt: skip
    data = {"axisType": axes, "p": float(POLE_PAIRS), "Rs": 0.02 * (1.0 + 0.00393 * 80.0), "tempCu": 100.0,
            "nmax": 8000.0, "Imax": 240.0, "J": 0.05, "Vdc": 350.0, "n3phase": 1.0, "tempPM": 80.0,
            "T0": np.nan}  # fmt: skip
    maps = {"Id": i_d, "Iq": i_q, "Fd": flux[0], "Fq": flux[1], "T": torque(*ours), "dT": np.full_like(i_d, np.nan)}
    return {"motorModel": {"data": data, "FluxMap_dq": maps, "IronPMLossMap_dq": losses}}


def mat5(path: Path, tree: dict[str, Any]) -> Path:
    from scipy.io import savemat

    savemat(path, tree)
    return path


def mat73(path: Path, tree: dict[str, Any]) -> Path:
    """HDF5 as MATLAB writes it: a head of 512 bytes, structures as groups, the first index fastest, text as numbers."""
    import h5py

    def fill(group: h5py.Group, values: dict[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, dict):
                fill(group.create_group(name), value)
                continue
            text = isinstance(value, str)
            data = np.array([[ord(sign)] for sign in value], dtype=np.uint16) if text else np.atleast_2d(value).T
            group.create_dataset(name, data=data).attrs["MATLAB_class"] = np.bytes_("char" if text else "double")

    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file, tree)
    with path.open("r+b") as head:
        head.write(b"MATLAB 7.3 MAT-file".ljust(512))
    return path


@pytest.mark.parametrize("write", [mat5, mat73])
@pytest.mark.parametrize("axes", ["SR", "PM"])
def test_a_model_of_syre_becomes_a_motor(tmp_path: Path, importer: Importer, axes: str, write: Callable[..., Path]):
    """Everything but the PWM frequency is in the file; R at 100 °C comes back to the 20 mΩ it has at 20 °C."""
    path = write(tmp_path / "motor.mat", syre_model(axes))
    assert sorted_table(syre(path)) == pytest.approx(OURS, rel=1e-12, abs=1e-12)
    if (axes, write) != ("SR", mat73):
        return
    done, motor = importer(path, "syre", given=("inverter.pwm_hz=10000",))
    machine = motor.config.machine
    assert (machine.pole_pairs, machine.i_max_A, machine.speed_max_rpm) == (POLE_PAIRS, 240.0, 8000.0)
    assert machine.r_ohm == pytest.approx(0.02, rel=1e-5)
    assert machine.iron_loss_hysteresis == pytest.approx(K_H, rel=1e-3)
    assert machine.iron_loss_eddy == pytest.approx(K_E, rel=1e-3)
    assert done.changes.source == "the file's own" and done.changes.worst(done.changes.torque) < 2e-4


@pytest.mark.parametrize("write", [mat5, mat73])
def test_a_machine_of_an_older_syre_has_other_names(tmp_path: Path, write: Callable[..., Path]) -> None:
    """Before MMM_back_compatibility.m renames them, the maps are fdfq and ironLoss."""
    maps = syre_model("PM")["motorModel"]
    old = {"data": maps["data"], "fdfq": maps["FluxMap_dq"], "ironLoss": maps["IronPMLossMap_dq"]}
    raw = syre(write(tmp_path / "motor.mat", {"motorModel": old}))
    assert sorted_table(raw) == pytest.approx(OURS, rel=1e-12, abs=1e-12)
    assert raw.facts["machine.pole_pairs"] == POLE_PAIRS
    assert raw.losses is not None and np.isfinite(raw.losses.loss_W).all()


def test_maps_of_syre_over_two_vectors_have_i_q_from_row_to_row(tmp_path: Path) -> None:
    """As interp2(Id, Iq, Fd), with which SyR-e reads its maps, takes vectors: no option can say so."""
    maps = syre_model("PM")["motorModel"]["FluxMap_dq"]
    maps |= {"Id": maps["Id"][0], "Iq": maps["Iq"][:, :1]}
    assert sorted_table(syre(mat5(tmp_path / "map.mat", maps))) == pytest.approx(OURS, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("write", [mat5, mat73])
@pytest.mark.parametrize("without", ["motorModel", "dataSet"])
def test_a_machine_of_syre_without_a_map_is_refused_in_its_words(
    tmp_path: Path, without: str, write: Callable[..., Path]
) -> None:
    """MMM_load.m makes empty arrays of the maps; a design has only dataSet, geo, per and mat."""
    empty = {"data": {"p": 4.0}, "FluxMap_dq": np.zeros((0, 0)), "IronPMLossMap_dq": np.zeros((0, 0))}
    tree = {"motorModel": empty} if without == "motorModel" else {"dataSet": {"NumOfPolePairs": 4.0}}
    with pytest.raises(FluxtrueError, match="has no dq flux map yet"):
        syre(write(tmp_path / "motor.mat", tree))


def test_maps_of_syre_by_themselves_need_their_axes(tmp_path: Path) -> None:
    maps = syre_model("SR")["motorModel"]["FluxMap_dq"]
    raw = syre(mat5(tmp_path / "fdfq_idiq_n256.mat", maps))
    with pytest.raises(FluxtrueError, match="psi_d = .* without current, .*; with --axes synrm it has 0.0"):
        sorted_table(raw)
    table = sorted_table(Raw(raw.path, raw.quantities, raw.fixed | {"axes": "synrm"}))
    assert table == pytest.approx(OURS, rel=1e-12, abs=1e-12)


def test_motulator_reads_the_same_from_a_file_of_syre(tmp_path: Path, importer: Importer) -> None:
    """Its reader (0.5.0) makes complex arrays of the full plane in the magnet's frame; those are saved and read."""
    flux_maps = pytest.importorskip("motulator.drive.utils._flux_maps")
    theirs = flux_maps.import_syre_data(str(mat5(tmp_path / "motor.mat", syre_model("SR"))))
    np.savez(tmp_path / "map.npz", i_s=theirs.i_s, psi_s=theirs.psi_s, tau_M=theirs.tau_M)
    raw = motulator(tmp_path / "map.npz")
    table = sorted_table(raw)
    assert table[table[:, 1] >= 0.0] == pytest.approx(OURS, rel=1e-12, abs=1e-12)
    done, _ = importer(tmp_path / "map.npz", "motulator")
    assert done.changes.worst(done.changes.torque) < 2e-4


@pytest.mark.parametrize("form", ["MagneticModel", "measured"])
def test_maps_of_motulator(tmp_path: Path, form: str) -> None:
    if form == "MagneticModel":
        path = tmp_path / "map.npz"
        np.savez(path, i_s_dq=D + 1j * Q, psi_s_dq=PSI[0] + 1j * PSI[1], tau_M=torque(D, Q), type="flux_map")
    else:
        shaped = [values.reshape(SIDE, SIDE) for values in (D, Q, *PSI)]
        names = ("id_map", "iq_map", "psid_map", "psiq_map")
        path = mat5(tmp_path / "map.mat", dict(zip(names, shaped, strict=True)))
    table = sorted_table(motulator(path))
    assert table == pytest.approx(OURS[:, : table.shape[1]], rel=1e-12, abs=1e-12)


def lut(form: str) -> dict[str, Any]:
    """A LUTdq with its values as pyleecan has them, rms."""
    i_d, i_q, psi_d, psi_q = (values / math.sqrt(2.0) for values in (D, Q, *PSI))
    speed, none = np.full_like(D, 1000.0), np.zeros_like(D)
    flux = np.column_stack((psi_d, psi_q, none)).tolist()
    head = {"__class__": "LUTdq", "__version__": "pyleecan_1.4.2", "Phi_dqh_mean": flux, "R1": 0.02}
    if form == "matrix":
        return head | {"OP_matrix": np.column_stack((speed, i_d, i_q)).tolist()}
    points = {"N0": speed.tolist(), "Id_ref": i_d.tolist(), "Iq_ref": i_q.tolist(), "Tem_av_ref": None}
    machine = {"stator": {"winding": {"p": POLE_PAIRS}}}
    return head | {"simu": {"var_simu": {"OP_matrix": points}, "machine": machine}}


def write_h5(path: Path, tree: dict[str, Any]) -> None:
    import h5py

    def fill(group: h5py.Group, values: dict[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, dict):
                fill(group.create_group(name), value)
            else:
                group[name] = (
                    np.bytes_("NoneValue" if value is None else value) if isinstance(value, str | None) else value
                )

    with h5py.File(path, "w") as file:
        fill(file, tree)


@pytest.mark.parametrize("form", ["matrix", "object"])
@pytest.mark.parametrize("suffix", [".json", ".json.gz", ".h5"])
def test_tables_of_pyleecan(tmp_path: Path, form: str, suffix: str) -> None:
    path = tmp_path / f"lut{suffix}"
    if suffix == ".h5":
        write_h5(path, lut(form))
    else:
        data = json.dumps(lut(form)).encode()
        path.write_bytes(gzip.compress(data) if suffix == ".json.gz" else data)
    raw = pyleecan(path)
    assert sorted_table(raw) == pytest.approx(OURS[:, :4], rel=1e-12, abs=1e-12)
    assert raw.facts == ({} if form == "matrix" else {"machine.pole_pairs": POLE_PAIRS})


@pytest.mark.parametrize("write", [mat5, mat73])
@pytest.mark.parametrize("rows", ["i_d", "i_q"])
def test_axes_and_matrices_by_their_names(tmp_path: Path, rows: str, write: Callable[..., Path]) -> None:
    """Vectors of 15 and 12 currents: which of them changes from row to row follows from the shape."""
    i_d, i_q = -AXIS[::-1], AXIS[:12]
    d, q = np.meshgrid(i_d, i_q, indexing="ij")
    flux = [values if rows == "i_d" else values.T for values in psi(d, q)]
    path = write(tmp_path / "map.mat", {"id": i_d, "iq": i_q, "maps": {"LambdaD": flux[0], "LambdaQ": flux[1]}})
    columns = ("psi_d=maps.LambdaD", "psi_q=maps.LambdaQ")
    for given in (columns, ()):
        found = sorted_table(named(path, given, None))
        assert found == pytest.approx(OURS[OURS[:, 1] <= AXIS[11] + 1e-9][:, :4], rel=1e-12, abs=1e-12)


def test_motor_cads_names_are_known(tmp_path: Path) -> None:
    """Both pairs of currents are there: the rectangular one is taken."""
    d, q = np.meshgrid(-AXIS[::-1], AXIS)
    flux = psi(d, q)
    maps = {"Id_Peak": d, "Iq_Peak": q, "Flux_Linkage_D": flux[0], "Flux_Linkage_Q": flux[1], "Phase_Advance": d,
            "Stator_Current_Phase_Peak": q, "Electromagnetic_Torque": torque(d, q), "Speed": 3000.0}  # fmt: skip
    raw = named(mat5(tmp_path / "saturation_map.mat", maps), (), None)
    assert sorted_table(raw) == pytest.approx(OURS, rel=1e-12, abs=1e-12)


def test_square_matrices_need_their_rows(tmp_path: Path) -> None:
    d, q = np.meshgrid(-AXIS[::-1], AXIS, indexing="ij")
    flux = psi(d, q)
    path = mat5(tmp_path / "map.mat", {"id": -AXIS[::-1], "iq": AXIS, "fd": flux[0], "fq": flux[1]})
    with pytest.raises(FluxtrueError, match="15 x 15 matrices over two axes; wanted: --rows i_d or i_q"):
        named(path, (), None)
    assert sorted_table(named(path, (), "i_d")) == pytest.approx(OURS[:, :4], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("read", "tree", "words"),
    [
        (syre, {"a": AXIS}, "neither motorModel.FluxMap_dq nor Id, Iq, Fd, Fq"),
        (syre, {"Id": AXIS, "Iq": AXIS, "Fd": AXIS}, "no array Fq, found: Id, Iq, Fd"),
        (syre, {"Id": D, "Iq": Q, "Fd": PSI[0], "Fq": np.where(D < 0, np.nan, 1.0)},
         "Fq has 210 values that are not finite"),
        (motulator, {"a": AXIS}, "found a; wanted: i_s_dq and psi_s_dq"),
        (pyleecan, {"Phi_dqh_mean": AXIS}, "no operating points, wanted: OP_matrix"),
        (pyleecan, {"Phi_dqh_mean": AXIS, "OP_matrix": np.zeros((3, 3))},
         "Phi_dqh_mean is .*, wanted: 3 rows of d, q, h"),
        (lambda path: named(path, (), None), {"a": AXIS}, "no currents found, wanted: i_d and i_q, or i_s and gamma"),
        (lambda path: named(path, (), None), {"id": AXIS, "iq": AXIS}, "no psi_d and no psi_q, found: id, iq"),
        (lambda path: named(path, ("psi_d=x.y",), None), {"id": AXIS, "iq": AXIS, "fq": AXIS},
         "no array x.y, found: id"),
        (lambda path: named(path, (), None), {"id": D, "iq": Q, "fd": AXIS, "fq": Q},
         "wanted: arrays of one size, or axes"),
    ],
)  # fmt: skip
def test_what_is_missing_is_named(
    tmp_path: Path, read: Callable[[Path], Raw], tree: dict[str, Any], words: str
) -> None:
    path = mat5(tmp_path / "map.mat", tree)
    with pytest.raises(FluxtrueError, match=f"map.mat: .*{words}"):
        read(path)


@pytest.mark.parametrize("content", [b"", b"MATLAB 5.0", b"\x89HDF\r\n\x1a\n\0\0", b"PK\3\4", b"{", b"{}x",
                                     b"\x1f\x8b\x08", b"MATLAB 7.3".ljust(512) + b"\x89HDF\r\n\x1a\n"])  # fmt: skip
def test_a_damaged_file_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "map.mat").write_bytes(content)
    with pytest.raises(FluxtrueError, match="map.mat: cannot be read as one of .mat") as error:
        motulator(tmp_path / "map.mat")
    assert "\n" not in str(error.value)
