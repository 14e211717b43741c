# SPDX-License-Identifier: Apache-2.0
"""The slice of the fault campaign for every test run: a few points of each line of docs/safety/fmea.csv."""

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from fault_command import faults

from fluxtrue_tools.fault_campaign import fmea
from fluxtrue_tools.fault_campaign.fmea import MET, OPEN, PHYSICS

ROOT = Path(__file__).resolve().parents[2]
CAMPAIGN = Path(__file__).with_name("campaign.toml")
TABLE = ROOT / "docs" / "safety" / "fmea.csv"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("faults")
    done = faults(CAMPAIGN, "--slice", "--out", folder)
    print(done.stdout)
    assert done.returncode in (0, 1), done.stderr
    return folder


@pytest.fixture(scope="module")
def summary(out: Path) -> Any:
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def test_the_slice_runs_every_line_of_the_table(out: Path, summary: Any) -> None:
    table = pd.read_parquet(out / "results.parquet")
    assert set(table["row"]) == {row.id for row in fmea.read(TABLE)}
    assert len(table) == summary["runs"]
    assert summary["runs"] >= 300
    assert summary["kinds"] >= 60


def test_every_line_that_says_met_is_met(summary: Any) -> None:
    missed = {s["id"]: s["why"] for s in summary["scores"] if s["status"] == MET and s["found"] != MET}
    assert missed == {}


def test_every_line_that_is_met_by_physics_is_met_and_needs_it_at_its_witness(summary: Any) -> None:
    wrong = {s["id"]: (s["found"], s["why"]) for s in summary["scores"]
             if s["status"] == PHYSICS and s["found"] != PHYSICS}  # fmt: skip
    assert wrong == {}


def test_no_line_says_open_that_has_become_met(summary: Any) -> None:
    """If it fails, `tools/fluxtrue faults tests/fault/campaign.toml --record` writes the new status into the table."""
    assert [s["id"] for s in summary["scores"] if s["status"] == OPEN and s["is_met"]] == []


def test_the_report_prints_what_is_not_met(out: Path, summary: Any) -> None:
    page = (out / "report.html").read_text(encoding="utf-8")
    for score in summary["scores"]:
        assert f"<td>{score['id']}</td>" in page
        assert score["is_met"] or score["worst"] in page


# One fault that the drive detects at once, at one point: the tests below change what the table says about it.
ONE = 'fmea = "fmea.csv"\npoints = [[0.2, 0.5]]\n[[machine]]\nmotor = "hsm1"\ncurrent_A = 600\nvdc_V = 500\n'
DETECTED = (
    "open,sensor,input open,,plant.current_open_a=1,,{reaction},{expected},{detect},,50,,,,60,{status},{witness},,\n"
)


def one(folder: Path, **cells: str) -> Path:
    line = {"reaction": "safe_state", "expected": "over_current", "detect": "5", "status": "met", "witness": ""} | cells
    folder.mkdir(exist_ok=True)
    (folder / "one.toml").write_text(ONE, encoding="utf-8")
    (folder / "fmea.csv").write_text(",".join(fmea.COLUMNS) + "\n" + DETECTED.format(**line), encoding="utf-8")
    return folder / "one.toml"


@pytest.mark.parametrize(
    ("cells", "code", "said"),
    [
        ({}, 0, "2 (100.00 %) as demanded"),
        ({"expected": "over_speed"}, 1, "over_current"),
        ({"detect": "0.05"}, 1, "after 0.1 ms"),
        ({"reaction": "keep", "expected": ""}, 1, "false trip: over_current"),
        ({"status": "open", "witness": "hsm1/0/+"}, 1, "status open is NOT TRUE"),
        ({"status": "open", "expected": "over_speed", "witness": "hsm1/0/-"}, 0, "1 open"),
    ],
)
def test_a_table_that_is_wrong_is_found_out(tmp_path: Path, cells: dict[str, str], code: int, said: str) -> None:
    done = faults(one(tmp_path / "c", **cells), "--out", tmp_path / "out")
    assert done.returncode == code, done.stderr
    assert said in done.stdout


def test_a_campaign_that_was_stopped_goes_on_and_another_table_is_refused(tmp_path: Path) -> None:
    campaign, out = one(tmp_path / "c"), tmp_path / "out"
    assert faults(campaign, "--out", out).returncode == 0
    first = pd.read_parquet(out / "results.parquet")
    stamp = next((out / "cases").glob("case-*")).stat().st_mtime_ns
    assert faults(campaign, "--out", out).returncode == 0
    assert next((out / "cases").glob("case-*")).stat().st_mtime_ns == stamp
    shutil.rmtree(out / "cases")
    assert faults(campaign, "--out", out).returncode == 0
    pd.testing.assert_frame_equal(pd.read_parquet(out / "results.parquet"), first)
    done = faults(one(tmp_path / "c", detect="6"), "--out", out)
    assert done.returncode == 2
    assert "another campaign file or table of faults" in done.stderr


def test_what_was_found_is_recorded_and_is_then_true(tmp_path: Path) -> None:
    campaign = one(tmp_path / "c", expected="over_speed")
    assert faults(campaign, "--out", tmp_path / "out", "--record").returncode == 0
    (row,) = fmea.read(tmp_path / "c" / "fmea.csv")
    assert (row.status, row.witness) == (OPEN, "hsm1/0/+")
    assert "over_current" in row.text["result"]
    assert faults(campaign, "--out", tmp_path / "slice", "--slice").returncode == 0


def test_only_the_lines_that_fit_are_run_and_recorded(tmp_path: Path) -> None:
    campaign = one(tmp_path / "c", expected="over_speed")
    table = tmp_path / "c" / "fmea.csv"
    line = DETECTED.format(reaction="safe_state", expected="over_speed", detect="5", status="met", witness="")
    table.write_text(table.read_text(encoding="utf-8") + "b-" + line, encoding="utf-8")
    assert faults(campaign, "--out", tmp_path / "out", "--record", "--lines", "b-*").returncode == 0
    assert [row.status for row in fmea.read(table)] == [MET, OPEN]
    assert faults(campaign, "--out", tmp_path / "both", "--lines", "none,b-*,op?n").returncode == 1  # "met" is not true
    assert len(pd.read_parquet(tmp_path / "both" / "results.parquet")) == 4
    done = faults(campaign, "--out", tmp_path / "none", "--lines", "angle-*")
    assert done.returncode == 2
    assert "--lines angle-*: no line of" in done.stderr


def test_one_line_shows_its_runs(tmp_path: Path) -> None:
    done = faults(one(tmp_path / "c"), "--line", "open", "--run", "hsm1/0/-")
    assert done.returncode == 0, done.stderr
    assert "hsm1/0/-" in done.stdout
    assert "hsm1/0/+" not in done.stdout


# `paper` at 900 rpm with a shorted switch: even the symmetrical short circuit on its side brakes with 54 N·m. The line
# may impose a state of the bridge with the fault, as a drive with the wrong reaction would choose it.
SHORTED = 'fmea = "fmea.csv"\nsigns = [1]\npoints = [[0.15, 1.0]]\n[[machine]]\nmotor = "paper"\ncurrent_A = 1000\n'
LINE = "s,inverter,shorted,,plant.switch_shorted_upper_a=1{more},,safe_state,any,10,,150,,,,,{status},,,\n"


def shorted(folder: Path, status: str, more: str = "") -> Path:
    folder.mkdir()
    (folder / "s.toml").write_text(SHORTED + "vdc_V = 500\n", encoding="utf-8")
    (folder / "fmea.csv").write_text(",".join(fmea.COLUMNS) + "\n" + LINE.format(status=status, more=more), "utf-8")
    return folder / "s.toml"


def test_the_drive_is_as_good_as_the_best_state_with_a_shorted_switch_and_a_wrong_reaction_is_not(
    tmp_path: Path,
) -> None:
    done = faults(shorted(tmp_path / "right", PHYSICS), "--out", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 (100.00 %) as demanded, of these 1 beyond a limit and as good as physics allows" in done.stdout
    (run,) = pd.read_parquet(tmp_path / "out" / "results.parquet").to_dict("records")
    assert run["reference"] == "short circuit above"
    assert run["after_Nm"] <= 1.1 * run["reference_upper_Nm"]
    assert run["reference_off_Nm"] > 2.0 * run["reference_upper_Nm"]
    done = faults(shorted(tmp_path / "wrong", OPEN, ";plant.imposed_bridge=1"), "--out", tmp_path / "out-wrong")
    assert done.returncode == 0, done.stdout + done.stderr
    (run,) = pd.read_parquet(tmp_path / "out-wrong" / "results.parquet").to_dict("records")
    assert (run["verdict"], run["reference"]) == (OPEN, "short circuit above")
    assert run["after_Nm"] > 2.0 * run["reference_upper_Nm"]


# `hsm1` at its largest speed: the diodes let it brake. A short circuit would brake less, but drivers that block prevent
# it.
BLOCKED = 'fmea = "fmea.csv"\nsigns = [1]\npoints = [[1.0, 0.0]]\n[[machine]]\nmotor = "hsm1"\ncurrent_A = 600\n'
BLOCKS = "b,gate driver,reports a fault,,plant.drivers_block=1,,safe_state,gate|ecu_gate,2,,50,,,,,{status},,,\n"


def test_a_state_that_the_fault_makes_impossible_is_no_reference(tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_text(BLOCKED + "vdc_V = 500\n", encoding="utf-8")
    (tmp_path / "fmea.csv").write_text(",".join(fmea.COLUMNS) + "\n" + BLOCKS.format(status=PHYSICS), "utf-8")
    done = faults(tmp_path / "b.toml", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stdout + done.stderr
    (run,) = pd.read_parquet(tmp_path / "out" / "results.parquet").to_dict("records")
    assert run["verdict"] == PHYSICS
    assert run["after_Nm"] > 40.0
    assert run["reference_lower_Nm"] == run["reference_upper_Nm"] == run["reference_off_Nm"]
