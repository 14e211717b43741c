# SPDX-License-Identifier: Apache-2.0
"""The files of a checkout, and how a checker reports."""

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

PROJECT = Path(__file__).resolve().parents[2]
REASON_WORDS = 4  # of an exclusion: fewer say no more than the code
T = TypeVar("T")
SKIPPED = {"build", ".git", "__pycache__", ".pytest_cache", ".venv"}


@dataclass(frozen=True)
class Violation:
    """One breach of a rule, printed the way compilers do."""

    path: Path
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.text}"


def files(root: Path, *suffixes: str) -> Iterator[Path]:
    """All files under root, relative to it, sorted; with one of the suffixes if any are given."""
    for path in sorted(root.rglob("*")):
        relative = path.relative_to(root)
        if SKIPPED.isdisjoint(relative.parts) and path.is_file() and (not suffixes or path.suffix in suffixes):
            yield relative


def lines(root: Path, path: Path) -> list[str]:
    """The lines of a text file; a file that is not text has none."""
    try:
        return (root / path).read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError:
        return []


def report(violations: Iterable[Violation], done: str) -> int:
    """Print all violations; the exit code."""
    found = list(violations)
    for violation in found:
        print(violation, file=sys.stderr)
    print(f"{done}: {len(found)} violations" if found else f"{done}: ok")
    return 1 if found else 0


def listed(found: Iterable[T | Violation], what: str) -> tuple[list[T], list[Violation]]:
    """Print the exclusions from what; return them, and the violations that were among them."""
    exclusions: list[T] = []
    violations: list[Violation] = []
    for one in found:
        if isinstance(one, Violation):
            violations.append(one)
        else:
            exclusions.append(one)
    print(f"{len(exclusions)} exclusions from {what}")
    for exclusion in exclusions:
        print(f"    {exclusion}")
    return exclusions, violations


def run(check: Callable[[Path], Iterable[Violation]], description: str) -> int:
    """Command line of a checker that needs nothing but the checkout."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--root", type=Path, default=PROJECT)
    return report(check(parser.parse_args().root), description)
