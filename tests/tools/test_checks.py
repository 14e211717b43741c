# SPDX-License-Identifier: Apache-2.0
"""The checkers find planted errors and accept what is allowed."""

import importlib
import subprocess
import sys
from collections.abc import Callable, Iterable
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
        "firmware/control/current/flux_table_types.h": '#include "types/frames.h"\n',
        "firmware/control/current/flux_table.h": '#include "control/current/flux_table_types.h"\n',
        "firmware/control/current/current_control.h": '#include "control/current/flux_table_types.h"\n',
        "firmware/control/current/modulate_types.h": '#include "types/frames.h"\n',
        "firmware/control/identify/window.h": '#include "control/current/flux_table_types.h"\n',
        "firmware/control/identify/kalman.c": '#include "control/identify/window.h"\n#include "signal/pi.h"\n',
        "firmware/control/mrai/mrai.h": '#include "control/current/flux_table_types.h"\n',
        "firmware/drive/drive.h": '#include "control/mrai/mrai.h"\n',
        "firmware/drive/fast_isr.c": '#include "drive/drive.h"\n#include "hal/adc.h"\n',
        "hal/adc.h": '#include "types/frames.h"\n',
        "hal/host/adc.c": '#include "hal/adc.h"\n#include <math.h>\n',
        "tests/plant/plant.h": "#include <math.h>\n",
        "tests/plant/plant.c": '#include "plant.h"\n',
    }
    for name, text in sources.items():
        write(tmp_path, name, text)
    write_structure(tmp_path, *(name for name in sources if name.startswith("firmware/")))
    return tmp_path


def write_structure(root: Path, *names: str) -> None:
    """The STRUCTURE table with these files in this order."""
    rows, last = [], ""
    for name in names:
        folder, _, file = name.rpartition("/")
        stem, _, suffix = file.partition(".")
        rows += [f"| **`{folder}`** | | **What it is** |"] if folder != last else []
        rows += [f"| `{stem}` | .{suffix} | what it does |"]
        last = folder
    (root / "docs").mkdir(exist_ok=True)
    write_readmes(root, names)
    (root / "docs" / "architecture.md").write_text("\n".join(["# Architecture", "", *rows, ""]))


def write_readmes(root: Path, names: Iterable[str]) -> None:
    """A README for each folder with its files, or its folders, in this order after those that it lists already."""
    stems: dict[Path, dict[str, None]] = {}
    for path in map(Path, names):
        stems.setdefault(path.parent, {})[path.stem] = None
    for folder in [f for f in stems if f.parts[1] == "control"]:
        stems.setdefault(folder.parent, {})[folder.name] = None
    for folder in list(stems):
        stems.setdefault(Path("firmware"), {})[folder.parts[1]] = None
    for folder, found in stems.items():
        page = root / folder / "README.md"
        before = page.read_text().split("    ")[1].strip().split(" → ") if page.is_file() else []
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(f"# Folder\n\n    {' → '.join(dict.fromkeys([*before, *found]))}\n")


def append_structure(root: Path, *names: str) -> None:
    """Add each of these files at the end of the table."""
    table = root / "docs" / "architecture.md"
    before = table.read_text()
    write_structure(root, *names)
    table.write_text(before + table.read_text())


def write(root: Path, name: str, text: str) -> None:
    """Write a source file with the licence line and the include guard that the checker of style requires."""
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


@pytest.mark.parametrize("name", ["layers", "style", "complexity", "waits"])
def test_a_clean_tree_passes(tree: Path, name: str) -> None:
    assert check(name, tree) == (0, "")


@pytest.mark.parametrize(
    ("path", "include", "word"),
    [
        ("firmware/fx/bad.c", '"types/frames.h"', "firmware/fx may include nothing outside"),
        ("firmware/fx/bad.c", "<math.h>", "<math.h> in firmware/fx"),
        ("firmware/fx/bad.c", "<stdio.h>", "<stdio.h>"),
        ("firmware/types/bad.h", '"signal/pi.h"', "not firmware/signal/pi.h"),
        ("firmware/signal/bad.c", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
        ("firmware/control/current/bad.c", '"hal/adc.h"', "not hal/adc.h"),
        ("firmware/control/current/bad.c", '"control/current/flux_table.h"', "value types only"),
        ("firmware/control/current/bad.c", '"flux_table.h"', "value types only"),
        ("firmware/control/current/bad.c", '"../current/flux_table.h"', "value types only"),
        ("firmware/control/current/bad.c", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
        ("firmware/control/mrai/bad.c", '"control/current/flux_table.h"', "value types only"),
        ("firmware/control/mrai/bad.c", '"plant/plant.h"', "not tests/plant/plant.h"),
        ("firmware/control/identify/bad.c", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
        ("firmware/control/identify/bad.c", '"control/identify/novel.h"', "not a file of the project"),
        ("firmware/safety/bad.c", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
        ("firmware/drive/bad.c", "<stdio.h>", "<stdio.h> in firmware/drive"),
        ("firmware/ecu/bad_isr.c", '"comm/messages.h"', "an interrupt packs nothing for the bus"),
        ("firmware/drive/bad.c", '"plant/plant.h"', "not tests/plant/plant.h"),
        ("hal/bad.h", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
        ("hal/mps2/bad.c", '"hal/host/port.h"', "not hal/host/port.h"),
        ("tests/plant/bad.c", '"fx/q.h"', "not firmware/fx/q.h"),
        ("tests/plant/sub/bad.c", '"../../../firmware/fx/q.h"', "not firmware/fx/q.h"),
        ("tests/support/twin/bad.c", '"control/mrai/mrai.h"', "not firmware/control/mrai/mrai.h"),
    ],
)
def test_a_planted_include_against_the_layers_is_found(tree: Path, path: str, include: str, word: str) -> None:
    write(tree, "hal/host/port.h", "")
    write(tree, "firmware/comm/messages.h", "")
    write(tree, path, f"#  include {include}\n")
    append_structure(tree, "firmware/comm/messages.h", *([path] if path.startswith("firmware/") else []))
    code, messages = check("layers", tree)
    assert code == 1
    assert word in messages
    assert messages.startswith(f"{path}:")
    assert len(messages.splitlines()) == 1


def test_an_include_against_the_order_of_the_table_is_found(tree: Path) -> None:
    write(tree, "firmware/control/identify/kalman.h", "")
    write(tree, "firmware/control/identify/point.h", '#include "control/identify/kalman.h"\n')
    append_structure(tree, "firmware/control/identify/point.h", "firmware/control/identify/kalman.h")
    code, messages = check("layers", tree)
    assert code == 1
    assert "include against the order of the STRUCTURE table" in messages


def test_a_file_without_a_line_in_the_table_and_a_line_without_a_file_are_found(tree: Path) -> None:
    write(tree, "firmware/fx/novel.h", "")
    append_structure(tree, "firmware/fx/gone.c")
    code, messages = check("layers", tree)
    assert code == 1
    assert "firmware/fx/novel.h:1: has no line in the STRUCTURE table" in messages
    assert "firmware/fx/gone.c does not exist" in messages


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# Folder\n\n    kalman → window\n", "README.md:3: the order in the STRUCTURE table is window → kalman"),
        ("# Folder\n\n    window\n", "README.md:3: the order in the STRUCTURE table is window → kalman"),
        ("# Folder\n", "README.md:1: wanted one indented line with the order: window → kalman"),
        (None, "README.md:1: wanted one indented line with the order: window → kalman"),
    ],
)
def test_a_readme_with_another_order_than_the_table_is_found(tree: Path, text: str | None, message: str) -> None:
    page = tree / "firmware/control/identify/README.md"
    page.unlink()
    if text is not None:
        page.write_text(text)
    code, messages = check("layers", tree)
    assert code == 1
    assert messages.splitlines() == [f"firmware/control/identify/{message}"]


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
        ("firmware/control/current/bad.c", "\n" * 201, "at most 200"),
        ("firmware/drive/bad.c", "\n" * 251, "at most 250"),
        ("hal/bad.h", "\n" * 61, "at most 60"),
        ("firmware/types/bad.h", "\n" * 81, "at most 80"),
        ("firmware/drive/bad.c", '__asm__("" : "+r"(x));', "'__asm__' belongs into firmware/fx"),
        ("firmware/drive/bad.c", "if (__builtin_expect(x, 0)) {", "'__builtin_expect' belongs into firmware/fx"),
        ("hal/host/bad.c", "static __attribute__((noinline, cold)) int f(void)", "'cold' belongs into firmware/fx"),
        ("firmware/scope/bad.c", "#pragma GCC unroll 8", "'#pragma' belongs into firmware/fx"),
        ("firmware/signal/bad.c", "typedef int __attribute__((may_alias)) word_t;", "'may_alias' belongs into"),
        ("firmware/control/bad.c", "return __builtin_clz(x);", "'__builtin_clz' belongs into firmware/fx"),
        ("firmware/safety/bad.c", '__asm__ volatile("");', "'__asm__' belongs into firmware/fx"),
        ("hal/s32k144/bad.c", "x = fx_arch_qadd(a, b);", "'fx_arch_qadd' belongs into firmware/fx"),
    ],
)
def test_a_planted_breach_of_style_is_found(tree: Path, path: str, line: str, word: str) -> None:
    write(tree, path, line + "\n")
    (tree / path).parent.mkdir(exist_ok=True)
    code, messages = check("style", tree)
    assert code == 1
    assert word in messages
    assert len(messages.splitlines()) == 1


@pytest.mark.parametrize(
    ("path", "line"),
    [("firmware/fx/good.c", '__asm__("" : "+r"(x));'), ("hal/s32k144/good.c", '__asm__ volatile("nop");')],
)
def test_the_library_and_the_ports_may_name_instructions(tree: Path, path: str, line: str) -> None:
    write(tree, path, line + "\n")
    assert check("style", tree) == (0, "")


@pytest.mark.parametrize("text", ["a diagnostic session", "an issue", "todo es posible"])
def test_ordinary_words_are_left_alone(tree: Path, text: str) -> None:
    write(tree, "docs/good.md", text + "\n")
    assert check("style", tree) == (0, "")


LONG = "word " * 25 + "end"


def test_a_planted_paragraph_in_a_cell_is_found(tree: Path) -> None:
    write(tree, "docs/bad.md", f"| a | b |\n|---|---|\n| short | {LONG} |\n| short | {LONG} {LONG} |\n")
    assert check("style", tree) == (1, "docs/bad.md:5: 257 columns in a cell, at most 130\n")


def test_what_a_reader_does_not_see_does_not_count_as_width_of_a_cell(tree: Path) -> None:
    text = "word " * 15 + "<!-- figure: command_time_out -->30 ms, see [can](../howto/can.md#a-long-anchor)"
    write(tree, "docs/good.md", f"| a | {text} |\n")
    assert check("style", tree) == (0, "")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (LONG, 1),
        (f"- an item\n  {LONG}", 2),
        (f"a paragraph\n    {LONG}", 2),
        (f"```\ncode\n```\n{LONG}", 4),
        (f"$$\na=b\n$$\n{LONG}", 4),
        (f"    code\n\n{LONG}", 3),
        (f"# {LONG}", 1),
        ("x" * 100 + f" [page](../{'y' * 60}.md).", 1),
    ],
)
def test_a_planted_line_of_prose_that_is_too_wide_is_found(tree: Path, text: str, line: int) -> None:
    (tree / "docs/bad.md").write_text(text + "\n")
    code, messages = check("style", tree)
    assert code == 1
    assert messages.startswith(f"docs/bad.md:{line}: ")
    assert "columns of prose, at most 120" in messages
    assert len(messages.splitlines()) == 1


@pytest.mark.parametrize(
    "text",
    [
        "x" * 120,
        f"    {LONG}",
        f"text\n\n    {LONG}\n    {LONG}",
        f"```c\n{LONG}\n```",
        f"$$\n{LONG}\n$$",
        f"![{LONG}](images/a.png)",
        f"- [page](../{'y' * 120}.md).",
    ],
)
def test_code_equations_and_a_single_link_may_be_wide(tree: Path, text: str) -> None:
    (tree / "docs/good.md").write_text(text + "\n")
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


def test_the_build_folder_is_not_checked(tree: Path) -> None:
    (tree / "build/host").mkdir(parents=True)
    (tree / "build/host/bad.c").write_text("/* TODO */\n")
    assert check("style", tree) == (0, "")


def function(statements: int) -> str:
    """A C function of statements + 3 lines: its head, a declaration, its end."""
    return "int f(int x) {\nint y = x;\n" + "y++;\n" * statements + "return y; }\n"


def test_forty_lines_are_allowed_and_forty_one_found(tree: Path) -> None:
    write(tree, "firmware/drive/long.c", function(37))
    assert check("complexity", tree) == (0, "")
    write(tree, "firmware/drive/long.c", function(38))
    code, messages = check("complexity", tree)
    assert code == 1
    assert "f: 41 lines, at most 40" in messages


def test_a_tangled_function_is_found(tree: Path) -> None:
    write(tree, "firmware/drive/knot.c", "int f(int x) {\n" + "if (x) x++;\n" * 10 + "return x; }\n")
    code, messages = check("complexity", tree)
    assert code == 1
    assert "complexity 11, at most 10" in messages


def test_a_long_python_function_is_found(tree: Path) -> None:
    write(tree, "tools/long.py", "def f():\n" + "    x = 1\n" * 61)
    code, messages = check("complexity", tree)
    assert code == 1
    assert "at most 60" in messages


@pytest.mark.parametrize("path", ["tests/live/test_bad.py", "tests/hil/deep/conftest.py"])
@pytest.mark.parametrize(
    ("line", "word"),
    [
        ("import time", "module time"),
        ("from time import sleep", "module time"),
        ("asyncio.sleep(1)", "sleep()"),
        ("asyncio.wait_for(x, 1)", "wait_for()"),
        ("with asyncio.timeout(3): pass", "timeout()"),
        ("subprocess.run(x, timeout=60)", "timeout="),
        ("subprocess.run(x, timeout=2 * PATIENCE)", "timeout="),
        ("Channel(HOST, port, timeout_s=20.0)", "timeout_s="),
        ("process.wait(20)", "wait() with"),
        ("bus.recv(5.0)", "recv() with"),
        ("socket.create_connection(x, 5.0)", "create_connection() with"),
        ("connection.settimeout(5)", "settimeout()"),
        ("thread.join(1.0)", "join() with"),
        ("WebDriverWait(browser, 60)", "WebDriverWait()"),
    ],
)
def test_a_planted_wait_by_the_clock_is_found(tree: Path, path: str, line: str, word: str) -> None:
    write(tree, path, "")
    (tree / path).write_text(f"# SPDX-License-Identifier: Apache-2.0\n{line}\n")
    code, messages = check("waits", tree)
    assert code == 1
    assert messages.startswith(f"{path}:2: {word}")
    assert len(messages.splitlines()) == 1


@pytest.mark.parametrize(
    ("path", "line", "word"),
    [
        ("tests/fuzz/bad.c", "nanosleep(&t, 0);", "nanosleep("),
        ("tests/fuzz/bad.c", "long now = time(NULL);", "time(NULL"),
        ("tests/fuzz/bad.c", "clock_t t = clock();", "clock()"),
        ("tests/live/CMakeLists.txt", "fluxtrue_pytest(NAME x PATH x.py LABELS y TIMEOUT 9)", "TIMEOUT"),
        ("tests/live/CMakeLists.txt", "set_tests_properties(x PROPERTIES RUN_SERIAL TRUE)", "RUN_SERIAL"),
        ("tests/tools/wait.sh", "sleep 1", "sleep"),
        ("tests/pytest.ini", "faulthandler_timeout = 300", "faulthandler_timeout ="),
        ("tests/pytest.ini", "addopts = -q --timeout=9", "addopts = -q --timeout="),
    ],
)
def test_a_planted_wait_that_is_not_in_python_is_found(tree: Path, path: str, line: str, word: str) -> None:
    write(tree, path, line + "\n")
    code, messages = check("waits", tree)
    assert code == 1
    assert messages.startswith(f"{path}:2: {word}")


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("tests/support/progress.py", "import time"),
        ("tests/live/test_good.py", "subprocess.run(x, timeout=HANG_S)"),
        ("tests/live/test_good.py", "client.get(x, timeout=None)"),
        ("tests/live/test_good.py", "connection.recv(64)"),
        ("tests/live/test_good.py", "bus.recv(0.0)"),
        ("tests/live/test_good.py", "rig.wait_for('run', 2.0)"),
        ("tests/live/test_good.py", "'-'.join(words)"),
        ("tests/vecu/main.c", "clock_gettime(CLOCK_MONOTONIC, &now);"),
        ("tests/fuzz/good.c", "/* the peripheral's clock (PCC) */"),
        ("tools/good.py", "import time"),
    ],
)
def test_a_wait_that_follows_progress_is_left_alone(tree: Path, path: str, line: str) -> None:
    write(tree, path, "")
    (tree / path).write_text(f"# SPDX-License-Identifier: Apache-2.0\n{line}\n")
    assert check("waits", tree) == (0, "")


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., list[str]]:
    """A function that returns the messages of the checker of time-outs for one test with these ctest properties."""
    monkeypatch.syspath_prepend(str(CHECKS))
    times = importlib.import_module("times")
    (tmp_path / "tests").mkdir(exist_ok=True)
    (tmp_path / "tests" / "seconds.txt").write_text("# a comment\nslow 300\n")
    return lambda name, **properties: [violation.text for violation in times.check(tmp_path, {name: properties})]


@pytest.mark.parametrize(
    ("name", "properties", "word"),
    [
        ("slow", {"TIMEOUT": 1499.0, "COST": 300.0}, "time-out 1499 s"),
        ("slow", {"COST": 300.0}, "time-out 0 s"),
        ("quick", {"TIMEOUT": 30.0, "COST": 1.0}, "time-out 30 s"),
        ("slow", {"TIMEOUT": 3000.0, "COST": 20.0}, "COST is not the recorded 300 s"),
        ("quick", {"TIMEOUT": 3000.0, "COST": 1.0, "RUN_SERIAL": True}, "RUN_SERIAL"),
    ],
)
def test_a_time_out_that_does_not_follow_from_the_recorded_time_is_found(
    told: Callable[..., list[str]], name: str, properties: dict[str, object], word: str
) -> None:
    (message,) = told(name, **properties)
    assert message.startswith(f"{name}: {word}")


def test_a_time_out_that_follows_from_the_recorded_time_is_accepted(told: Callable[..., list[str]]) -> None:
    assert told("slow", TIMEOUT=1500.0, COST=300.0) == told("quick", TIMEOUT=1800.0, COST=1.0) == []


def test_a_recorded_time_of_a_test_that_no_longer_exists_is_found(
    told: Callable[..., list[str]], tmp_path: Path
) -> None:
    assert told("quick", TIMEOUT=1800.0, COST=1.0) == []
    times = importlib.import_module("times")
    (tmp_path / "tests" / "seconds.txt").write_text("slow 300\nrenamed 40\n")
    assert list(times.gone(tmp_path, ["slow", "renamed", "quick"])) == []
    (violation,) = times.gone(tmp_path, ["slow", "quick"])
    assert violation.text.startswith("renamed: no test has this name")


LOG = """\
      Start  2: slow
 1/3 Test  #2: slow .............................   Passed  120.40 sec
 2/3 Test  #1: quick ............................   Passed    0.52 sec
 3/3 Test #13: a-test-with-a-name-that-is-so-long-that-hardly-any-dot-follows ...   Passed   21.6 sec

100% tests passed, 0 tests failed out of 3
"""


def test_the_log_of_a_whole_run_is_written_down_in_one_command(
    told: Callable[..., list[str]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert told("slow", TIMEOUT=3000.0, COST=300.0) == []
    times = importlib.import_module("times")
    log, seconds = tmp_path / "host-ctest.log", tmp_path / "tests" / "seconds.txt"
    seconds.write_text("# a comment\nslow 300\ngone 40\nlong-campaign 500\n")
    log.write_text(LOG.replace("100% tests passed, 0", "67% tests passed, 1"))
    known = ["slow", "quick", "long-campaign", "a-test-with-a-name-that-is-so-long-that-hardly-any-dot-follows"]
    with pytest.raises(SystemExit, match="not ctest's log of a run in which every test passed"):
        times.record_log(tmp_path, log, known)
    log.write_text(LOG)
    assert times.record_log(tmp_path, log, known) == 0
    assert times.recorded(tmp_path) == {"long-campaign": 500, "slow": 120, known[3]: 22}
    assert "gone" not in seconds.read_text() and seconds.read_text().startswith("# SPDX-License-Identifier")
