# SPDX-License-Identifier: Apache-2.0
"""Every file with tests is run by a test of the build."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterable
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
BUILD = Path(os.environ["FLUXTRUE_BUILD_DIR"])


def _given_to_pytest() -> list[Path]:
    """The files and folders that ctest gives to pytest."""
    command = ["ctest", "--test-dir", str(BUILD), "--show-only=json-v1"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    commands = [test.get("command", []) for test in json.loads(done.stdout)["tests"]]
    return [Path(command[-1]) for command in commands if "pytest" in command]


def _missing(files: Iterable[Path], given: Iterable[Path]) -> list[Path]:
    """The files that are neither given themselves nor in a folder that is."""
    known = set(given)
    return [file for file in files if known.isdisjoint([file, *file.parents])]


def test_every_file_of_tests_in_python_is_run() -> None:
    files = sorted(TESTS.rglob("test_*.py"))
    assert len(files) > 100
    assert not _missing(files, _given_to_pytest())


def test_every_file_of_tests_in_c_is_compiled() -> None:
    commands = json.loads((BUILD / "compile_commands.json").read_text(encoding="utf-8"))
    files = sorted(TESTS.rglob("test_*.c"))
    assert len(files) > 50
    assert not _missing(files, [Path(command["file"]) for command in commands])


def test_a_file_that_is_not_named_is_found() -> None:
    known, left_out = TESTS / "loop" / "test_known.py", TESTS / "loop" / "test_left_out.py"
    assert _missing([known, left_out], [known, TESTS / "hil"]) == [left_out]
    assert not _missing([known, left_out], [TESTS / "loop"])
