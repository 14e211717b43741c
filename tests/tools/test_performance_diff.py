# SPDX-License-Identifier: Apache-2.0
"""The difference of two performance.json files: one row for each change, and no other row."""

import copy
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools" / "performance_diff.py"
FIGURES: dict[str, Any] = {
    "compiler": "some gcc 12",
    "drives": {"robust": {"fast ISR": {"instructions": [339, 358.7, 543], "runs": 4750}}},
    "image": {"flash": 62688, "RAM": 11136},
    "stack": {"levels": [{"name": "task", "bytes": 800}, {"name": "fast", "bytes": 400}]},
}


def run(*arguments: object) -> tuple[int, str, str]:
    """Exit code, output, error output."""
    done = subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


def compared(folder: Path, before: Any, after: Any) -> list[str]:
    """The output's lines for two sets of figures."""
    for name, figures in (("before.json", before), ("after.json", after)):
        (folder / name).write_text(json.dumps(figures), encoding="utf-8")
    code, output, _ = run(folder / "before.json", folder / "after.json")
    assert code == 0
    return output.splitlines()


def test_equal_figures_have_no_table(tmp_path: Path) -> None:
    assert compared(tmp_path, FIGURES, FIGURES) == ["No figure of `docs/performance.json` has changed."]


def test_each_kind_of_change_is_a_row_and_what_stayed_is_none(tmp_path: Path) -> None:
    after = copy.deepcopy(FIGURES)
    after["compiler"] = "a|b"
    after["drives"]["robust"]["fast ISR"]["instructions"] = [339, 360.2, 541]
    after["image"] = {"flash": 63000, "tables": 8264}
    after["stack"]["levels"][1]["bytes"] = 0
    assert compared(tmp_path, FIGURES, after) == [
        "6 of 9 figures of `docs/performance.json` have changed.",
        "",
        "| figure | before | after | change |",
        "|---|---:|---:|---:|",
        "| compiler | some gcc 12 | a\\|b |  |",
        "| drives · robust · fast ISR · instructions | 339 / 358.7 / 543 | 339 / 360.2 / 541 | +0 / +1.5 / -2 |",
        "| image · flash | 62688 | 63000 | +312 (+0.5 %) |",
        "| image · RAM | 11136 | – | gone |",
        "| stack · levels · 1 · bytes | 400 | 0 | -400 (-100.0 %) |",
        "| image · tables | – | 8264 | new |",
    ]


def test_a_figure_that_was_zero_has_no_percentage(tmp_path: Path) -> None:
    assert compared(tmp_path, {"variables": 0}, {"variables": 4})[-1] == "| variables | 0 | 4 | +4 |"


def test_the_committed_figures_can_be_read() -> None:
    baseline = ROOT / "docs" / "performance.json"
    assert run(baseline, baseline)[1].startswith("No figure")


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with the figures in one commit, and other figures in its working tree."""
    page = tmp_path / "docs" / "performance.json"
    page.parent.mkdir()
    page.write_text(json.dumps(FIGURES), encoding="utf-8")
    who = ("-c", "user.name=t", "-c", "user.email=t@example.org")
    for command in (["init", "-q", "-b", "main"], ["add", "-A"], [*who, "commit", "-qm", "Begin"]):
        subprocess.run(["git", "-C", tmp_path, *command], check=True)
    page.write_text(json.dumps({**FIGURES, "image": {"flash": 62689, "RAM": 11136}}), encoding="utf-8")
    return tmp_path


def test_the_tree_is_compared_with_a_commit(repository: Path) -> None:
    code, output, _ = run("--root", repository, "--base", "main")
    assert code == 0
    assert output.splitlines()[4:] == ["| image · flash | 62688 | 62689 | +1 (+0.0 %) |"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "No such file"),
        (b"", "no JSON"),
        (b"{", "no JSON"),
        (b"[1]", "holds no figures"),
        (b"{}", "holds no figures"),
        (b"\xff\xfe", "no text"),
    ],
)
def test_what_holds_no_figures_is_refused_by_name(tmp_path: Path, content: bytes | None, message: str) -> None:
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(json.dumps(FIGURES), encoding="utf-8")
    if content is not None:
        bad.write_bytes(content)
    for files in ((good, bad), (bad, good)):
        code, output, error = run(*files)
        assert (code, output) == (2, "")
        assert error.startswith(f"error: {bad}: ") and message in error
        assert len(error.splitlines()) == 1


@pytest.mark.parametrize("arguments", [(), ("one.json",), ("a", "b", "c"), ("--base", "main", "a.json")])
def test_another_number_of_files_is_refused(arguments: tuple[str, ...]) -> None:
    code, _, error = run(*arguments)
    assert code == 2
    assert "two files or --base wanted" in error


def test_an_unknown_commit_is_refused_by_name(repository: Path) -> None:
    code, _, error = run("--root", repository, "--base", "nowhere")
    assert code == 2
    assert error.startswith("error: --base nowhere: ")
    assert len(error.splitlines()) == 1
