# SPDX-License-Identifier: Apache-2.0
"""motor import as a whole: a motor folder that motor build accepts, or nothing; what was changed is said."""

import csv
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import FULL, HALF, HSM1, POLE_PAIRS, ROOT, SETTINGS, Importer, polar, psi, torque, written
from in_process import fluxtrue

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor import doubts
from fluxtrue_tools.motor.map_import import report
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.report import report_text

HEADER = "i_d,i_q,psi_d,psi_q,torque"


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    """`fluxtrue motor`, finished."""
    return fluxtrue("motor", *arguments, cwd=ROOT)


def given(*texts: str) -> list[str]:
    return [part for text in (*SETTINGS, *texts) for part in ("--set", text)]


def polar_file(path: Path, *, rows: int = 1000) -> Path:
    """As a finite-element program writes it: rms current, phase advance, mV·s, German numbers, units below."""
    i_d, i_q = polar()
    columns = (np.hypot(i_d, i_q) / np.sqrt(2.0), np.degrees(np.arctan2(-i_d, i_q)), *(1e3 * x for x in psi(i_d, i_q)),
               torque(i_d, i_q))  # fmt: skip
    lines = ["; ".join(f"{value:.8g}" for value in row).replace(".", ",") for row in zip(*columns, strict=True)]
    head = ["Model: invented", "I;Phase Advance;Flux D;Flux Q;Torque", "A;deg;mVs;mVs;Nm"]
    path.write_text("\n".join([*head, *lines[:rows]]) + "\n", encoding="utf-8")
    return path


POLAR = ["--format", "csv", "--column", "i_s=I", "--column", "gamma=Phase Advance", "--column", "psi_d=Flux D",
         "--column", "psi_q=Flux Q", "--current", "rms", "--flux-unit", "mVs", "--angle-from", "q"]  # fmt: skip


def test_a_polar_half_map_becomes_a_motor_that_builds(tmp_path: Path) -> None:
    out = tmp_path / "motors" / "mine"
    done = command("import", polar_file(tmp_path / "map.csv"), *POLAR, "--out", out, *given())
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert {path.name for path in out.iterdir()} == {"motor.toml", "flux_map.csv", "import.txt", "import.png"}
    assert (out / "import.png").read_bytes().startswith(b"\x89PNG")
    text = (out / "import.txt").read_text(encoding="utf-8")
    assert done.stdout == f"{text}motor mine: written to {out}\n"
    assert "current rms, flux peak in mVs, motor convention" in text
    assert 'assumed: machine.name = "mine"' in text and "assumed: machine.i_max_A = 250.0" in text
    share = re.search(r"torque +max ([\d.]+) %, rms [\d.]+ % of [\d.]+ N·m, against the file's own torque", text)
    assert share is not None and float(share[1]) < 0.05  # wanted: 0.2 %
    built = command("build", out, "--out", tmp_path / "built", "--no-report")
    assert built.returncode == 0 and built.stderr == "", built.stderr


@pytest.mark.parametrize(("line", "said"), [
    ("[machine]\nflux_map = 1979-05-27", "machine.flux_map = datetime.date"),
    ("[machine]\nflux_map = ''", "machine.flux_map = ''"),
    ("[machine]\nld_H = nan", "machine.ld_H = nan"), ("flux_map = 'map.csv'\n[machine]", "'flux_map': unknown key"),
    ("[machine]\n'a b' = 1", "'machine.a b': unknown key"),
    ("[machine.r_ohm]\nx = 1", "machine.r_ohm = {'x': 1}, allowed"),
    ("[machine]\nname = 1979-05-27", "machine.name = datetime.date(1979, 5, 27), allowed: a number or text"),
])  # fmt: skip
def test_a_motor_toml_that_cannot_be_meant_is_refused_by_its_key(
    tmp_path: Path, importer: Importer, line: str, said: str
) -> None:
    path = written(tmp_path / "map.csv", HEADER, *HALF, *psi(*HALF), torque(*HALF))
    (tmp_path / "motor.toml").write_text(line + "\n", encoding="utf-8")
    with pytest.raises(FluxtrueError) as error:
        importer(path, motor=tmp_path / "motor.toml")
    assert str(error.value).startswith(str(tmp_path / "motor.toml")) and said in str(error.value)


def test_an_option_that_contradicts_the_header_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "map.csv", "i_d,i_q,Psi_d [Vs],Psi_q [Vs],torque", *HALF, *psi(*HALF), torque(*HALF))
    done = command("import", path, "--format", "csv", "--flux-unit", "mVs", "--out", tmp_path / "o", *given())
    assert done.returncode == 2 and not (tmp_path / "o").exists()
    assert "--flux-unit mVs: the header of" in done.stderr and "says Vs, allowed: the same" in done.stderr


@pytest.mark.parametrize("places", [HALF, FULL], ids=["half", "full"])
def test_the_map_has_the_machines_torque(tmp_path: Path, importer: Importer, places: tuple) -> None:
    """As motor build reads it, on currents that are not its nodes; the curl is that of its bicubic interpolation."""
    path = written(tmp_path / "map.csv", HEADER, *places, *psi(*places), torque(*places))
    done, motor = importer(path)
    d, q = (np.random.default_rng(3).uniform(0.0, 1.0, (2, 2000)).T * (-176.0, 176.0)).T
    found = 1.5 * POLE_PAIRS * (motor.model.psi_d(d, q) * q - motor.model.psi_q(d, q) * d)
    assert np.abs(found - torque(d, q)).max() < 5e-4 * motor.config.machine.torque_max_Nm
    assert doubts.curl(motor.model, 250.0) < 1e-3
    assert report.warnings(done) == [] and doubts.of_motor(motor) == []
    assert motor.config.machine.torque_max_Nm == pytest.approx(0.98 * motor.solver.torque_top_Nm, rel=1e-3)


def test_the_measured_map_keeps_its_torque_and_says_what_it_lost(importer: Importer) -> None:
    """hsm1's map is measured: not reciprocal by 3 to 5 %, psi_q offset by 4 mV·s, halves that differ.

    Its torque column is that of its own fluxes; the part that is the same for +i_q and -i_q cannot stay.
    """
    done, motor = importer(HSM1 / "flux_map.csv", motor=HSM1 / "motor.toml", given=())
    assert done.changes.source == "the file's own" and done.changes.worst(done.changes.torque) < 2e-3
    assert 0.03 < done.curl < 0.05 and done.curl_left < 1e-3
    assert done.fit.offset_Vs == pytest.approx(-4.4e-3, abs=0.3e-3)
    assert motor.config == load_motor(HSM1).config
    assert float(motor.model.psi_d(0.0, 0.0)) == pytest.approx(float(load_motor(HSM1).model.psi_d(0.0, 0.0)), rel=5e-3)
    text = report.text(done)
    assert "extrapolated: 0 of 961 nodes" in text and "of which its offset -4." in text


def test_extrapolation_is_warned_of_and_marked(tmp_path: Path, importer: Importer) -> None:
    path = written(tmp_path / "map.csv", HEADER, *polar(220.0), *psi(*polar(220.0)), torque(*polar(220.0)))
    done, motor = importer(path, given=(*SETTINGS, "machine.i_max_A=250"))
    warned = report.warnings(done)
    assert len(warned) == 1
    assert re.search(r"no points in 2\d % of the circle of machine.i_max_A = 250 A; the map goes on there", warned[0])
    rows = list(csv.DictReader(line for line in (tmp_path / "out" / "flux_map.csv").open() if not line.startswith("#")))
    marked = [row for row in rows if row["extrapolated"] == "1"]
    assert marked and min(np.hypot(float(row["id_A"]), float(row["iq_A"])) for row in marked) > 215.0
    assert len(marked) == int(done.grid.extrapolated.sum())
    assert f"extrapolated       {len(marked)} of {len(rows)} rows, marked when it was imported" in report_text(motor)


def test_what_hurts_is_warned_of(tmp_path: Path, importer: Importer) -> None:
    """An offset of 15 mV·s (6 % of psi_q), a twist that no energy belongs to, losses like no iron's."""
    psi_d, psi_q = psi(*FULL)
    path = written(tmp_path / "map.csv", HEADER[:-7], *FULL, psi_d - 2e-7 * FULL[1] ** 2, psi_q + 0.015)
    done, _ = importer(path, iron_loss_points=((10.0, 1000.0), (10.0, 3000.0), (300.0, 6000.0)))
    assert done.iron_loss is not None and done.iron_loss.share > 0.2
    warned = " | ".join(report.warnings(done))
    assert "the iron losses are not (k_h w + k_e w²)|psi|²: the fit leaves" in warned
    assert "psi_q has an offset of 15 mV·s" in warned and "allowed without a warning: 5 %" in warned
    assert re.search(r"not reciprocal: d psi_d/d i_q and d psi_q/d i_d differ by [\d.]+ %", warned)


def test_a_motor_toml_gives_the_rest_and_set_goes_first(tmp_path: Path, importer: Importer) -> None:
    path = written(tmp_path / "map.csv", HEADER, *HALF, *psi(*HALF), torque(*HALF))
    wanted = ("machine.pole_pairs=4", 'machine.name="other one"', "machine.torque_max_Nm=100")
    _, motor = importer(path, given=wanted, motor=HSM1 / "motor.toml")
    machine = motor.config.machine
    assert (machine.name, machine.torque_max_Nm, machine.speed_max_rpm) == ("other one", 100.0, 10000.0)
    assert machine.flux_map == "flux_map.csv" and motor.config.magnet.i_d_demag_A == 600.0


BAD = [
    ((), [], "map.csv: missing for motor.toml: machine.pole_pairs, machine.r_ohm, machine.speed_max_rpm, "
             "machine.inertia_kgm2, inverter.vdc_V, inverter.pwm_hz; give them with --set"),
    ((*SETTINGS, "machine.r_ohms=1"), [], "--set: machine.r_ohms: unknown key, allowed: name, pole_pairs"),
    ((*SETTINGS, "machine.r_ohm=500"), [], "--set: machine.r_ohm = 500 Ω, allowed: "),
    ((*SETTINGS, "machine.ld_H=1e-3"), [], "--set machine.ld_H: has no effect, the imported map gives the flux"),
    ((*SETTINGS, "pole_pairs=4"), [], "--set 'pole_pairs=4': allowed: SECTION.KEY=VALUE"),
    ((*SETTINGS, "machine.name=x y"), [], "--set 'machine.name=x y': not a TOML value"),
    ((*SETTINGS, "machine.i_max_A=600"), [], "% of the circle of machine.i_max_A = 600 A, allowed: up to 50 %"),
    ((*SETTINGS, "machine.torque_max_Nm=900"), [], "machine.torque_max_Nm = 900 N·m, allowed: up to"),
    (SETTINGS, ["--axes", "synrm"], "psi_q = "),
    (SETTINGS, ["--angle-from", "d"], "--angle-from: has no effect on points given by i_d and i_q"),
    (SETTINGS, ["--rows", "i_d"], "--rows: has no effect with --format csv"),
    (SETTINGS, ["--iron-loss-column", "loss=x"], "--iron-loss-column: has no effect without --iron-loss"),
    (SETTINGS, ["--flux", "rms"], "torque is 0.7071 times 1.5 p (psi_d i_q - psi_q i_d)"),
    ((*SETTINGS, "machine.iron_loss_eddy=1"), ["--iron-loss-point", "50@3000"],
     "--set machine.iron_loss_eddy: has no effect"),
]  # fmt: skip


@pytest.mark.parametrize(("sets", "more", "words"), BAD, ids=lambda value: None)
def test_what_cannot_be_imported_leaves_nothing(
    tmp_path: Path, sets: tuple[str, ...], more: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from fluxtrue_tools import cli

    path = written(tmp_path / "map.csv", HEADER, *HALF, *psi(*HALF), torque(*HALF))
    arguments = ["motor", "import", str(path), "--format", "csv", "--out", str(tmp_path / "out"), *more]
    code = cli.run([*arguments, *(part for text in sets for part in ("--set", text))])
    said = capsys.readouterr().err
    assert code == 2 and said.startswith("error: ") and said.count("\n") == 1 and words in said, said
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.csv"]


def test_a_unit_off_by_a_thousand_is_named(tmp_path: Path, importer: Importer) -> None:
    psi_d, psi_q = psi(*HALF)
    path = written(tmp_path / "map.csv", HEADER[:-7], *HALF, 1e3 * psi_d, 1e3 * psi_q)
    with pytest.raises(
        FluxtrueError, match=r"/map.csv: flux_map.csv: psi_d_Vs = 90.* V·s at no current looks like mV·s"
    ):
        importer(path)


def test_a_format_that_fixes_its_units_refuses_others(tmp_path: Path) -> None:
    np.savez(tmp_path / "map.npz", i_s=HALF[0] + 1j * HALF[1], psi_s=psi(*HALF)[0] + 1j * psi(*HALF)[1])
    options = ("--format", "motulator", "--current", "rms", "--out", tmp_path / "out")
    done = command("import", tmp_path / "map.npz", *options, *given())
    assert (
        done.returncode == 2 and "--current: has no effect with --format motulator, which fixes it: peak" in done.stderr
    )
    assert not (tmp_path / "out").exists()
