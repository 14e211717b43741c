# SPDX-License-Identifier: Apache-2.0
"""The checker of figures finds copies that differ, and data that differ from their results."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "figures.py"

DATA = """
[campaign]
rms = { text = "0.41 %", path = ["controllers", "controller=robust", "bands", "low", "rms"] }
ratio = { text = "1.5", path = ["controllers", "controller=robust", "ratio", "low"] }

[performance]
flash = { text = "61 KiB", path = ["image", "flash"], scale = 1024 }

[code]
precharge = { text = "2 s", define = ["firmware/ecu/supervisor.c", "PRECHARGE_MS"], scale = 1000 }
time_out = { text = "30 ms", match = ["firmware/comm/bus.dbc", 'BO_ 272 (\\d+);'] }
"""
DBC = 'BA_ "TimeOut" BO_ 272 30;\nBA_ "TimeOut" BO_ 273 300;\n'
CODE = "#define PRECHARGE_MS 2000U /* least time */\n"
PAGE = """# Page

An error of <!-- figure: rms -->0.41 %, that is <!-- figure: ratio -->1.5 times the bound.

| flash | <!-- figure: flash -->61 KiB |
| precharge | <!-- figure: precharge -->2 s |
| time-out | <!-- figure: time_out -->30 ms |
"""
SUMMARY = {
    "controllers": [
        {"controller": "tables", "bands": {"low": {"rms": 7.0}}, "ratio": {"low": None}},
        {"controller": "robust", "bands": {"low": {"rms": 0.4098}}, "ratio": {"low": 1.4713}},
    ]
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """Two pages and the results, in agreement."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "firmware/ecu").mkdir(parents=True)
    (tmp_path / "firmware/ecu/supervisor.c").write_text(CODE)
    (tmp_path / "firmware/comm").mkdir()
    (tmp_path / "firmware/comm/bus.dbc").write_text(DBC)
    (tmp_path / "docs/figures.toml").write_text(DATA)
    (tmp_path / "docs/page.md").write_text(PAGE)
    (tmp_path / "README.md").write_text("The error is **<!-- figure: rms -->0.41 %**.\n")
    (tmp_path / "docs/performance.json").write_text(json.dumps({"image": {"flash": 62688}}))
    (tmp_path / "summary.json").write_text(json.dumps(SUMMARY))
    return tmp_path


def check(root: Path, *arguments: str) -> tuple[int, list[str]]:
    """Exit code and messages."""
    command = [sys.executable, str(SCRIPT), "--root", str(root), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_pages_and_results_in_agreement_pass(tree: Path) -> None:
    assert check(tree) == (0, [])
    assert check(tree, "--campaign", str(tree / "summary.json")) == (0, [])


@pytest.mark.parametrize(
    ("page", "old", "new", "message"),
    [
        ("docs/page.md", "-->0.41 %", "-->0.61 %", "docs/page.md:3: figure 'rms' reads '0.61 %"),
        ("docs/page.md", "-->1.5 times", "-->1.50 times", "docs/page.md:3: figure 'ratio' reads"),
        ("docs/page.md", "-->1.5 times", "-->1.55 times", "docs/page.md:3: figure 'ratio' reads"),
        ("docs/page.md", "figure: flash", "figure: flush", "docs/page.md:5: figure 'flush' is not in"),
        ("README.md", "0.41", "0.4", "README.md:1: figure 'rms' reads '0.4 %**."),
        ("docs/figures.toml", "0.41 %", "0.42 %", "README.md:1: figure 'rms' reads"),
    ],
)
def test_a_planted_copy_that_differs_is_found(tree: Path, page: str, old: str, new: str, message: str) -> None:
    path = tree / page
    path.write_text(path.read_text().replace(old, new))
    code, messages = check(tree)
    assert code == 1
    assert messages[0].startswith(message)


def test_a_figure_that_no_page_states_is_found(tree: Path) -> None:
    page = tree / "docs/page.md"
    page.write_text(page.read_text().replace("<!-- figure: ratio -->", ""))
    assert check(tree) == (1, ["docs/figures.toml:4: no page states figure 'ratio'"])


def test_performance_that_has_changed_is_found(tree: Path) -> None:
    (tree / "docs/performance.json").write_text(json.dumps({"image": {"flash": 63700}}))
    assert check(tree) == (1, ["docs/figures.toml:7: figure 'flash' reads '61 KiB', performance.json gives 62"])


def test_a_place_of_a_spread_is_found_and_one_beyond_its_end_is_not(tree: Path) -> None:
    (tree / "docs/performance.json").write_text(json.dumps({"image": {"flash": [1, 62688, 3]}}))
    data = tree / "docs/figures.toml"
    text = data.read_text()
    data.write_text(text.replace('"image", "flash"', '"image", "flash", "1"'))
    assert check(tree) == (0, [])
    data.write_text(text.replace('"image", "flash"', '"image", "flash", "0"'))
    assert check(tree) == (1, ["docs/figures.toml:7: figure 'flash' reads '61 KiB', performance.json gives 0"])
    data.write_text(text.replace('"image", "flash"', '"image", "flash", "3"'))
    assert check(tree)[1][0].endswith("figure 'flash': nothing at ['image', 'flash', '3']")


def test_a_constant_that_has_changed_or_gone_is_found(tree: Path) -> None:
    source = tree / "firmware/ecu/supervisor.c"
    source.write_text(CODE.replace("2000U", "3000U"))
    message = "docs/figures.toml:10: figure 'precharge' reads '2 s', firmware/ecu/supervisor.c gives 3"
    assert check(tree) == (1, [message])
    source.write_text(CODE.replace("PRECHARGE_MS", "PRECHARGE_S"))
    code, messages = check(tree)
    assert code == 1
    assert "figure 'precharge': nothing at" in messages[0]


def test_a_number_that_a_pattern_finds_changed_twice_or_not_at_all_is_found(tree: Path) -> None:
    source = tree / "firmware/comm/bus.dbc"
    line = "docs/figures.toml:11: figure 'time_out'"
    source.write_text(DBC.replace("272 30", "272 20"))
    assert check(tree) == (1, [f"{line} reads '30 ms', firmware/comm/bus.dbc gives 20"])
    for text in (DBC.replace("272", "274"), DBC + DBC):
        source.write_text(text)
        assert check(tree) == (1, [f"{line}: nothing at ['firmware/comm/bus.dbc', 'BO_ 272 (\\\\d+);']"])


def test_a_campaign_with_another_result_is_found(tree: Path) -> None:
    changed = json.loads(json.dumps(SUMMARY))
    changed["controllers"][1]["ratio"]["low"] = 2.21
    (tree / "summary.json").write_text(json.dumps(changed))
    code, messages = check(tree, "--campaign", str(tree / "summary.json"))
    assert code == 1
    assert messages == ["docs/figures.toml:4: figure 'ratio' reads '1.5', summary.json gives 2.2"]


def test_a_path_that_leads_nowhere_is_found(tree: Path) -> None:
    (tree / "docs/performance.json").write_text(json.dumps({"image": {}}))
    code, messages = check(tree)
    assert code == 1
    assert "nothing at ['image', 'flash']" in messages[0]
