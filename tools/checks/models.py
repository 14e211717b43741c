# SPDX-License-Identifier: Apache-2.0
"""Each peripheral's model of the emulator says what it models and which test shows it.

A file of tests/target/emulator that handles writes of registers (a function *_written), or the core (nvic.c, scs.c,
faults.c), carries a table in its opening comment, one documented behaviour a row:

    * documented behaviour | modelled | test

modelled is "yes", "refused" (the emulation stops with a message) or "no"; "yes" and "refused" name a test that exists,
"no" names none ("-").
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from tree import Violation, files, lines, run

MODELS = Path("tests/target/emulator")
ALSO = {"nvic.c", "scs.c", "faults.c"}
WRITES = re.compile(r"^(?:static )?void \w+_written\(emu_t \*emu", re.MULTILINE)
HEAD = re.compile(r"^ \* documented behaviour\s*\| modelled\s*\| test$")
ROW = re.compile(r"^ \* (?P<what>[^|]+?)\s*\| (?P<how>\w+)\s*\| (?P<test>\S+)$")
RULER = re.compile(r"^ \* [-| ]+$")
TEST = re.compile(r"^\s*(?:def|void) (test_\w+)\(", re.MULTILINE)


def tests(root: Path) -> set[str]:
    """Every test function there is."""
    found: set[str] = set()
    for path in files(root, ".py", ".c"):
        if path.parts[0] == "tests":
            found |= set(TEST.findall("\n".join(lines(root, path))))
    return found


def _row(path: Path, number: int, line: str, known: set[str]) -> Iterator[Violation]:
    row = ROW.match(line)
    if row is None:
        yield Violation(path, number, "a row is: documented behaviour | yes, refused or no | test")
    elif row["how"] not in {"yes", "refused", "no"}:
        yield Violation(path, number, f"modelled = '{row['how']}', allowed: yes, refused, no")
    elif row["how"] == "no" and row["test"] != "-":
        yield Violation(path, number, "what is not modelled has no test: write -")
    elif row["how"] != "no" and row["test"] not in known:
        yield Violation(path, number, f"there is no test {row['test']}")


def table(path: Path, text: list[str], known: set[str]) -> Iterator[Violation]:
    """What is wrong with the table of one model."""
    start = next((k for k, line in enumerate(text) if HEAD.match(line)), None)
    if start is None:
        yield Violation(path, 1, "a model wants a table: documented behaviour | modelled | test")
        return
    rows = 0
    for k in range(start + 1, len(text)):
        if text[k].strip() in {"*/", "*"}:
            break
        if not RULER.match(text[k]):
            rows += 1
            yield from _row(path, k + 1, text[k], known)
    if rows == 0:
        yield Violation(path, start + 1, "the table has no row")


def check(root: Path) -> Iterator[Violation]:
    """All models of a checkout."""
    known = tests(root)
    for path in files(root, ".c"):
        if path.parent == MODELS:
            text = lines(root, path)
            if path.name in ALSO or WRITES.search("\n".join(text)):
                yield from table(path, text, known)


if __name__ == "__main__":
    sys.exit(run(check, "models"))
