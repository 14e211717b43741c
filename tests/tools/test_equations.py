# SPDX-License-Identifier: Apache-2.0
"""The checker of equation numbers finds planted errors and accepts what is allowed."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "checks" / "equations.py"

CLEAN = {
    "docs/theory/mrai.md": "As (MR-2) shows.\n$$\na=b \\tag{MR-1}\n$$\n**(MR-2)** in words, $x$\n\\tag{MR-3}\n",
    "docs/theory/torque-loop.md": "$$ t \\tag{TL-10} $$ uses (MR-1)\n",
    "docs/theory/plant.md": "    T = p (psi_d i_q - psi_q i_d)      (PL-7)\n\nBy (PL-7)\n",
    "docs/scaling.md": "    (SC-1)  psi_b = V_b/omega_b        from (TL-10)\n",
    "docs/decisions/001.md": "see (MR-1) and (SC-1)\n",
    "firmware/control/mrai.h": "/** Source docs/theory/mrai.md (MR-1) ... (MR-3) */\n",
    "firmware/control/mrai.c": "/* both (MR-1, MR-3) */\n",
    "hal/host/port.c": "/* (TL-10) */\n",
    "tests/unit/test_mrai.c": "/* (MR-1) to (MR-3) */\n",
    "tools/gen.py": "# (SC-1)\n",
}


def write(root: Path, name: str, text: str) -> None:
    """A file of the small project."""
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small project in which every number cited is defined once."""
    for name, text in CLEAN.items():
        write(tmp_path, name, text)
    return tmp_path


def check(root: Path) -> tuple[int, list[str]]:
    """Exit code and messages."""
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--root", str(root)], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.splitlines()


def test_a_clean_tree_passes(tree: Path) -> None:
    assert check(tree) == (0, [])


@pytest.mark.parametrize(
    ("path", "text", "message"),
    [
        ("firmware/control/x.c", "\n/* (MR-99) */\n", "2: (MR-99) is not defined in docs/theory/mrai.md"),
        ("firmware/control/x.h", " * Source mrai.md (MR-3) ... (MR-5), only MR-4 and MR-5 missing\n", "1: (MR-4)"),
        ("hal/x.h", "/* (TL-1) */\n", "1: (TL-1) is not defined in docs/theory/torque-loop.md"),
        ("tests/x.c", "/* as MR-12 says */\n", "1: (MR-12)"),
        ("tests/x.py", "# (CC-1)\n", "1: (CC-1) is not defined in docs/theory/current-control.md"),
        ("tools/x.py", '"""(SC-2)."""\n', "1: (SC-2) is not defined in docs/scaling.md"),
        ("docs/howto/x.md", "see (AT-1)\n", "1: (AT-1)"),
        ("docs/howto/y.md", "$$ x \\tag{AT-1} $$\n", "1: (AT-1) is not defined"),
        ("docs/theory/modulation.md", "$$ y \\tag{MO-1} $$\nby (MO-2)\n", "2: (MO-2)"),
    ],
)
def test_a_planted_number_without_definition_is_found(tree: Path, path: str, text: str, message: str) -> None:
    write(tree, path, text)
    code, messages = check(tree)
    assert code == 1
    assert messages[0].startswith(f"{path}:{message}")


def test_every_number_inside_a_range_is_wanted(tree: Path) -> None:
    write(tree, "firmware/control/x.h", "/* (MR-1) ... (MR-6) */\n")
    code, messages = check(tree)
    assert code == 1
    assert [line.split()[1] for line in messages] == ["(MR-4)", "(MR-5)", "(MR-6)"]


@pytest.mark.parametrize(
    "again", ["$$ z \\tag{MR-1} $$", "**(MR-1)** again", "    a = b   (MR-1)", "    (MR-1)  a = b"]
)
def test_a_planted_second_definition_is_found(tree: Path, again: str) -> None:
    page = tree / "docs/theory/mrai.md"
    page.write_text(page.read_text() + again + "\n")
    code, messages = check(tree)
    assert code == 1
    assert messages == ["docs/theory/mrai.md:7: (MR-1) is defined again, first in docs/theory/mrai.md:3"]


@pytest.mark.parametrize("prefix", ["ID", "LM", "MN", "SS"])
def test_a_second_definition_is_found_whatever_page_it_is_on(tree: Path, prefix: str) -> None:
    page = {"ID": "identification", "LM": "limits", "MN": "monitors", "SS": "safe-state"}[prefix]
    write(tree, f"docs/theory/{page}.md", f"$$ x \\tag{{{prefix}-1}} $$\n$$ y \\tag{{{prefix}-1}} $$\n")
    code, messages = check(tree)
    assert code == 1
    assert f"docs/theory/{page}.md:2: ({prefix}-1) is defined again" in messages[0]


@pytest.mark.parametrize("tag", ["ZZ-1", "ZZ-1a", "MR-1a", "17"])
def test_a_tag_that_no_page_owns_is_found(tree: Path, tag: str) -> None:
    write(tree, "docs/theory/zeppelin.md", f"$$ x \\tag{{{tag}}} $$\n")
    code, messages = check(tree)
    assert code == 1
    assert messages[0].startswith(f"docs/theory/zeppelin.md:1: ({tag}) is defined here, allowed are numbers of AT, CC")


def test_a_definition_on_the_page_of_another_prefix_is_found(tree: Path) -> None:
    write(tree, "docs/theory/flux-tables.md", "$$ x \\tag{MR-4} $$\n")
    code, messages = check(tree)
    assert code == 1
    assert "(MR-4) is defined here, its page is docs/theory/mrai.md" in messages[0]


@pytest.mark.parametrize("text", ["FT-ABC", "a UTF-8 text", "ISO-9001", "XMR-7", "AT-"])
def test_what_only_resembles_a_number_is_left_alone(tree: Path, text: str) -> None:
    write(tree, "docs/howto/x.md", text + "\n")
    assert check(tree) == (0, [])


def test_the_build_folder_is_not_checked(tree: Path) -> None:
    write(tree, "build/generated.c", "/* (MR-99) */\n")
    assert check(tree) == (0, [])
