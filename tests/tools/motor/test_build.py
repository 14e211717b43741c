# SPDX-License-Identifier: Apache-2.0
"""motor build: the files, their atomicity, and the C they contain."""

import ctypes
import html
import json
import shutil
import subprocess

import numpy as np
import pytest
from conftest import MOTORS, ROOT

from fluxtrue_tools.cli import run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.build import build
from fluxtrue_tools.motor.flux_tables import lookup_flux
from fluxtrue_tools.motor.names import PLOTS
from fluxtrue_tools.motor.references import lookup_references

STRICT = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror"]
INCLUDES = [f"-I{ROOT / part}" for part in ("firmware", "tests", "tests/support")]
PLAIN = {"fluxtrue.dbc", "motor_tables.c", "motor_si.c", "motor.json", "report.txt"}


def names(folder):
    return {path.name for path in folder.iterdir()}


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_building_twice_gives_the_same_bytes(write, tmp_path):
    motor = write()
    build(motor, tmp_path / "a", report=False)
    build(motor, tmp_path / "b", report=False)
    first = contents(tmp_path / "a")
    assert set(first) == PLAIN
    assert first == contents(tmp_path / "b")
    build(motor, tmp_path / "a", report=False)
    assert contents(tmp_path / "a") == first


def test_the_output_does_not_depend_on_where_the_folders_are(write, tmp_path):
    build(write(), tmp_path / "out", report=False)
    for name, text in contents(tmp_path / "out").items():
        assert str(tmp_path).encode() not in text, name


def test_a_failing_build_leaves_the_old_files_alone(write, tmp_path):
    out = tmp_path / "out"
    build(write(), out, report=False)
    before = contents(out)
    with pytest.raises(FluxtrueError):
        build(write(machine={"torque_max_Nm": 9999.0}), out, report=False)
    assert contents(out) == before


def test_a_failure_while_writing_leaves_the_old_files_and_no_debris(write, tmp_path, monkeypatch):
    out = tmp_path / "out"
    build(write(), out, report=False)
    before = contents(out)

    def fails(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fluxtrue_tools.motor.html.write_report", fails)
    with pytest.raises(FluxtrueError, match="cannot be written .No space left"):
        build(write(machine={"inertia_kgm2": 1.0}), out, report=True)
    assert contents(out) == before


def test_an_empty_name_for_the_output_folder_writes_nothing_anywhere(cli, write, tmp_path, monkeypatch):
    before = sorted((tmp_path / "bench").iterdir() if (tmp_path / "bench").exists() else [])
    result = cli("build", write(), "--out", "")
    assert result.returncode == 2
    assert result.stderr == "error: --out '': empty, allowed: the name of a folder\n"
    assert sorted((tmp_path / "bench").iterdir()) == [*before, tmp_path / "bench" / "motor.toml"]
    assert not (ROOT / "motor.json").exists()


def test_a_motor_is_not_built_into_its_own_folder(cli, write):
    folder = write()
    result = cli("build", folder, "--out", folder)
    assert result.returncode == 2 and "would overwrite input" in result.stderr
    assert [path.name for path in folder.iterdir()] == ["motor.toml"]


def test_a_file_in_place_of_the_output_folder_is_said(write, tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(FluxtrueError, match="out: is a file, allowed: a folder"):
        build(write(), tmp_path / "out", report=False)
    assert (tmp_path / "out").read_text() == "mine"


def test_the_report_has_its_plots_and_a_build_without_it_removes_the_old_ones(write, tmp_path):
    out = tmp_path / "out"
    build(write(), out, report=True)
    assert len(PLOTS) == 9
    drawn = {*PLOTS} - {"plot_inductances.png"}  # two constants
    assert names(out) == PLAIN | drawn | {"report.html"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "measured by injection" in page and "not measured" not in page
    assert (out / "report.txt").read_text(encoding="utf-8") in html.unescape(page)
    for plot in drawn:
        assert f'src="{plot}"' in page
        assert (out / plot).read_bytes().startswith(b"\x89PNG")
    (out / "plot_of_the_user.png").write_bytes(b"")
    build(write(), out, report=False)
    assert names(out) == PLAIN | {"plot_of_the_user.png"}


@pytest.mark.parametrize(("error", "why"), [
    (FluxtrueError("cc: not found"), "cc: not found"),
    (FileNotFoundError(2, "No such file or directory", "cmake"), "cmake not found: install it or run tools/setup"),
])  # fmt: skip
def test_without_a_simulation_the_report_says_why_and_draws_the_model_only(write, tmp_path, monkeypatch, error, why):
    def fails(*_):
        raise error

    monkeypatch.setattr("fluxtrue_tools.motor.measured.simulated", fails)
    out = tmp_path / "out"
    out.mkdir()
    (out / "plot_steps.png").write_bytes(b"of an older build")
    build(write(), out, report=True)
    assert not (out / "plot_steps.png").exists() and (out / "plot_current_loop.png").exists()
    text = (out / "report.txt").read_text(encoding="utf-8")
    assert f"not measured       current loop: {why}" in text and "measured by injection" not in text
    assert "plot_steps.png" not in (out / "report.html").read_text(encoding="utf-8")


def test_motor_json_is_complete_and_plain_json(tmp_path):
    build(MOTORS / "hsm1", tmp_path, report=False)
    data = json.loads((tmp_path / "motor.json").read_text(), parse_constant=pytest.fail)
    assert data["machine"]["name"] == "hsm1" and data["machine"]["pole_pairs"] == 3
    assert data["machine"]["psi_f_Vs"] == pytest.approx(0.071658)
    assert data["inverter"]["v_dc_full_scale_V"] == 525.0 and data["inverter"]["min_pulse_s"] == 2e-6
    assert np.array(data["map"]["psi_d_Vs"]).shape == (26, 51)
    assert data["map"]["iq_A"] == [float(q) for q in range(-250, 251, 10)]


def test_check_prints_the_report_and_what_symmetrising_removed(cli):
    result = cli("check", MOTORS / "hsm1")
    assert (result.returncode, result.stderr) == (0, "")
    for words in ("psi_d max 0.919 mV·s", "psi_q max 10.649 mV·s", "error against map", "flash: ", "MTPA"):
        assert words in result.stdout


def test_check_refuses_what_build_refuses_and_both_name_the_file(write, tmp_path, monkeypatch, capsys):
    def unfit(motor):
        raise FluxtrueError("gain = 2 does not fit")

    monkeypatch.setattr("fluxtrue_tools.motor.build.motor_tables_c", unfit)
    folder = write()
    for arguments in (["check"], ["build", "--out", str(tmp_path / "out")]):
        assert run(["motor", *arguments, str(folder)]) == 2
        assert capsys.readouterr().err == f"error: {folder / 'motor.toml'}: gain = 2 does not fit\n"
    assert not (tmp_path / "out").exists()


def test_check_writes_plots_only_when_asked(cli, write, tmp_path):
    result = cli("check", write(), "--plots", tmp_path / "plots")
    assert result.returncode == 0
    assert {path.name for path in (tmp_path / "plots").iterdir()} == set(PLOTS) - {"plot_inductances.png"}


@pytest.mark.parametrize("compiler", ["gcc", "clang", "arm-none-eabi-gcc"])
@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_generated_c_compiles_without_a_warning(tmp_path, compiler, name):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    build(MOTORS / name, tmp_path, report=False)
    files = [tmp_path / "motor_tables.c", tmp_path / "motor_si.c"]
    command = [compiler, *STRICT, *INCLUDES, "-fsyntax-only", *map(str, files)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")


SHIM = r"""
#include "drive/motor.h"
#include "twin/motor_si.h"

int valid(void);
int valid(void)
{
    return flux_table_check(&motor.flux_table) == MOTOR_CHECK_OK &&
           current_reference_check(&motor.current_reference) == MOTOR_CHECK_OK &&
           mrai_check(motor.mrai) == MOTOR_CHECK_OK;
}

void flux(int n, const int16_t *d, const int16_t *q, int16_t *psi_d, int16_t *psi_q);
void flux(int n, const int16_t *d, const int16_t *q, int16_t *psi_d, int16_t *psi_q)
{
    for (int k = 0; k < n; k++) {
        const flux_point_t p = flux_table_step(&motor.flux_table, (dq_q15_t){d[k], q[k]});
        psi_d[k] = p.psi_d;
        psi_q[k] = p.psi_q;
    }
}

void reference(int16_t torque, int16_t v_plan, int16_t omega, int16_t out[2]);
void reference(int16_t torque, int16_t v_plan, int16_t omega, int16_t out[2])
{
    const current_reference_in_t in = {.torque_corrected = torque,
                                       .v_plan = v_plan,
                                       .omega = omega,
                                       .i_d_max = INT16_MAX};
    const current_reference_t r = current_reference_step(&motor.current_reference, &in);
    out[0] = r.i_ref.d;
    out[1] = r.i_ref.q;
}

double first_l_d(void);
double first_l_d(void)
{
    return motor_si.l_d_H[0];
}
"""


@pytest.fixture(scope="module", params=["hsm1", "paper"])
def firmware(request, tmp_path_factory):
    """The generated file and the stages of the firmware in a library; and the motor as loaded by Python."""
    folder = tmp_path_factory.mktemp(request.param)
    motor = build(MOTORS / request.param, folder, report=False)
    (folder / "shim.c").write_text(SHIM, encoding="utf-8")
    control = ROOT / "firmware" / "control"
    stages = ("current/flux_table.c", "torque/current_reference.c", "mrai/mrai.c")
    sources = [
        folder / "shim.c",
        folder / "motor_tables.c",
        folder / "motor_si.c",
        *(control / s for s in stages),
        *sorted((ROOT / "firmware/fx").glob("*.c")),
    ]
    library = folder / "motor.so"
    subprocess.run(
        ["gcc", "-std=c11", "-O1", "-shared", "-fPIC", *INCLUDES, *map(str, sources), "-o", str(library)], check=True
    )
    return ctypes.CDLL(str(library)), motor


def test_the_firmware_accepts_the_generated_data(firmware):
    library, _ = firmware
    assert library.valid() == 1


def test_the_reports_table_error_is_that_of_the_firmwares_own_look_up(firmware):
    """The integer model of the look-up in Python and the C code agree to the last bit, also where they clamp."""
    library, motor = firmware
    rng = np.random.default_rng(3)
    full = motor.config.machine.i_max_A / motor.bases.current_A * 32768
    d = rng.integers(-int(1.2 * full), int(0.1 * full), 20000).astype(np.int16)
    q = rng.integers(-int(1.2 * full), int(1.2 * full), 20000).astype(np.int16)
    psi_d, psi_q = np.zeros_like(d), np.zeros_like(q)
    pointer = [x.ctypes.data_as(ctypes.POINTER(ctypes.c_int16)) for x in (d, q, psi_d, psi_q)]
    library.flux(len(d), *pointer)
    expected = lookup_flux(motor.tables, d.astype(np.int64), q.astype(np.int64))
    assert np.array_equal(psi_d, np.clip(expected[0], -32768, 32767))
    assert np.array_equal(psi_q, np.clip(expected[1], -32768, 32767))


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.95])
def test_the_firmware_reads_the_references_as_the_report_does(firmware, share):
    library, motor = firmware
    torque = int(share * motor.config.machine.torque_max_Nm / motor.bases.torque_Nm * 32768)
    out = (ctypes.c_int16 * 2)()
    library.reference(torque, int(200 / motor.bases.voltage_V * 32768), 300, out)  # slow: all flux available
    expected = lookup_references(motor.references, np.array([torque]), np.array([32767]))
    assert (out[0], out[1]) == (int(expected[0][0]), int(expected[1][0]))
    library.reference(-torque, int(200 / motor.bases.voltage_V * 32768), 300, out)
    assert (out[0], out[1]) == (int(expected[0][0]), -int(expected[1][0]))


def test_the_twins_tables_are_the_unquantised_ones(firmware):
    library, motor = firmware
    library.first_l_d.restype = ctypes.c_double
    assert library.first_l_d() == motor.tables.l_d_H[0, 0]
