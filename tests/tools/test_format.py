# SPDX-License-Identifier: Apache-2.0
"""The checker of the layout finds files that differ from it, repairs them, and leaves the others unchanged."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "tools" / "checks" / "format.py"
GOOD_C = "int add(int a, int b)\n{\n    return a + b;\n}\n"
GOOD_PYTHON = 'def add(a: int, b: int) -> int:\n    """The sum."""\n    return a + b\n'


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small checkout that is laid out as it should be."""
    root = tmp_path / "checkout"
    root.mkdir()
    for name in (".clang-format", ".ruff.toml"):
        shutil.copy(ROOT / name, root)
    write(root, "firmware/fx/add.c", GOOD_C)
    write(root, "tools/add.py", GOOD_PYTHON)
    return root


def write(root: Path, name: str, text: str) -> Path:
    """A file of the checkout."""
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def run(root: Path, *arguments: object, python: str = sys.executable) -> tuple[int, list[str]]:
    """Exit code, and the lines of its messages."""
    command = [python, CHECK, "--root", root, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_a_tree_that_is_laid_out_passes(tree: Path) -> None:
    assert run(tree) == (0, [])


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("hal/bad.h", GOOD_C + "int  x;\n", 5),
        ("tests/bad.c", "int add(int a, int b) {\n    return a + b;\n}\n", 1),
        ("tests/bad.c", GOOD_C.replace("    return", "  return"), 2),
        ("tests/bad.c", f"int x = {' + '.join(['1'] * 60)};\n", 1),
        ("tests/bad.c", '#include "b.h"\n#include "a.h"\n', 1),
        ("tools/bad.py", GOOD_PYTHON + "\n\nX = {'a': 1}\n", 6),
        ("tools/bad.py", GOOD_PYTHON.replace("a + b", "a+b"), 3),
    ],
)
def test_a_planted_breach_is_found_and_repaired(tree: Path, name: str, text: str, line: int) -> None:
    path = write(tree, name, text)
    assert run(tree) == (1, [f"{name}:{line}: not laid out as tools/format does it"])
    assert run(tree, path)[0] == 1
    assert run(tree, tree / "tools/add.py") == (0, [])
    assert run(tree, "--fix") == (0, [])
    assert run(tree) == (0, [])


def test_imports_are_sorted_by_the_repair(tree: Path) -> None:
    path = write(tree, "tools/imports.py", "import sys\nimport os\n\nprint(os, sys)\n")
    assert run(tree, "--fix") == (0, [])
    assert path.read_text(encoding="utf-8").startswith("import os\nimport sys\n")


def test_many_files_are_all_checked(tree: Path) -> None:
    for number in range(130):
        write(tree, f"tests/many/f{number:03}.c", GOOD_C if number % 10 else GOOD_C + "int  x;\n")
    code, messages = run(tree)
    assert code == 1
    assert [message.split(":")[0] for message in messages] == [f"tests/many/f{n:03}.c" for n in range(0, 130, 10)]


def test_a_generated_header_and_the_build_folder_are_left_alone(tree: Path) -> None:
    write(tree, "hal/s32k144/registers.h", "int  x;\n")
    write(tree, "build/host/bad.c", "int  x;\n")
    assert run(tree) == (0, [])


def test_a_file_outside_of_the_checkout_is_refused(tree: Path) -> None:
    outside = write(tree.parent, "outside.c", GOOD_C)
    for path in (outside, tree / "missing.c"):
        code, messages = run(tree, path)
        assert (code, messages) == (1, [f"error: {path}: no file of {tree}"])


def test_a_missing_program_is_named(tree: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    code, messages = run(tree, python=str(tmp_path / "venv" / "bin" / "python"))
    assert code == 1
    assert messages == [f"error: {tmp_path / 'venv' / 'bin' / 'clang-format'} is missing: run tools/setup"]


def test_messages_in_another_form_are_no_pass(tree: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    folder = tmp_path / "venv" / "bin"
    for name in ("clang-format", "ruff"):
        (folder / name).write_text("#!/bin/sh\necho something else >&2\nexit 1\n", encoding="utf-8")
        (folder / name).chmod(0o755)
    code, messages = run(tree, python=str(folder / "python"))
    assert code == 1
    assert messages == ["error: clang-format printed what is not understood: something else"]


def test_a_file_that_cannot_be_parsed_is_no_pass(tree: Path) -> None:
    write(tree, "tools/bad.py", "def f(:\n")
    code, messages = run(tree)
    assert code == 1
    assert messages[0].startswith("error: ruff failed: ")
