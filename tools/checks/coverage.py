# SPDX-License-Identifier: Apache-2.0
"""Unit tests reach every line and every branch of the measured layers, or an exclusion says why none can.

    coverage.py                                 the exclusions: listed, and refused without a reason
    coverage.py --report <json> --build <dir>   gcovr's report, against 100 %

gcovr adds the counts of an inline function up over all objects, branch by branch. That is sound only if the compiler
has made the same branches in each of them, and a function that no object has is not in its report at all. The second
form therefore also compares the objects with each other and the report with the functions of the sources.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import lizard

from tree import PROJECT, REASON_WORDS, Violation, files, lines, listed, report

MEASURED = tuple(
    Path("firmware") / layer for layer in ("fx", "signal", "control", "safety", "second_level", "scope", "ecu")
)
MARKER = re.compile(r"\b[GL]COVR?_EXCL_\w*")
EXCLUSION = re.compile(r"/\* GCOVR_EXCL_(LINE|BR_LINE|START): (.+?) \*/")
STOP = re.compile(r"/\* GCOVR_EXCL_STOP \*/")
GCOV_FILES = 50  # in one call


@dataclass(frozen=True)
class Exclusion:
    """Lines that are not counted, and why; of a branch exclusion the line is."""

    path: Path
    first: int
    last: int
    reason: str

    def __str__(self) -> str:
        where = f"{self.path}:{self.first}" + (f"-{self.last}" if self.last > self.first else "")
        return f"{where}: {self.reason}"


def is_measured(path: Path) -> bool:
    """A source file whose coverage counts."""
    return path.suffix in (".c", ".h") and any(path.is_relative_to(folder) for folder in MEASURED)


def _exclusions(root: Path, path: Path) -> Iterator[Exclusion | Violation]:
    start: tuple[int, str] | None = None
    for number, line in enumerate(lines(root, path), 1):
        if not MARKER.search(line):
            continue
        found, stop = EXCLUSION.search(line), STOP.search(line)
        if not is_measured(path):
            yield Violation(path, number, "excluded from a coverage that is not measured here")
        elif stop and start:
            yield Exclusion(path, start[0], number, start[1])
            start = None
        elif start or not found:
            yield Violation(path, number, "write /* GCOVR_EXCL_LINE: reason */, or BR_LINE for its branches, "
                                          "or START with a reason and then STOP")  # fmt: skip
        elif len(found[2].split()) < REASON_WORDS:
            yield Violation(path, number, f"'{found[2]}' does not say why no test can reach this")
        elif found[1] == "START":
            start = (number, found[2])
        else:
            yield Exclusion(path, number, number, found[2])
    if start:
        yield Violation(path, start[0], "GCOVR_EXCL_START without GCOVR_EXCL_STOP")


def all_exclusions(root: Path) -> list[Exclusion | Violation]:
    """Every exclusion below firmware/, and every marker that does not have the form of one."""
    return [e for path in files(root, ".c", ".h") if path.parts[0] == "firmware" for e in _exclusions(root, path)]


def _missed(path: Path, line: dict, text: str) -> Violation | None:
    taken = [branch["count"] > 0 for branch in line["branches"] if not branch.get("gcovr/excluded")]
    if line.get("gcovr/excluded") or (line["count"] > 0 and all(taken)):
        return None
    what = f"branches taken {sum(taken)} of {len(taken)}" if line["count"] > 0 else "never reached"
    return Violation(path, line["line_number"], f"{what}: {text.strip()}")


def missed(root: Path, covered: dict) -> Iterator[Violation]:
    """Lines that no test reaches, branches that no test takes."""
    for file in covered["files"]:
        path = Path(file["file"])
        source = lines(root, path)
        for line in file["lines"]:
            violation = _missed(path, line, source[line["line_number"] - 1])
            if violation:
                yield violation


def unmeasured(root: Path, covered: dict, excluded: Iterable[Exclusion]) -> Iterator[Violation]:
    """Functions that no object of the tests has: inline ones without a caller, files that are not built."""
    counted = {Path(file["file"]): {line["line_number"] for line in file["lines"]} for file in covered["files"]}
    ranges = list(excluded)
    for path in filter(is_measured, files(root, ".c", ".h")):
        for function in lizard.analyze_file(str(root / path)).function_list:
            first, last = function.start_line, function.end_line
            is_excluded = any(e.path == path and e.first <= first and last <= e.last for e in ranges)
            if counted.get(path, set()).isdisjoint(range(first, last + 1)) and not is_excluded:
                yield Violation(path, first, f"{function.name}: no test has it, so nothing is measured")


def _branches(root: Path, build: Path) -> dict[tuple[Path, int], dict[int, str]]:
    """Number of branches of each line, with one object that has so many."""
    found: dict[tuple[Path, int], dict[int, str]] = {}
    counted = sorted(build.rglob("*.gcda"))
    with tempfile.TemporaryDirectory() as scratch:
        for n in range(0, len(counted), GCOV_FILES):
            command = ["gcov", "--branch-probabilities", "--json-format", "--stdout",
                       *map(str, counted[n : n + GCOV_FILES])]  # fmt: skip
            done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, check=True)
            for data in (json.loads(text) for text in done.stdout.splitlines() if text.startswith("{")):
                for file in data["files"]:
                    path = Path(data["current_working_directory"], file["file"]).resolve()
                    if path.is_relative_to(root) and is_measured(path.relative_to(root)):
                        for line in file["lines"]:
                            key = (path.relative_to(root), line["line_number"])
                            found.setdefault(key, {})[len(line["branches"])] = data["data_file"]
    return found


def unlike(root: Path, build: Path) -> Iterator[Violation]:
    """Lines for which two objects have different branches, so that their counts cannot be added up."""
    for (path, line), counts in _branches(root, build.resolve()).items():
        if len(counts) > 1:
            objects = ", ".join(f"{n} in {Path(name).name}" for n, name in sorted(counts.items()))
            yield Violation(path, line, f"not the same branches in all objects: {objects}")


def _table(covered: dict) -> None:
    for layer in MEASURED:
        found = [line for file in covered["files"] if Path(file["file"]).is_relative_to(layer) for line in file["lines"]
                 if not line.get("gcovr/excluded")]  # fmt: skip
        branches = [b for line in found for b in line["branches"] if not b.get("gcovr/excluded")]
        print(f"{layer.as_posix():18} {sum(line['count'] > 0 for line in found):5} of {len(found):5} lines"
              f" {sum(b['count'] > 0 for b in branches):5} of {len(branches):5} branches")  # fmt: skip


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--report", type=Path, help="what gcovr --json has written")
    parser.add_argument("--build", type=Path, help="the build folder with the tests' counts")
    args = parser.parse_args()
    exclusions, violations = listed(all_exclusions(args.root), "coverage")
    if args.report:
        covered = json.loads(args.report.read_text(encoding="utf-8"))
        _table(covered)
        violations += missed(args.root, covered)
        violations += unmeasured(args.root, covered, exclusions)
        violations += unlike(args.root.resolve(), args.build) if args.build else []
    return report(violations, "coverage")


if __name__ == "__main__":
    sys.exit(main())
