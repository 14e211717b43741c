# SPDX-License-Identifier: Apache-2.0
"""The checkers find what is planted, and leave alone what is allowed."""

import subprocess
import sys
from pathlib import Path

import pytest

CHECKS = Path(__file__).resolve().parents[2] / "tools" / "checks"
HEAD = "/* SPDX-License-Identifier: Apache-2.0 */\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A small project with a file in every layer, clean."""
    sources = {
        "firmware/fx/q.h": "#include <stdint.h>\n",
        "firmware/types/frames.h": '#include "fx/q.h"\n',
        "firmware/signal/pi.h": '#include "types/frames.h"\n',
        "firmware/control/flux_table_types.h": '#include "types/frames.h"\n',
        "firmware/control/flux_table.h": '#include "control/flux_table_types.h"\n',
        "firmware/control/mrai.h": '#include "control/flux_table_types.h"\n',
        "firmware/control/mrai.c": '#include "control/mrai.h"\n#include "signal/pi.h"\n',
        "firmware/control/modulate_types.h": '#include "types/frames.h"\n',
        "firmware/app/fast_isr.c": '#include "control/mrai.h"\n#include "hal/adc.h"\n',
        "hal/adc.h": '#include "types/frames.h"\n',
        "hal/host/adc.c": '#include "hal/adc.h"\n#include <math.h>\n',
        "tests/plant/plant.h": "#include <math.h>\n",
        "tests/plant/plant.c": '#include "plant.h"\n',
    }
    for name, text in sources.items():
        write(tmp_path, name, text)
    return tmp_path


def write(root: Path, name: str, text: str) -> None:
    """A source file with everything the style wants."""
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    folder = path.parent.name.upper()
    guard = f"{folder}_{path.stem.upper()}_H"
    if path.suffix == ".h":
        text = f"#ifndef {guard}\n#define {guard}\n{text}#endif\n"
    path.write_text(HEAD + text)


def check(name: str, root: Path) -> tuple[int, str]:
    """Exit code and messages of a checker."""
    done = subprocess.run(
        [sys.executable, str(CHECKS / f"{name}.py"), "--root", str(root)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.parametrize("name", ["layers", "style", "complexity"])
def test_a_clean_tree_passes(tree: Path, name: str) -> None:
    assert check(name, tree) == (0, "")


@pytest.mark.parametrize(
    ("path", "include", "word"),
    [
        ("firmware/fx/bad.c", '"types/frames.h"', "firmware/fx may include nothing outside"),
        ("firmware/fx/bad.c", "<math.h>", "<math.h> in firmware/fx"),
        ("firmware/fx/bad.c", "<stdio.h>", "<stdio.h>"),
        ("firmware/types/bad.h", '"signal/pi.h"', "not firmware/signal/pi.h"),
        ("firmware/signal/bad.c", '"control/mrai.h"', "not firmware/control/mrai.h"),
        ("firmware/control/mrai_bad.c", '"hal/adc.h"', "not hal/adc.h"),
        ("firmware/control/mrai_bad.c", '"control/flux_table.h"', "value types only"),
        ("firmware/control/mrai_bad.c", '"flux_table.h"', "value types only"),
        ("firmware/control/mrai_bad.c", '"../control/flux_table.h"', "value types only"),
        ("firmware/control/mrai_bad.c", '"control/modulate_types.h"', "downstream"),
        ("firmware/control/mrai_bad.c", '"plant/plant.h"', "not tests/plant/plant.h"),
        ("firmware/control/novel.c", '"control/novel_types.h"', "not a file of the project"),
        ("firmware/control/novel.c", '"control/mrai.h"', "has no place in PIPELINE"),
        ("firmware/safety/bad.c", '"control/mrai.h"', "not firmware/control/mrai.h"),
        ("firmware/app/bad.c", "<stdio.h>", "<stdio.h> in firmware/app"),
        ("firmware/app/bad_isr.c", '"comm/messages.h"', "an interrupt packs nothing for the bus"),
        ("firmware/app/bad.c", '"plant/plant.h"', "not tests/plant/plant.h"),
        ("hal/bad.h", '"control/mrai.h"', "not firmware/control/mrai.h"),
        ("hal/mps2/bad.c", '"hal/host/port.h"', "not hal/host/port.h"),
        ("tests/plant/bad.c", '"fx/q.h"', "not firmware/fx/q.h"),
        ("tests/plant/sub/bad.c", '"../../../firmware/fx/q.h"', "not firmware/fx/q.h"),
        ("tests/support/twin/bad.c", '"control/mrai.h"', "not firmware/control/mrai.h"),
    ],
)
def test_a_planted_include_against_the_layers_is_found(
    tree: Path, path: str, include: str, word: str
) -> None:
    write(tree, "hal/host/port.h", "")
    write(tree, "firmware/comm/messages.h", "")
    write(tree, path, f"#  include {include}\n")
    code, messages = check("layers", tree)
    assert code == 1
    assert word in messages
    assert messages.startswith(f"{path}:")
    assert len(messages.splitlines()) == 1


@pytest.mark.parametrize(
    ("path", "line", "word"),
    [
        ("firmware/fx/bad.c", "/* TODO */", "'TODO'"),
        ("tools/bad.py", "# FIXME later", "'FIXME'"),
        ("docs/bad.md", "as decided in issue 12", "'issue 12'"),
        ("docs/bad.md", "see ../shared/theory.md", "'../shared'"),
        ("docs/bad.md", "see /work/here", "'/work/'"),
        ("docs/bad.md", "as the previous session did", "session"),
        ("firmware/fx/bad.c", "/* " + "x" * 160 + " */", "columns"),
        ("firmware/fx/bad.c", "\n" * 151, "at most 150"),
        ("firmware/signal/bad.c", "\n" * 121, "at most 120"),
        ("firmware/control/bad.c", "\n" * 201, "at most 200"),
        ("firmware/app/bad.c", "\n" * 251, "at most 250"),
        ("hal/bad.h", "\n" * 61, "at most 60"),
        ("firmware/types/bad.h", "\n" * 81, "at most 80"),
    ],
)
def test_a_planted_breach_of_style_is_found(tree: Path, path: str, line: str, word: str) -> None:
    write(tree, path, line + "\n")
    (tree / path).parent.mkdir(exist_ok=True)
    code, messages = check("style", tree)
    assert code == 1
    assert word in messages
    assert len(messages.splitlines()) == 1


@pytest.mark.parametrize("text", ["a diagnostic session", "an issue", "todo es posible"])
def test_ordinary_words_are_left_alone(tree: Path, text: str) -> None:
    write(tree, "docs/good.md", text + "\n")
    assert check("style", tree) == (0, "")


def test_a_missing_licence_line_is_found(tree: Path) -> None:
    (tree / "firmware/fx/q.c").write_text("int x;\n")
    (tree / "tools").mkdir()
    (tree / "tools/run").write_text("#!/bin/sh\n")
    code, messages = check("style", tree)
    assert code == 1
    assert [line.split(":")[0] for line in messages.splitlines()] == [
        "firmware/fx/q.c", "tools/run",
    ]  # fmt: skip


def test_a_guard_that_is_not_the_path_is_found(tree: Path) -> None:
    (tree / "firmware/fx/q.h").write_text(HEAD + "#ifndef Q_H\n#define Q_H\n#endif\n")
    code, messages = check("style", tree)
    assert code == 1
    assert "wanted FX_Q_H" in messages


def test_something_new_at_the_top_level_is_found(tree: Path) -> None:
    write(tree, "src/main.c", "")
    code, messages = check("style", tree)
    assert code == 1
    assert messages.startswith("src:1: does not belong at the top level")


def test_the_build_folder_is_not_looked_at(tree: Path) -> None:
    (tree / "build/host").mkdir(parents=True)
    (tree / "build/host/bad.c").write_text("/* TODO */\n")
    assert check("style", tree) == (0, "")


def function(statements: int) -> str:
    """A C function of statements + 3 lines: its head, a declaration, its end."""
    return "int f(int x) {\nint y = x;\n" + "y++;\n" * statements + "return y; }\n"


def test_forty_lines_are_allowed_and_forty_one_found(tree: Path) -> None:
    write(tree, "firmware/app/long.c", function(37))
    assert check("complexity", tree) == (0, "")
    write(tree, "firmware/app/long.c", function(38))
    code, messages = check("complexity", tree)
    assert code == 1
    assert "f: 41 lines, at most 40" in messages


def test_a_tangled_function_is_found(tree: Path) -> None:
    write(tree, "firmware/app/knot.c", "int f(int x) {\n" + "if (x) x++;\n" * 10 + "return x; }\n")
    code, messages = check("complexity", tree)
    assert code == 1
    assert "complexity 11, at most 10" in messages


def test_a_long_python_function_is_found(tree: Path) -> None:
    write(tree, "tools/long.py", "def f():\n" + "    x = 1\n" * 61)
    code, messages = check("complexity", tree)
    assert code == 1
    assert "at most 60" in messages
