#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors in C files, by the pinned clang-tidy: .clang-tidy says which checks apply and why others do not.

    tidy.py BUILD [FILE ...]     BUILD has a compile_commands.json; default: every file of FOLDERS that it compiles

A file that passed is not checked again until the file, a header that it includes, its command, .clang-tidy or this
script changes: its key in build/tidy-cache is a digest of all of them.
"""

import argparse
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from format import tool
from tree import PROJECT, Violation, report

FOLDERS = ("firmware", "hal/host", "tests/plant", "tests/target/emulator")
COMPLAINT = re.compile(r"^(.+?):(\d+):\d+: (?:warning|error): (.+)$", re.MULTILINE)


class Unit(NamedTuple):
    """A file and how it is compiled: the compiler, and its options without files."""

    path: Path
    folder: Path
    compiler: str
    options: tuple[str, ...]


def units(root: Path, build: Path) -> list[Unit]:
    """Every file of FOLDERS once: a file compiled in several ways is checked in the first of them."""
    found: dict[Path, Unit] = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        path = Path(entry["directory"], entry["file"])
        if any(path.is_relative_to(root / folder) for folder in FOLDERS):
            compiler, *options = shlex.split(entry["command"])
            del options[options.index("-o") : options.index("-o") + 2]
            options = [word for word in options if word not in ("-c", entry["file"])]
            found.setdefault(path, Unit(path, Path(entry["directory"]), compiler, tuple(options)))
    return [found[path] for path in sorted(found)]


def needed(unit: Unit) -> list[Path]:
    """The file and all that it includes, as its compiler finds them."""
    command = [unit.compiler, *unit.options, "-M", "-MT", "x", str(unit.path)]
    done = subprocess.run(command, cwd=unit.folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"error: {unit.path} does not compile: {done.stderr.strip()[:600]}")
    # The names in make's form: a space within one is preceded by a backslash.
    return [unit.folder / name for name in shlex.split(done.stdout.partition(":")[2].replace("\\\n", " "))]


def digest(root: Path, program: str, unit: Unit) -> str:
    """What the verdict on the file depends on."""
    seen = hashlib.sha256("\0".join((program, str(unit.folder), unit.compiler, *unit.options)).encode())
    installed = (
        Path(program).parent.parent / "stamp"
    )  # the environment is built again for another version of clang-tidy
    for path in (root / ".clang-tidy", Path(__file__), *([installed] if installed.is_file() else []), *needed(unit)):
        seen.update(f"\0{path}\0".encode() + path.read_bytes())
    return seen.hexdigest()


def complaints(root: Path, program: str, unit: Unit) -> list[Violation]:
    """What clang-tidy finds in one file and the headers it includes."""
    command = [program, "--quiet", str(unit.path), "--", *unit.options]
    done = subprocess.run(command, cwd=unit.folder, capture_output=True, text=True, check=False)
    found = [
        Violation(path.relative_to(root) if path.is_relative_to(root) else path, int(number), text)
        for name, number, text in COMPLAINT.findall(done.stdout)
        for path in [Path(os.path.normpath(unit.folder / name))]
    ]
    if bool(found) != bool(done.returncode):
        sys.exit(f"error: clang-tidy failed on {unit.path}: {(done.stderr or done.stdout).strip()[:600]}")
    return found


def check(root: Path, chosen: Sequence[Unit], jobs: int) -> Iterator[Violation]:
    """Every finding once, although a header is included by many files."""
    program = tool("clang-tidy")
    cache = root / "build" / "tidy-cache"
    cache.mkdir(parents=True, exist_ok=True)

    def one(unit: Unit) -> list[Violation]:
        passed = cache / digest(root, program, unit)
        found = [] if passed.is_file() else complaints(root, program, unit)
        if not found:
            passed.touch()
        return found

    with ThreadPoolExecutor(jobs) as pool:
        found = {violation for each in pool.map(one, chosen) for violation in each}
    yield from sorted(found, key=lambda violation: (str(violation.path), violation.line, violation.text))


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    given = parser.parse_args()
    root, build = given.root.resolve(), given.build.resolve()
    if not (build / "compile_commands.json").is_file():
        sys.exit(f"error: {build}/compile_commands.json is missing: configure the build first")
    wanted = {path.resolve() for path in given.files}
    chosen = [unit for unit in units(root, build) if not wanted or unit.path in wanted]
    if not chosen or len(chosen) < len(wanted):
        sys.exit(f"error: nothing to check, or a file that {build} does not compile in {', '.join(FOLDERS)}")
    return report(check(root, chosen, given.jobs), f"clang-tidy, {len(chosen)} files")


if __name__ == "__main__":
    sys.exit(main())
