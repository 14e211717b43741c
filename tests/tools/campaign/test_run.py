# SPDX-License-Identifier: Apache-2.0
"""Small campaigns from start to end: the results do not depend on workers, interruptions or a cluster."""

import json
import os
import re
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from conftest import SMALL, campaign, command, environment
from progress import polled

from fluxtrue_tools.outputs import PREFIX


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("campaign")
    (path / "small.toml").write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def whole(folder: Path) -> pd.DataFrame:
    """Results of all cases by one worker, which every other way to run them must reproduce."""
    result = campaign("small.toml", "--out", "whole", "--workers", 1, cwd=folder)
    assert result.returncode == 0, result.stderr
    return pd.read_parquet(folder / "whole" / "results.parquet")


def results(folder: Path, out: str) -> pd.DataFrame:
    return pd.read_parquet(folder / out / "results.parquet")


def test_every_case_controller_and_window_is_there_and_finite(whole: pd.DataFrame) -> None:
    assert len(whole) == 4 * 2 * 8
    assert set(whole["controller"]) == {"tables", "paper"}
    assert whole[["torque_Nm", "error_percent", "torque_std_Nm", "estimate_Nm"]].notna().all(axis=None)
    assert whole["finite"].all()
    assert (whole["run_fault_word"] == 0).all()
    # Tables that are wrong by ten percent at most cannot be wrong by fifty.
    tables = whole[whole["controller"] == "tables"]
    assert tables["error_percent"].abs().between(0.001, 50.0).all()
    assert whole[whole["controller"] == "paper"]["bound_percent"].between(0.05, 5.0).all()


def test_all_controllers_meet_the_same_plant_and_windows(whole: pd.DataFrame) -> None:
    plant = [column for column in whole.columns if column.startswith("plant_")]
    assert (whole.groupby("case")[plant].nunique() == 1).all(axis=None)
    window = whole.groupby(["case", "window"])[["speed_rpm", "torque_requested_Nm"]].nunique()
    assert (window == 1).all(axis=None)
    assert whole.groupby("case")["plant_lq_scale"].first().nunique() == 4


def test_two_workers_give_bit_for_bit_what_one_gives(folder: Path, whole: pd.DataFrame) -> None:
    assert campaign("small.toml", "--out", "two", "--workers", 2, cwd=folder).returncode == 0
    pd.testing.assert_frame_equal(results(folder, "two"), whole, check_exact=True)


def test_the_report_and_the_summary_tell_the_same_story(folder: Path, whole: pd.DataFrame) -> None:
    summary = json.loads((folder / "whole" / "summary.json").read_text())
    page = (folder / "whole" / "report.html").read_text()
    assert summary["cases"] == 4
    paper = whole[(whole["controller"] == "paper") & whole["speed_rpm"].abs().between(300, 5000)]
    figures = next(c for c in summary["controllers"] if c["controller"] == "paper")["bands"]["low"]
    assert figures["rms"] == pytest.approx((paper["error_percent"] ** 2).mean() ** 0.5, rel=1e-4)
    assert page.count("data:image/svg+xml;base64,") == 3
    worst = int(whole[whole["controller"] == "paper"].set_index("case")["error_percent"].abs().idxmax())
    assert f"tools/fluxtrue campaign small.toml --case {worst}" in page


def test_the_command_of_a_case_reproduces_its_numbers_and_stores_nothing(folder: Path, whole: pd.DataFrame) -> None:
    before = sorted(path.name for path in folder.iterdir())
    result = campaign("small.toml", "--case", 2, "--plot", "case.png", cwd=folder)
    assert result.returncode == 0, result.stderr
    row = re.compile(r"^(\d+) +-?[\d.]+ +-?[\d.]+ +(-?[\d.e-]+) +(-?[\d.e-]+) ", re.MULTILINE)
    lines = row.findall(result.stdout)
    assert len(lines) == 8
    rows = whole[whole["case"] == 2].set_index(["controller", "window"])["torque_Nm"]
    for window, tables, paper in lines:
        assert tables == f"{rows['tables', int(window)]:.10g}"
        assert paper == f"{rows['paper', int(window)]:.10g}"
    assert (folder / "case.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in folder.iterdir() if p.name != "case.png") == before


def test_a_controller_can_run_in_the_first_cases_only(folder: Path, whole: pd.DataFrame) -> None:
    (folder / "few.toml").write_text(SMALL.replace('name = "paper"', 'name = "paper"\ncases = 1'))
    result = campaign("few.toml", "--out", "few", "--cases", 2, cwd=folder)
    assert result.returncode == 0, result.stderr
    expected = whole[(whole["case"] == 0) | ((whole["case"] == 1) & (whole["controller"] == "tables"))]
    pd.testing.assert_frame_equal(results(folder, "few"), expected.reset_index(drop=True), check_exact=True)
    assert "paper runs on 1 of them only" in (folder / "few" / "report.html").read_text()
    one = campaign("few.toml", "--case", 1, "--plot", "one.png", cwd=folder)
    assert one.returncode == 0, one.stderr
    assert "tables N·m" in one.stdout
    assert "paper" not in one.stdout


def _cases(folder: Path, out: str) -> list[Path]:
    return sorted(folder.glob(f"{out}/cases/case-*.parquet"))


def _end_after_first_case(folder: Path, campaign_file: str, out: str, number: signal.Signals) -> int:
    """The exit code of a campaign with all its workers, which are sent a signal."""
    process = subprocess.Popen(
        command(campaign_file, "--out", out, "--workers", 1), cwd=folder, env=environment(), start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    polled(lambda: process.poll() is not None or bool(_cases(folder, out)))
    os.killpg(process.pid, number)
    return process.wait()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_campaign_that_was_ended_goes_on_where_it_was(
    folder: Path, whole: pd.DataFrame, number: signal.Signals
) -> None:
    """The ended run has far more cases than can finish before the signal; the second run ends two cases after the last.

    Cases that finish at the same time are stored in any order, so the finished ones need not be the first ones.
    """
    (folder / "many.toml").write_text(SMALL.replace("cases = 4", "cases = 100000"))
    out = number.name
    code = _end_after_first_case(folder, "many.toml", out, number)
    assert code == {signal.SIGKILL: -9, signal.SIGTERM: 143, signal.SIGINT: 130}[number]
    done = {path: path.stat().st_mtime_ns for path in _cases(folder, out)}
    assert done
    assert not (folder / out / "results.parquet").exists()
    wanted = max(int(path.stem.removeprefix("case-")) for path in done) + 3
    (folder / out / "cases" / f"{PREFIX}case-{wanted - 1:05d}.x.parquet").write_bytes(b"half a file")
    result = campaign("many.toml", "--out", out, "--cases", wanted, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert {path: path.stat().st_mtime_ns for path in done} == done
    names = sorted(path.name for path in (folder / out / "cases").iterdir())
    assert names == [f"case-{k:05d}.parquet" for k in range(wanted)]
    # A case depends on the seed and its own number, not on how many there are.
    again = results(folder, out)
    both = min(wanted, 4)
    pd.testing.assert_frame_equal(again[again["case"] < both], whole[whole["case"] < both], check_exact=True)


def test_the_first_cases_alone_can_be_run_and_the_rest_later(folder: Path, whole: pd.DataFrame) -> None:
    assert campaign("small.toml", "--out", "parts", "--cases", 1, cwd=folder).returncode == 0
    assert set(results(folder, "parts")["case"]) == {0}
    assert campaign("small.toml", "--out", "parts", "--plot", "parts.png", cwd=folder).returncode == 0
    assert (folder / "parts.png").read_bytes().startswith(b"\x89PNG")
    pd.testing.assert_frame_equal(results(folder, "parts"), whole, check_exact=True)


def test_a_changed_campaign_is_refused_until_it_is_told_to_start_afresh(folder: Path) -> None:
    (folder / "changed.toml").write_text(SMALL)
    assert campaign("changed.toml", "--out", "changed", "--cases", 1, cwd=folder).returncode == 0
    before = results(folder, "changed")
    # A comment changes nothing ...
    (folder / "changed.toml").write_text("# the same\n" + SMALL)
    assert campaign("changed.toml", "--out", "changed", "--cases", 1, cwd=folder).returncode == 0
    # ... a value does.
    (folder / "changed.toml").write_text(SMALL.replace("seed = 7", "seed = 8"))
    refused = campaign("changed.toml", "--out", "changed", "--cases", 1, cwd=folder)
    assert refused.returncode == 2
    assert "were made with another campaign file" in refused.stderr
    assert "--fresh" in refused.stderr
    pd.testing.assert_frame_equal(results(folder, "changed"), before)
    assert campaign("changed.toml", "--out", "changed", "--cases", 1, "--fresh", cwd=folder).returncode == 0
    assert not results(folder, "changed")["plant_lq_scale"].equals(before["plant_lq_scale"])


def test_results_of_another_firmware_are_not_mixed_in(folder: Path) -> None:
    assert campaign("small.toml", "--out", "other", "--cases", 1, cwd=folder).returncode == 0
    manifest = folder / "other" / "campaign.json"
    data = json.loads(manifest.read_text())
    data["firmware or plant"] = "0" * 64
    manifest.write_text(json.dumps(data))
    refused = campaign("small.toml", "--out", "other", "--cases", 1, cwd=folder)
    assert refused.returncode == 2
    assert "were made with another firmware or plant" in refused.stderr


def test_a_missed_bound_fails_the_command_unless_it_is_only_to_report(folder: Path) -> None:
    # No controller reaches a thousandth of a percent.
    text = SMALL + '[check]\ncontrollers = ["paper"]\n[check.limits]\nrms_low = 0.001\n'
    (folder / "strict.toml").write_text(text)
    missed = campaign("strict.toml", "--out", "strict", "--cases", 1, cwd=folder)
    assert missed.returncode == 1
    assert re.search(r"paper +rms, 300 to 5000 rpm .* MISSED", missed.stdout)
    assert campaign("strict.toml", "--out", "strict", "--cases", 1, "--no-check", cwd=folder).returncode == 0


@pytest.fixture
def cluster() -> Iterator[str]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1", protocol="tcp://"
    ) as running:
        yield running.scheduler_address


def test_a_dask_cluster_gives_the_same_numbers(folder: Path, whole: pd.DataFrame, cluster: str) -> None:
    assert cluster.startswith("tcp://127.0.0.1:")
    result = campaign("small.toml", "--out", "dask", "--scheduler", cluster, cwd=folder)
    assert result.returncode == 0, result.stderr
    pd.testing.assert_frame_equal(results(folder, "dask"), whole, check_exact=True)
