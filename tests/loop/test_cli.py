# SPDX-License-Identifier: Apache-2.0
"""`fluxtrue sim` as a user calls it: files, messages, exit codes, the shipped scenarios."""

import csv
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.run import simulate
from fluxtrue_tools.sim.scenario import Window, read

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "docs" / "howto" / "scenarios"
GOOD = 'motor = "hsm1"\nduration_s = 0.4\n[profile]\ntorque_Nm = 40\nspeed_rpm = 1000\n'


def sim(*arguments: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fluxtrue_tools", "sim", *map(str, arguments)]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=environment, check=False)


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "run.toml"
    path.write_text(GOOD)
    return path


def test_a_run_writes_csv_json_and_plot_that_agree(tmp_path: Path, scenario: Path) -> None:
    out, summary, plot = (tmp_path / name for name in ("run.csv", "run.json", "run.png"))
    result = sim(scenario, "--out", out, "--json", summary, "--plot", plot)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    rows = list(csv.DictReader(out.open()))
    assert len(rows) == 400
    assert float(rows[-1]["time_s"]) == pytest.approx(0.4)
    data = json.loads(summary.read_text())
    mean = sum(float(row["true_torque_Nm"]) for row in rows[100:]) / 300
    assert data["mean"]["true_torque_Nm"] == pytest.approx(mean, rel=1e-5)
    assert data["torque_error_percent"] == pytest.approx(100 * (mean / 40 - 1), abs=1e-3)
    assert data["fault_word"] == 0
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert "shaft torque" in result.stdout
    # No other file is written.
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.csv", "run.json", "run.png", "run.toml"]


@pytest.mark.parametrize("suffix", [".svg", ".pdf"])
def test_a_plot_takes_its_format_from_its_name(tmp_path: Path, scenario: Path, suffix: str) -> None:
    plot = tmp_path / f"run{suffix}"
    assert sim(scenario, "--plot", plot).returncode == 0
    assert plot.stat().st_size > 1000


@pytest.mark.parametrize(
    ("text", "arguments", "message"),
    [
        (GOOD, ["--plot", "run.gif"], "allowed: a file ending in .png, .svg, .pdf"),
        (GOOD, ["--json", "/dev/null"], "/dev/null: is a device or a pipe, allowed: a file name"),
        (GOOD, ["--json", "./out.csv"], "out.csv: given twice"),
        (GOOD, ["--motor", "a;b"], "--motor = 'a;b', allowed: hsm1, paper, or a folder whose path has none of ;"),
        (GOOD, ["--out", "missing/run.csv"], "missing/run.csv: cannot be written"),
        (GOOD, ["--motor", "hsm2"], "--motor = 'hsm2': neither a folder with a motor.toml nor one of hsm1, paper"),
        (
            GOOD,
            ["--motor", "bad.toml"],
            "--motor = 'bad.toml': neither a folder with a motor.toml nor one of hsm1, paper",
        ),
        (GOOD, ["--build-dir", "empty"], "libfluxtrue_sim.so is missing: cmake --build"),
        (GOOD, ["--speed", "3"], "No such option"),
        (GOOD + "[plant]\nvdc = 3", [], "plant.vdc: unknown key"),
        (GOOD + "[controller]\nenabel = true", [], "enabel = 1: no such name, allowed: enable"),
        (GOOD.replace("0.4", "-1"), [], "duration_s = -1"),
    ],
)
def test_bad_input_ends_in_one_line_exit_2_and_no_file(
    tmp_path: Path, text: str, arguments: list[str], message: str
) -> None:
    (tmp_path / "bad.toml").write_text(text)
    (tmp_path / "empty").mkdir()
    result = sim("bad.toml", "--out", "out.csv", "--json", "out.json", *arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert result.stdout == ""
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.toml", "empty"]


@pytest.mark.parametrize("option", ["--out", "--json", "--plot"])
@pytest.mark.parametrize("link", [None, "symlink_to", "hardlink_to"])
def test_no_output_overwrites_the_scenario(tmp_path: Path, scenario: Path, option: str, link: str | None) -> None:
    name = "run.toml" if option != "--plot" else "run.png"
    output = scenario
    if link is not None or option == "--plot":
        output = tmp_path / f"link-{name}"
        getattr(output, link or "symlink_to")(scenario)
    result = sim(scenario, option, output)
    assert result.returncode == 2
    assert result.stderr == f"error: {option} {output}: would overwrite input {scenario}, allowed: another name\n"
    assert scenario.read_text() == GOOD


def test_no_output_overwrites_the_data_of_the_motor(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    shutil.copytree(ROOT / "firmware" / "motors" / "hsm1", folder)
    (tmp_path / "run.toml").write_text(GOOD.replace("hsm1", "mine"))
    for name in ("motor.toml", "flux_map.csv"):
        before = (folder / name).read_bytes()
        result = sim("run.toml", "--out", f"mine/{name}", cwd=tmp_path)
        assert result.returncode == 2
        assert "would overwrite input" in result.stderr
        assert (folder / name).read_bytes() == before


def test_a_motor_that_is_refused_leaves_no_build_folder(tmp_path: Path) -> None:
    folder = tmp_path / f"refused-{tmp_path.name}"
    folder.mkdir()
    (folder / "motor.toml").write_text("[machine]\nname = 'refused'\n")
    (tmp_path / "run.toml").write_text(GOOD)
    result = sim("run.toml", "--motor", folder, cwd=tmp_path)
    assert result.returncode == 2
    assert str(folder / "motor.toml") in result.stderr
    assert not list((ROOT / "build" / "sim").glob(f"{folder.name}-*"))


def test_a_motor_that_is_not_there_is_named_with_file_and_key(tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_text(GOOD.replace("hsm1", "hsm2"))
    result = sim("run.toml", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("error: run.toml: motor = 'hsm2': neither a folder with a motor.toml nor one of ")


def test_a_missing_scenario_is_named() -> None:
    result = sim("nowhere.toml")
    assert result.returncode == 2
    assert result.stderr == "error: nowhere.toml: cannot be read (No such file or directory)\n"


def test_a_file_that_is_not_utf_8_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe\x00")
    result = sim("bad.toml", cwd=tmp_path)
    assert result.returncode == 2
    assert "not UTF-8" in result.stderr


def test_an_older_file_survives_a_failed_run(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(GOOD + "[controller]\nobserver_m = 99")
    (tmp_path / "out.csv").write_text("an older result")
    assert sim("bad.toml", "--out", "out.csv", cwd=tmp_path).returncode == 2
    assert (tmp_path / "out.csv").read_text() == "an older result"


SHIPPED = sorted(SCENARIOS.glob("*.toml"))


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_a_shipped_scenario_gives_torque_and_speed_as_shares(path: Path, paper: Motor, hsm1: Motor) -> None:
    """Motors other than the scenario's own use its values, too."""
    profile = tomllib.loads(path.read_text(encoding="utf-8"))["profile"]
    assert "torque_share" in profile and not {"torque_Nm", "speed_rpm", "load_Nm"} & set(profile)
    short = read(path).model_copy(update={"duration_s": 0.1, "event": (), "expect_fault": None, "window": Window()})
    for motor in (paper, hsm1):
        assert simulate(short, motor, where=path.name).fault_word == 0


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_a_shipped_scenario_runs_as_its_comment_says(path: Path, paper: Motor, hsm1: Motor) -> None:
    scenario = read(path)
    run = simulate(scenario, {"paper": paper, "hsm1": hsm1}[scenario.motor], where=path.name)
    assert run.unexpected() is None
    if path.stem == "sensor-fault":
        assert run.fault_word != 0
        assert run["run_state"][-1] == 2.0
        return
    assert run.fault_word == 0
    error = run.torque_error_percent
    # Steady driving with weak magnets: 1 % includes the lag of the torque behind the slow profiles.
    assert error is not None and abs(error) <= 1.0
