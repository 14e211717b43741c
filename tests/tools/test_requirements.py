# SPDX-License-Identifier: Apache-2.0
"""The checker of the safety requirements finds planted errors."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "requirements.py"
SOURCE = """[[requirement]]
id = "SR-001"
goal = "G1"
text = "An over-current trips"
code = ["firmware/safety/monitor.c"]
tests = ["tests/unit/safety/test_monitor.c", "fmea:current-*"]

[[requirement]]
id = "SR-002"
goal = "G2"
text = "The contactor stays closed"
code = ["firmware/*/monitor.c"]
tests = ["tests/bus/test_high_speed.py::test_it_stays_closed"]
"""
FAULTS = """id,status,result
current-a,met,"fault 1.5 ms, torque safe 12 ms, 300 A, 350 V"
current-b,open,"fault 2.5 ms, torque safe 9 ms, 300 A, 350 V; 1 of 4 runs not met"
"""
UNIT = "static void test_one(void)\n{\n}\n\nvoid test_two(void)\n{\n}\n"
BUS = "def test_it_stays_closed() -> None: ...\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for path, text in {
        "docs/safety/requirements.toml": SOURCE, "docs/safety/fmea.csv": FAULTS, "firmware/safety/monitor.c": "",
        "tests/unit/safety/test_monitor.c": UNIT, "tests/bus/test_high_speed.py": BUS,
    }.items():  # fmt: skip
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")
    return tmp_path


def check(tree: Path, *arguments: str) -> tuple[int, str]:
    command = [sys.executable, str(SCRIPT), "--root", str(tree), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_complete_requirements_pass_and_make_the_matrix(tree: Path) -> None:
    assert check(tree, "--write") == (0, "requirements: ok\n")
    page = (tree / "docs/safety/matrix.md").read_text(encoding="utf-8")
    assert "| SR-001 | G1 | An over-current trips | [monitor.c](../../firmware/safety/monitor.c) |" in page
    assert "| fault 2.5 ms, torque safe 12 ms, **1 of 2 open** |" in page


def test_a_matrix_of_other_requirements_is_found(tree: Path) -> None:
    check(tree, "--write")
    source = tree / "docs/safety/requirements.toml"
    source.write_text(SOURCE.replace("trips", "stops"), encoding="utf-8")
    assert "matrix.md:1: not made from the requirements" in check(tree)[1]


@pytest.mark.parametrize(
    ("path", "line", "instead", "message"),
    [
        ("docs/safety/requirements.toml", 'tests = ["tests/unit/safety/test_monitor.c", "fmea:current-*"]',
         "tests = []", "requirements.toml:1: SR-001 names no test"),
        ("docs/safety/requirements.toml", 'code = ["firmware/safety/monitor.c"]', "code = []",
         "requirements.toml:1: SR-001 names no code"),
        ("docs/safety/requirements.toml", "firmware/safety/monitor.c", "firmware/safety/gone.c",
         "SR-001: there is no firmware/safety/gone.c"),
        ("docs/safety/requirements.toml", "test_it_stays_closed", "test_it_opens",
         "requirements.toml:8: SR-002: tests/bus/test_high_speed.py has no test test_it_opens"),
        ("docs/safety/requirements.toml", "fmea:current-*", "fmea:angle-*", "no line of docs/safety/fmea.csv fits"),
        ("docs/safety/requirements.toml", "SR-002", "SR-001", "SR-001 follows SR-001"),
        ("docs/safety/requirements.toml", 'goal = "G2"', "", "requirements.toml:8: a requirement has code, goal, id"),
        ("docs/safety/requirements.toml", "unit/safety/test_monitor.c", "unit/safety/test_monitor.c::test_one",
         "test_monitor.c:1: test_two belongs to no requirement"),
        ("tests/bus/test_high_speed.py", BUS, BUS + "def test_more() -> None: ...\n",
         "test_high_speed.py:1: test_more belongs to no requirement"),
        ("docs/safety/fmea.csv", "current-b", "voltage", "fmea.csv:1: the line voltage belongs to no requirement"),
    ],
)  # fmt: skip
def test_a_planted_error_is_found(tree: Path, path: str, line: str, instead: str, message: str) -> None:
    changed = tree / path
    text = changed.read_text(encoding="utf-8")
    assert line in text
    changed.write_text(text.replace(line, instead, 1), encoding="utf-8")
    code, said = check(tree, "--write")
    assert code == 1
    assert message in said
