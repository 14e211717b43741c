# SPDX-License-Identifier: Apache-2.0
r"""Every equation number that is cited is defined exactly once, on the page that owns its prefix; every prefix has one.

A definition is \tag{MR-7}; in an indented block a number at the left margin, two blanks before the
equation, or at the right one, two blanks after it; or a bold **(MR-7)** where the text itself is it.
"""

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tree import Violation, files, lines, run

THEORY = Path("docs/theory")
PAGES = {
    "AT": THEORY / "angle-tracker.md",
    "CC": THEORY / "current-control.md",
    "CM": THEORY / "commissioning.md",
    "CR": THEORY / "current-reference.md",
    "DI": THEORY / "data-integrity.md",
    "DT": THEORY / "dead-time-trim.md",
    "FT": THEORY / "flux-tables.md",
    "FX": THEORY / "fixed-point.md",
    "IB": THEORY / "information-bound.md",
    "ID": THEORY / "identification.md",
    "LM": THEORY / "limits.md",
    "MN": THEORY / "monitors.md",
    "MO": THEORY / "modulation.md",
    "MR": THEORY / "mrai.md",
    "PL": THEORY / "plant.md",
    "WC": THEORY / "worst-case-time.md",
    "QA": THEORY / "third-level.md",
    "SC": Path("docs/scaling.md"),
    "SL": THEORY / "second-level.md",
    "SS": THEORY / "safe-state.md",
    "TL": THEORY / "torque-loop.md",
}
SEARCHED = {"firmware", "hal", "tests", "tools", "docs"}
SUFFIXES = (".c", ".h", ".py", ".md", ".toml", ".cmake", ".txt", ".rb", ".sh")
# These files have to contain what they forbid.
EXEMPT = {Path("tools/checks/equations.py"), Path("tests/tools/test_equations.py")}

NUMBER = rf"({'|'.join(PAGES)})-(\d+)"
DEFINITION = re.compile(
    rf"\\tag\{{{NUMBER}\}}|\*\*\({NUMBER}\)\*\*|^ {{4,}}\({NUMBER}\) {{2,}}\S|\S {{2,}}\({NUMBER}\)\s*$"
)
TAG = re.compile(r"\\tag\{([^}]*)\}")
CITED = re.compile(rf"\b{NUMBER}\b")
RANGE = re.compile(rf"\({NUMBER}\)\s*(?:\.\.\.|…|–|-|to|bis)\s*\({NUMBER}\)")


@dataclass(frozen=True, order=True)
class Equation:
    """The number of an equation: MR-7 is ("MR", 7)."""

    prefix: str
    number: int

    def __str__(self) -> str:
        return f"({self.prefix}-{self.number})"


@dataclass(frozen=True)
class Place:
    """A place: a file and a line of it."""

    path: Path
    line: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}"


def equation(prefix: str, number: str) -> Equation:
    """The equation that the two groups of a match name."""
    return Equation(prefix, int(number))


def defined_in(line: str) -> Iterator[Equation]:
    """All definitions in a line."""
    for match in DEFINITION.finditer(line):
        prefix, number = (group for group in match.groups() if group is not None)
        yield equation(prefix, number)


def cited_in(line: str) -> Iterator[Equation]:
    """All citations in a line; a range cites everything in between."""
    for match in RANGE.finditer(line):
        first, last = equation(*match.group(1, 2)), equation(*match.group(3, 4))
        if first.prefix == last.prefix:
            for number in range(first.number + 1, last.number):
                yield Equation(first.prefix, number)
    for match in CITED.finditer(line):
        yield equation(*match.groups())


def searched(root: Path) -> Iterator[tuple[Place, str]]:
    """Every line in which a number may stand."""
    for path in files(root, *SUFFIXES):
        if path.parts[0] in SEARCHED and path not in EXEMPT:
            for number, line in enumerate(lines(root, path), start=1):
                yield Place(path, number), line


def is_page(path: Path) -> bool:
    """Whether the file is a page that may define equations; in other files the same text is a citation."""
    return path.parent == THEORY or path == PAGES["SC"]


def unknown_in(line: str) -> Iterator[str]:
    """Tags whose prefix no page owns, or which are not numbers."""
    for match in TAG.finditer(line):
        if not re.fullmatch(NUMBER, match.group(1)):
            yield match.group(1)


def check(root: Path) -> Iterator[Violation]:
    """Definitions first: a citation may come before the page in the order of the files."""
    text = list(searched(root))
    first: dict[Equation, Place] = {}
    for place, line in text:
        for tag in unknown_in(line) if is_page(place.path) else ():
            allowed = f"allowed are numbers of {', '.join(PAGES)}; a new page is entered in tools/checks/equations.py"
            yield Violation(place.path, place.line, f"({tag}) is defined here, {allowed}")
        for found in defined_in(line) if is_page(place.path) else ():
            page = PAGES[found.prefix]
            if place.path != page:
                yield Violation(place.path, place.line, f"{found} is defined here, its page is {page}")
            elif found in first:
                yield Violation(place.path, place.line, f"{found} is defined again, first in {first[found]}")
            else:
                first[found] = place
    for place, line in text:
        for missing in sorted(set(cited_in(line)) - first.keys()):
            text_of = f"{missing} is not defined in {PAGES[missing.prefix]}"
            yield Violation(place.path, place.line, text_of)


if __name__ == "__main__":
    sys.exit(run(check, "equations"))
