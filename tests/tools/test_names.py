# SPDX-License-Identifier: Apache-2.0
"""The checker of names finds pages that name a file, a function or a field that does not exist."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "names.py"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small project."""
    for name, text in {
        "firmware/control/measure.c": "void measure_step(int x)\n{\n}\n",
        "firmware/control/measure.h": "typedef struct {\n    int gain; /* not: offset */\n} measure_t;\n"
        "typedef int count_t;\nvoid measure_step(int x);\n",
        "docs/theory/plant.md": "# Plant\n",
        "CHANGELOG.md": "`firmware/app/gone.c` was split.\n",
        "docs/decisions/009.md": "`firmware/app/gone.c` held 41 files; see [plant](../theory/plant.md).\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def check(root: Path) -> tuple[int, list[str]]:
    """Exit code and messages."""
    command = [sys.executable, str(SCRIPT), "--root", str(root)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize(
    "text",
    [
        "`firmware/control/measure.c` and `measure.h` have `measure_step()`",
        "all of `firmware/control/*.h` in `firmware/control`, also `firmware/control/`",
        "[plant](theory/plant.md#tests), [site](https://example.org/x.md), [here](#tests)",
        "`hal/acme/main.c` is yours, `motor_si.c` is generated",
        "```\n`firmware/none.c`\n```",
        "`measure_step` without brackets, `x.toml`, `hal_*`",
        "`measure_t`, `measure_t.gain`, `count_t`, `uint32_t`",
    ],
)
def test_what_exists_may_be_named(tree: Path, text: str) -> None:
    (tree / "docs/page.md").write_text(text + "\n")
    assert check(tree) == (0, [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("see `firmware/control/measures.c`", "there is no firmware/control/measures.c"),
        ("see `firmware/app`", "there is no firmware/app"),
        ("see `tests/unit/*/test_none.c`", "there is no tests/unit/*/test_none.c"),
        ("see `measures.c`", "there is no file measures.c"),
        ("call `measure_steps()`", "there is no function measure_steps()"),
        ("| `measure_step()` | `none.h` |", "there is no file none.h"),
        ("the type `measures_t`", "there is no measures_t"),
        ("the field `measure_t.offset`", "there is no measure_t.offset"),
        ("see [plant](plant.md)", "the link leads nowhere: plant.md"),
        ("see [plant](theory/plants.md#tests)", "the link leads nowhere: theory/plants.md"),
    ],
)
def test_a_planted_name_of_nothing_is_found(tree: Path, text: str, message: str) -> None:
    (tree / "docs/page.md").write_text(f"# Page\n\n{text}\n")
    assert check(tree) == (1, [f"docs/page.md:3: {message}"])


def test_a_decision_may_name_the_past_but_its_links_must_lead_somewhere(tree: Path) -> None:
    (tree / "docs/theory/plant.md").unlink()
    assert check(tree) == (1, ["docs/decisions/009.md:1: the link leads nowhere: ../theory/plant.md"])
