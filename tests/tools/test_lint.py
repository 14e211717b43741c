# SPDX-License-Identifier: Apache-2.0
"""The checker of Python finds planted errors, and reports when it could not run."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "tools" / "checks" / "lint.py"
GOOD = 'def add(a: int, b: int) -> int:\n    """The sum."""\n    return a + b\n'


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small checkout without errors."""
    root = tmp_path / "check out"
    (root / "tools").mkdir(parents=True)
    shutil.copy(ROOT / ".ruff.toml", root)
    (root / "tools" / "add.py").write_text(GOOD, encoding="utf-8")
    return root


def run(root: Path, *arguments: object, python: str = sys.executable) -> tuple[int, list[str]]:
    """Exit code, and the lines of its messages."""
    command = [python, CHECK, "--root", root, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_a_tree_without_errors_passes(tree: Path) -> None:
    assert run(tree) == (0, [])


@pytest.mark.parametrize(
    ("text", "line", "code"),
    [
        (GOOD + "\n\nprint(undefined)\n", 6, "F821"),
        ("import os\n\n\n" + GOOD, 1, "F401"),
        (GOOD + "\n\ndef keep(x: int, seen: list[int] = []) -> None:\n    seen.append(x)\n", 6, "B006"),
        ("import subprocess\n\nsubprocess.run(['true'])\n", 3, "PLW1510"),
    ],
)
def test_a_planted_error_is_found(tree: Path, text: str, line: int, code: str) -> None:
    path = tree / "tools" / "bad.py"
    path.write_text(text, encoding="utf-8")
    for arguments in ((), (path,)):
        status, messages = run(tree, *arguments)
        assert status == 1
        assert [message[: len(f"tools/bad.py:{line}: {code}")] for message in messages] == [
            f"tools/bad.py:{line}: {code}"
        ]
    assert run(tree, tree / "tools" / "add.py") == (0, [])


def test_what_is_built_is_left_alone(tree: Path) -> None:
    (tree / "build").mkdir()
    (tree / "build" / "bad.py").write_text("import os\n", encoding="utf-8")
    assert run(tree) == (0, [])


def test_a_broken_configuration_is_no_pass(tree: Path) -> None:
    (tree / ".ruff.toml").write_text("line-length = 'long'\n", encoding="utf-8")
    status, messages = run(tree)
    assert status == 1
    assert messages[0].startswith("error: ruff failed: ")


def test_messages_in_another_form_are_no_pass(tree: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    program = tmp_path / "venv" / "bin" / "ruff"
    program.write_text("#!/bin/sh\necho something else >&2\nexit 1\n", encoding="utf-8")
    program.chmod(0o755)
    status, messages = run(tree, python=str(program.with_name("python")))
    assert status == 1
    assert messages == ["error: ruff printed what is not understood: something else"]
