# SPDX-License-Identifier: Apache-2.0
"""No test waits by the clock: below tests/ there are no clocks, pauses and time-outs outside tests/support/progress.py.

A test that waits for a second, or allows a process ten, fails on a busy computer although nothing is wrong. Tests wait
for progress instead, usually of simulated time.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from tree import Violation, files, lines, run

HELPER = Path("tests/support/progress.py")
# The virtual ECU can follow the wall clock for its users; in tests its time passes only when they ask for it.
REAL_TIME = {Path("tests/vecu/main.c"), Path("tests/vecu/hub.c")}

CLOCKS = {"time", "sched", "timeit"}  # modules
CALLS = {"sleep", "monotonic", "perf_counter", "process_time", "WebDriverWait", "implicitly_wait",
         "settimeout", "setitimer", "alarm"}  # fmt: skip
WITH_TIMEOUT = {"wait", "join", "result", "recv", "communicate", "create_connection", "acquire"}
KEYWORDS = {"timeout", "timeout_s", "poll_frequency"}
HANG = "HANG_S"
C_CLOCK = re.compile(r"\b(((nano|u)?sleep|clock_gettime|gettimeofday|alarm|setitimer)\s*\(|time\((NULL|0|&)|clock\(\))")
CMAKE_TIME = re.compile(r"\b(TIMEOUT|COST|RUN_SERIAL)\b")
# faulthandler_timeout of pytest: a thread reads the stacks of the others while they run on, and may crash the test.
SETTING_CLOCK = re.compile(r"^[^#;]*?\b\w*timeout\w*\s*=")
SCRIPT_CLOCK = re.compile(r"\b(sleep|setTimeout|setInterval|timeout)\b")


def _is_number(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def _is_time(node: ast.expr, call: str) -> bool:
    """Whether an argument is a time: recv(64) takes bytes, and recv(0.0) does not wait."""
    if not (isinstance(node, ast.Constant) and _is_number(node)) or node.value == 0:
        return False
    return isinstance(node.value, float) or call != "recv"


def _name(function: ast.expr) -> str:
    return ast.unparse(function).rpartition(".")[2]


def _of_call(node: ast.Call) -> Iterator[str]:
    name = _name(node.func)
    if name in CALLS or ast.unparse(node.func) in ("asyncio.wait_for", "asyncio.timeout"):
        yield f"{name}()"
    if name in WITH_TIMEOUT and any(_is_time(argument, name) for argument in node.args):
        yield f"{name}() with a time-out"
    for keyword in node.keywords:
        is_hang = isinstance(keyword.value, ast.Name) and keyword.value.id == HANG
        is_none = isinstance(keyword.value, ast.Constant) and keyword.value.value is None
        if keyword.arg in KEYWORDS and not is_hang and not is_none:
            yield f"{keyword.arg}="


def _of_python(text: str) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, f"module {alias.name}") for alias in node.names if alias.name in CLOCKS)
        elif isinstance(node, ast.ImportFrom) and node.module in CLOCKS:
            yield node.lineno, f"module {node.module}"
        elif isinstance(node, ast.Call):
            yield from ((node.lineno, what) for what in _of_call(node))


def _of_lines(text: list[str], pattern: re.Pattern[str]) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text, start=1):
        if found := pattern.search(line):
            yield number, found.group(0)


def _found(root: Path, path: Path) -> Iterator[tuple[int, str]]:
    if path.suffix == ".py" and path != HELPER:
        yield from _of_python((root / path).read_text(encoding="utf-8"))
    elif path.suffix in (".c", ".h") and path not in REAL_TIME:
        yield from _of_lines(lines(root, path), C_CLOCK)
    elif path.name == "CMakeLists.txt":
        yield from _of_lines(lines(root, path), CMAKE_TIME)
    elif path.suffix == ".ini":
        yield from _of_lines(lines(root, path), SETTING_CLOCK)
    elif path.suffix in (".sh", ".js"):
        yield from _of_lines(lines(root, path), SCRIPT_CLOCK)


def check(root: Path) -> Iterator[Violation]:
    """Every file below tests/."""
    for path in files(root):
        if path.parts[0] == "tests":
            for line, what in _found(root, path):
                yield Violation(path, line, f"{what} waits by the clock: use {HELPER}; a test's own time-out follows "
                                            "from tests/seconds.txt")  # fmt: skip


if __name__ == "__main__":
    sys.exit(run(check, "waits"))
