# SPDX-License-Identifier: Apache-2.0
"""The checker of the models' tables finds planted errors and accepts what is allowed."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "models.py"
MODEL = """/* SPDX-License-Identifier: Apache-2.0 */
/* A timer.
 *
 * documented behaviour | modelled | test
 * -------------------- | -------- | ----------------
 * counts               | yes      | test_it_counts
 * capture              | refused  | test_it_refuses
 * jitter               | no       | -
 */
void lpit_written(emu_t *emu, int offset)
{
}
"""
NO_MODEL = "/* SPDX-License-Identifier: Apache-2.0 */\nvoid elf_read(void)\n{\n}\n"
TESTS = "def test_it_counts() -> None: ...\n"
UNIT = "void test_it_refuses(void)\n{\n}\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    folder = tmp_path / "tests" / "target" / "emulator"
    folder.mkdir(parents=True)
    (folder / "lpit.c").write_text(MODEL)
    (folder / "elf.c").write_text(NO_MODEL)
    (folder / "test_lpit.py").write_text(TESTS)
    (tmp_path / "tests" / "test_more.c").write_text(UNIT)
    return tmp_path


def check(tree: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--root", str(tree)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_a_complete_table_passes(tree: Path) -> None:
    assert check(tree) == (0, "models: ok\n")


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        ("test_it_counts", "test_it_runs", "lpit.c:6: there is no test test_it_runs"),
        ("test_it_refuses", "-", "lpit.c:7: there is no test -"),
        ("| no       | -", "| no       | test_it_counts", "lpit.c:8: what is not modelled has no test"),
        ("| yes      |", "| mostly   |", "lpit.c:6: modelled = 'mostly', allowed: yes, refused, no"),
        ("| yes      | test_it_counts", "", "lpit.c:6: a row is"),
        (" * documented behaviour | modelled | test\n", "", "lpit.c:1: a model wants a table"),
    ],
)
def test_what_is_wrong_is_found(tree: Path, line: str, instead: str, message: str) -> None:
    assert MODEL.count(line) == 1
    (tree / "tests" / "target" / "emulator" / "lpit.c").write_text(MODEL.replace(line, instead))
    code, said = check(tree)
    assert code == 1
    assert message in said


def test_a_table_without_a_row_is_found(tree: Path) -> None:
    rows = [line for line in MODEL.splitlines(keepends=True) if "test_it" not in line and "jitter" not in line]
    (tree / "tests" / "target" / "emulator" / "lpit.c").write_text("".join(rows))
    assert "the table has no row" in check(tree)[1]


def test_exceptions_want_a_table_too(tree: Path) -> None:
    (tree / "tests" / "target" / "emulator" / "nvic.c").write_text(NO_MODEL)
    assert "nvic.c:1: a model wants a table" in check(tree)[1]
