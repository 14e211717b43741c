# SPDX-License-Identifier: Apache-2.0
"""The checker of C finds planted errors, and uses a stored verdict only while it is still valid."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHECK = ROOT / "tools" / "checks" / "tidy.py"
HEADER = """#include <stdint.h>

int32_t four(int32_t x);
int32_t again(int32_t x);
int32_t pick(int32_t n);
int number(const char *text);

static inline int32_t twice(int32_t x)
{
    return 2 * x;
}
"""
GOOD = '#include "fx/twice.h"\n\nint32_t four(int32_t x)\n{\n    return twice(twice(x));\n}\n'
NULL = """#include <stddef.h>
#include "fx/twice.h"
int32_t pick(int32_t n)
{
    const int32_t *at = NULL;
    if (n != 7) {
        at = &n;
    }
    return *at;
}
"""
CLONE = "int32_t y = 0;\n    if (x > 1) {\n        y = 2;\n    } else {\n        y = 2;\n    }\n    return x + y;"
NUMBER = '#include "fx/twice.h"\n#include <stdlib.h>\nint number(const char *text)\n{\n    return atoi(text);\n}\n'


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small checkout with one good file, compiled in two ways."""
    root = tmp_path / "check out"
    root.mkdir()
    shutil.copy(ROOT / ".clang-tidy", root)
    write(root, "firmware/fx/twice.h", HEADER)
    write(root, "firmware/fx/good.c", GOOD)
    database(root, "firmware/fx/good.c", "firmware/fx/good.c")
    return root


def write(root: Path, name: str, text: str) -> None:
    """A file of the checkout."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text, encoding="utf-8")


def database(root: Path, *names: str) -> None:
    """The compile_commands.json that CMake writes for these files."""
    entries = [
        {
            "directory": str(root / "build" / "host"),
            "file": str(root / name),
            "command": f'/usr/bin/gcc -I"{root}/firmware" -std=c11 -Wall -o x{k}.o -c "{root / name}"',
        }
        for k, name in enumerate(names)
    ]
    write(root, "build/host/compile_commands.json", json.dumps(entries))


def run(root: Path, *arguments: object) -> tuple[int, list[str]]:
    """Exit code, and the lines of its messages."""
    command = [sys.executable, CHECK, "--root", root, root / "build" / "host", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_a_good_file_passes(tree: Path) -> None:
    assert run(tree) == (0, [])


@pytest.mark.parametrize(
    ("text", "line", "check"),
    [
        (NULL, 9, "clang-analyzer-core.NullDereference"),
        (GOOD.replace("return twice(twice(x));", CLONE), 6, "bugprone-branch-clone"),
        (NUMBER, 5, "bugprone-unchecked-string-to-number-conversion,cert-err34-c"),
    ],
)  # fmt: skip
def test_a_planted_error_is_found_again_and_again(tree: Path, text: str, line: int, check: str) -> None:
    write(tree, "hal/host/bad.c", text)
    database(tree, "firmware/fx/good.c", "hal/host/bad.c")
    for arguments in ((), (), (tree / "hal/host/bad.c",)):
        code, messages = run(tree, *arguments)
        assert code == 1
        assert [message.split(" ")[0] for message in messages] == [f"hal/host/bad.c:{line}:"]
        assert f"[{check}," in messages[0]
    assert run(tree, tree / "firmware/fx/good.c") == (0, [])


def test_an_error_of_a_header_is_reported_once_and_after_its_files_had_passed(tree: Path) -> None:
    write(tree, "firmware/fx/other.c", GOOD.replace("four", "again"))
    database(tree, "firmware/fx/good.c", "firmware/fx/other.c")
    assert run(tree) == (0, [])
    write(tree, "firmware/fx/twice.h", HEADER.replace("return 2 * x;", CLONE))
    code, messages = run(tree)
    assert code == 1
    assert [message.split(" ")[0] for message in messages] == ["firmware/fx/twice.h:11:"]


def test_what_has_passed_is_remembered_until_the_checks_change(tree: Path) -> None:
    write(tree, "firmware/fx/good.c", NULL)
    chosen = (tree / ".clang-tidy").read_text(encoding="utf-8")
    (tree / ".clang-tidy").write_text(chosen.replace("  clang-analyzer-*,\n", ""), encoding="utf-8")
    for _ in range(2):
        assert run(tree) == (0, [])
        assert len(list((tree / "build" / "tidy-cache").iterdir())) == 1
    (tree / ".clang-tidy").write_text(chosen, encoding="utf-8")
    assert run(tree)[0] == 1


@pytest.mark.parametrize("text", ["int x = ;\n", '#include "missing.h"\n'])
def test_a_file_that_does_not_compile_is_no_pass(tree: Path, text: str) -> None:
    write(tree, "firmware/fx/good.c", text)
    assert run(tree)[0] == 1


def test_nothing_to_check_is_no_pass(tree: Path) -> None:
    code, messages = run(tree, tree / "firmware/fx/twice.h")
    assert (code, messages[0].split(":")[:2]) == (1, ["error", " nothing to check, or a file that " + str(tree)
                                                      + "/build/host does not compile in firmware, hal/host, "
                                                      "tests/plant, tests/target/emulator"])  # fmt: skip
    (tree / "build/host/compile_commands.json").unlink()
    code, messages = run(tree)
    assert (code, messages) == (
        1, [f"error: {tree}/build/host/compile_commands.json is missing: configure the build first"])  # fmt: skip


def test_every_check_that_is_left_out_has_its_reason() -> None:
    text = (ROOT / ".clang-tidy").read_text(encoding="utf-8")
    out = [
        line.strip(" ,-").split("-", 1)[1] for line in text.splitlines() if line.startswith("  -") and "*" not in line
    ]
    reasons = "\n".join(line for line in text.splitlines() if line.startswith("#"))
    assert len(out) > 10
    assert [name for name in out if name.rsplit(".", 1)[-1] not in reasons] == []
