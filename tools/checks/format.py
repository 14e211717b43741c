#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Layout of C and Python files, by the pinned clang-format and ruff: .clang-format and .ruff.toml say how.

Checks every file of the checkout, or those named; with --fix (tools/format) lays them out.
"""

import argparse
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path

from tree import PROJECT, Violation, files, report

# Written by programs, which have their own layout.
GENERATED = {Path("hal/s32k144/registers.h")}
BATCH = 40  # files in one call: few calls, but at least one for every processor
C_COMPLAINT = re.compile(r"^(.+?):(\d+):\d+: error: code should be clang-formatted")
PYTHON_COMPLAINT = re.compile(r"^(.+?):(\d+):\d+: unformatted: ")


def tool(name: str) -> str:
    """The pinned program, which lies beside the Python interpreter that runs this file."""
    path = Path(sys.executable).with_name(name)
    if not path.is_file():
        sys.exit(f"error: {path} is missing: run tools/setup")
    return str(path)


def batches(paths: Sequence[Path]) -> Iterator[list[str]]:
    """The paths in portions."""
    rest = iter(paths)
    while part := list(map(str, islice(rest, BATCH))):
        yield part


def call(root: Path, command: Sequence[str], part: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """The program with some files; 1 is how both programs say that something is not laid out."""
    done = subprocess.run([*command, *part], cwd=root, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        sys.exit(f"error: {Path(command[0]).name} failed: {done.stderr.strip()[:600]}")
    return done


def run(root: Path, command: Sequence[str], paths: Sequence[Path]) -> list[subprocess.CompletedProcess[str]]:
    """The program with all files, on all processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda part: call(root, command, part), batches(paths)))


def complaints(
    root: Path, command: Sequence[str], paths: Sequence[Path], form: re.Pattern[str]
) -> Iterator[tuple[str, ...]]:
    """What the program reports: file, line, and what else the form takes from each message."""
    for done in run(root, command, paths):
        found = [match.groups() for line in (done.stdout + done.stderr).splitlines() if (match := form.match(line))]
        if bool(found) != bool(done.returncode):
            sys.exit(
                f"error: {Path(command[0]).name} printed what is not understood: {(done.stderr or done.stdout).strip()}"
            )
        yield from found


def check(root: Path, c_files: Sequence[Path], python_files: Sequence[Path]) -> Iterator[Violation]:
    """One violation for each file that is laid out otherwise, at the first such line."""
    c_check = [tool("clang-format"), "--dry-run", "--Werror"]
    python_check = [tool("ruff"), "format", "--check", "--output-format", "concise"]
    first: dict[str, int] = {}
    for name, number in (
        *complaints(root, c_check, c_files, C_COMPLAINT),
        *complaints(root, python_check, python_files, PYTHON_COMPLAINT),
    ):
        first[name] = min(int(number), first.get(name, int(number)))
    for name, number in sorted(first.items()):
        yield Violation(Path(name), number, "not laid out as tools/format does it")


def fix(root: Path, c_files: Sequence[Path], python_files: Sequence[Path]) -> None:
    """Lay out the files in place."""
    run(root, [tool("clang-format"), "-i"], c_files)
    run(root, [tool("ruff"), "check", "--fix-only", "--select", "I"], python_files)
    run(root, [tool("ruff"), "format"], python_files)


def chosen(root: Path, named: Sequence[Path]) -> list[Path]:
    """The files named on the command line, relative to the checkout; without names every file of it."""
    if not named:
        return list(files(root, ".c", ".h", ".py"))
    for path in named:
        if not path.resolve().is_file() or not path.resolve().is_relative_to(root):
            sys.exit(f"error: {path}: no file of {root}")
    return [path.resolve().relative_to(root) for path in named]


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--fix", action="store_true", help="lay out instead of complaining")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="default: every file of the checkout")
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    paths = [path for path in chosen(root, arguments.files) if path not in GENERATED]
    c_files = [path for path in paths if path.suffix in {".c", ".h"}]
    python_files = [path for path in paths if path.suffix == ".py"]
    if arguments.fix:
        fix(root, c_files, python_files)
        return 0
    return report(check(root, c_files, python_files), "format")


if __name__ == "__main__":
    sys.exit(main())
