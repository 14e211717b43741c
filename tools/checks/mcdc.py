# SPDX-License-Identifier: Apache-2.0
"""Unit tests show the independent effect of each condition of a decision (MC/DC), or an exclusion says why.

    mcdc.py                    the exclusions: listed, and refused without a reason or in another form
    mcdc.py --build <dir>      what the unit tests of that build (preset host-mcdc) have shown when they last ran
    mcdc.py --build <dir> --part safety     only the places of that part, with what the tests executed there

A decision is an expression with && or ||; the branch coverage (coverage.py) covers the others. Clang records which
combinations of the conditions' values the tests executed. A condition is shown if two of them have different results,
differ in this condition, and in no other that was evaluated in both. Clang keeps the combinations of an inline function
by the object that has it; they are put together here, because all objects are made of the same source.

What clang does not measure has no decision in its report: a decision with another one inside an operand, as an argument
of a call; code that no test program is built from. Each && and || of the sources must therefore lie in a measured
decision. The table of docs/safety/mcdc.md must state the counts; its exclusions are compared without clang, too.

An exclusion stands in the line in which the decision begins, or alone in the line before it:

    /* MCDC_EXCL C2: why no test can show this condition */        of several: C2,C3
    /* MCDC_EXCL: why this && or || is not measured */
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from tree import PROJECT, REASON_WORDS, Violation, files, lines, listed, report

LLVM = Path("build", "clang", "bin")
PAGE = Path("docs", "safety", "mcdc.md")  # states the counts
LABEL = "^coverage$"
MAPPING = b"__llvm_covmap"  # section of a program that has instrumented functions; llvm-cov refuses one without
# Part, its sources (the first that fits counts), what must be shown of its conditions in percent.
PARTS = (
    ("fx", r"firmware/fx/", 100),
    ("types", r"firmware/types/", 95),
    ("signal", r"firmware/signal/", 95),
    ("current", r"firmware/control/current/", 100),
    ("identify", r"firmware/control/identify/", 100),
    ("torque", r"firmware/control/torque/", 100),
    ("adapt", r"firmware/control/adapt/", 100),
    ("commission", r"firmware/control/commission/", 100),
    ("mrai", r"firmware/control/mrai/", 100),
    ("safety", r"firmware/safety/", 100),
    ("second_level", r"firmware/second_level/", 95),
    ("receive", r"firmware/comm/(can_rx|can_take|e2e)\.", 100),
    ("comm", r"firmware/comm/", 95),
    ("drive", r"firmware/drive/", 95),
    ("scope", r"firmware/scope/", 95),
    ("storage", r"firmware/storage/", 95),
    ("calibration", r"firmware/calibration/", 95),
    ("supervisor", r"firmware/ecu/supervisor", 100),
    ("ecu", r"firmware/ecu/", 95),
)
EXCLUSION = re.compile(r"/\* MCDC_EXCL(?: (C\d+(?:,C\d+)*))?: (.+?) \*/")
NOT_CODE = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|^[ \t]*#(?:\\\n|[^\n])*|_Static_assert\([^;]*;",
                      re.DOTALL | re.MULTILINE)  # fmt: skip
UNMEASURED = re.compile(r"/\* GCOVR_EXCL_START.*?GCOVR_EXCL_STOP \*/", re.DOTALL)
OPERATOR = re.compile(r"&&|\|\|")

FILE = re.compile(r"^(/.*):$")
DECISION = re.compile(r"---> MC/DC Decision Region \((\d+):(\d+)\) to \((\d+):(\d+)\)")
CONDITION = re.compile(r"Condition C(\d+) --> \((\d+):(\d+)\)")
EXECUTED = re.compile(r"\|\s+\d+ \{ ([TFC\-, ]+?) = ([TF]) +\}")
ROW = re.compile(r"\| (\w+) \| \d+ \| (\d+) \|$")  # of the page
FOLDED = re.compile(r"C(\d+)-Pair: constant folded")

Place = tuple[int, int]  # line and column, from 1


@dataclass
class Decision:
    """One decision of a source, and what all tests together executed of it."""

    path: Path
    first: Place
    last: Place
    conditions: dict[int, Place] = field(default_factory=dict)
    constant: set[int] = field(default_factory=set)
    executed: set[tuple[str, str]] = field(default_factory=set)  # values of the conditions, T F or -, and the result

    def shown(self, condition: int) -> bool:
        """Two executions show the independent effect of this condition."""
        return any(_shows(condition - 1, a, b) for a, b in combinations(sorted(self.executed), 2))

    @property
    def counted(self) -> list[int]:
        """The conditions that can change."""
        return [number for number in sorted(self.conditions) if number not in self.constant]


@dataclass(frozen=True)
class Exclusion:
    """Conditions of the decision that begins in a line, and why no test shows them; none: the whole line."""

    path: Path
    line: int
    conditions: tuple[int, ...]
    reason: str

    def __str__(self) -> str:
        numbers = "".join(f" C{number}" for number in self.conditions)
        return f"{self.path}:{self.line}:{numbers} {self.reason}"


def _shows(index: int, one: tuple[str, str], other: tuple[str, str]) -> bool:
    (a, result_a), (b, result_b) = one, other
    changed = [n for n, values in enumerate(zip(a, b, strict=True)) if sorted(values) == ["F", "T"]]
    return result_a != result_b and changed == [index]


def parse(text: str, root: Path, found: dict[tuple[Path, Place, Place], Decision]) -> None:
    """Add the decisions of the firmware in what `llvm-cov show --show-mcdc` printed."""
    path, decision = Path(), None
    for line in text.splitlines():
        if match := FILE.match(line):
            path, decision = Path(match[1]).resolve(), None
        elif not path.is_relative_to(root / "firmware"):
            continue
        elif match := DECISION.search(line):
            first, last = (int(match[1]), int(match[2])), (int(match[3]), int(match[4]))
            key = (path.relative_to(root), first, last)
            decision = found.setdefault(key, Decision(*key))
        elif decision is None:
            continue
        elif match := CONDITION.search(line):
            decision.conditions[int(match[1])] = (int(match[2]), int(match[3]))
        elif match := FOLDED.search(line):
            decision.constant.add(int(match[1]))
        elif match := EXECUTED.search(line):
            decision.executed.add(("".join(match[1].replace(",", " ").split()), match[2]))


def _programs(build: Path) -> list[str]:
    told = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1", "--label-regex", LABEL],
                          capture_output=True, text=True, check=True)  # fmt: skip
    commands = {test["command"][0] for test in json.loads(told.stdout)["tests"] if "command" in test}
    return sorted(name for name in commands if MAPPING in Path(name).read_bytes())


def reports(root: Path, counts: Sequence[Path], programs: Sequence[str | Path], scratch: Path) -> Iterator[str]:
    """What llvm-cov prints of each program, after the tests have written these counts."""
    merged = scratch / "merged.profdata"
    subprocess.run([root / LLVM / "llvm-profdata", "merge", "-sparse", *counts, "-o", merged], check=True)
    for program in programs:
        command = [root / LLVM / "llvm-cov", "show", "--show-mcdc", "--show-instantiations=false",
                   f"-instr-profile={merged}", program]  # fmt: skip
        yield subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def measured(root: Path, build: Path) -> list[Decision]:
    """The decisions of the firmware as the tests of a build executed them.

    llvm-cov is asked about each program alone: of a function that two programs have in two forms, because a constant of
    the build differs, it would take the first form only.
    """
    counts = sorted((build / "mcdc").glob("*.profraw"))
    if not counts:
        raise SystemExit(f"no counts in {build / 'mcdc'}: tools/mcdc runs the tests that write them")
    found: dict[tuple[Path, Place, Place], Decision] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for text in reports(root, counts, _programs(build), Path(scratch)):
            parse(text, root, found)
    return list(found.values())


def part_of(path: Path) -> str:
    """The part of a source file."""
    return next((name for name, pattern, _ in PARTS if re.match(pattern, path.as_posix())), "")


def without_part(found: Iterable[Decision | Exclusion]) -> Iterator[Violation]:
    """Each file that has decisions or exclusions, and for which no part says what must be shown."""
    for path in sorted({one.path for one in found if not part_of(one.path)}):
        yield Violation(path, 1, "no part has this file: name its folder in PARTS of tools/checks/mcdc.py")


def all_exclusions(root: Path) -> list[Exclusion | Violation]:
    """Every exclusion below firmware/, and every marker that does not have the form of one."""
    found: list[Exclusion | Violation] = []
    for path in files(root, ".c", ".h"):
        for number, line in enumerate(lines(root, path), 1):
            if path.parts[0] != "firmware" or "MCDC_EXCL" not in line:
                continue
            match = EXCLUSION.search(line)
            if not match:
                found.append(Violation(path, number, "write /* MCDC_EXCL C1: reason */, with the condition's number"))
            elif len(match[2].split()) < REASON_WORDS:
                found.append(Violation(path, number, f"'{match[2]}' does not say why no test can show this"))
            else:
                alone = line.strip() == match[0]
                numbers = tuple(int(name[1:]) for name in (match[1] or "").split(",") if name)
                found.append(Exclusion(path, number + alone, numbers, match[2]))
    return found


def unmeasured(root: Path, decisions: Iterable[Decision], excluded: Iterable[Exclusion]) -> Iterator[Violation]:
    """Each && and || of the sources that is in no measured decision."""
    ranges: dict[Path, list[tuple[Place, Place]]] = {}
    for decision in decisions:
        ranges.setdefault(decision.path, []).append((decision.first, decision.last))
    allowed = {(e.path, e.line) for e in excluded if not e.conditions}
    for path in files(root, ".c", ".h"):
        if path.parts[0] != "firmware":
            continue
        text = (root / path).read_text(encoding="utf-8")
        for pattern in (UNMEASURED, NOT_CODE):
            text = pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
        for match in OPERATOR.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            place = (line, match.start() - text.rfind("\n", 0, match.start()))
            inside = any(first <= place <= last for first, last in ranges.get(path, []))
            if not inside and (path, line) not in allowed:
                yield Violation(path, line, f"{match[0]}: no decision that clang measures has it")


def _text(root: Path, decision: Decision, number: int) -> str:
    """The source of a condition, up to the next one or the end of the line."""
    line, column = decision.conditions[number]
    source = lines(root, decision.path)[line - 1][column - 1 :]
    return OPERATOR.split(source)[0].strip(" ;{")


def evaluated(root: Path, decisions: list[Decision], excluded: list[Exclusion]) -> tuple[dict[str, list[int]], dict]:
    """Per part shown, counted and excluded conditions; per decision the conditions that are missing."""
    figures: dict[str, list[int]] = {name: [0, 0, 0] for name, _, _ in PARTS}
    missing: dict[str, list[tuple[Decision, list[int]]]] = {name: [] for name, _, _ in PARTS}
    reasons = {(e.path, e.line, number) for e in excluded for number in e.conditions}
    for decision in sorted(decisions, key=lambda d: (d.path, d.first)):
        part = part_of(decision.path)
        counted = [n for n in decision.counted if (decision.path, decision.first[0], n) not in reasons]
        gaps = [n for n in counted if not decision.shown(n)]
        figures[part][0] += len(counted) - len(gaps)
        figures[part][1] += len(counted)
        figures[part][2] += len(decision.counted) - len(counted)
        if gaps:
            missing[part].append((decision, gaps))
    return figures, missing


def stale(decisions: list[Decision], excluded: list[Exclusion]) -> Iterator[Violation]:
    """Exclusions of what a test shows, or of nothing."""
    places = {(d.path, d.first[0]): d for d in decisions}
    for exclusion in excluded:
        decision = places.get((exclusion.path, exclusion.line))
        for number in exclusion.conditions:
            if decision is None or number not in decision.counted:
                yield Violation(exclusion.path, exclusion.line, f"C{number} is excluded, but there is none")
            elif decision.shown(number):
                yield Violation(exclusion.path, exclusion.line, f"C{number} is excluded, but a test shows it")


def complaints(root: Path, missing: list[tuple[Decision, list[int]]], verbose: bool) -> Iterator[Violation]:
    """One line per condition that is not shown."""
    for decision, gaps in missing:
        seen = ", ".join(f"{values}={result}" for values, result in sorted(decision.executed)) or "nothing"
        for number in gaps:
            tail = f"; executed: {seen}" if verbose else ""
            yield Violation(decision.path, decision.first[0],
                            f"C{number} not shown: {_text(root, decision, number)}{tail}")  # fmt: skip


def page_rows(figures: dict[str, list[int]], decisions: int) -> list[str]:
    """The table of the page: conditions and exclusions of each part."""
    rows = [f"| {name} | {counted} | {without} |" for name, (_, counted, without) in figures.items()]
    counted, without = (sum(row[n] for row in figures.values()) for n in (1, 2))
    return [*rows, f"| all, in {decisions} decisions | {counted} | {without} |"]


def outdated(root: Path, rows: Iterable[str]) -> Iterator[Violation]:
    """Rows that the page has to have; a checkout without the page states nothing."""
    stated = lines(root, PAGE) if (root / PAGE).exists() else None
    for row in rows:
        if stated is not None and row not in stated:
            yield Violation(PAGE, 1, f"no row '{row}', which was measured")


def excluded_rows(root: Path, excluded: Iterable[Exclusion]) -> Iterator[Violation]:
    """Rows of the page whose exclusions are not those in the sources."""
    found = dict.fromkeys((name for name, _, _ in PARTS), 0)
    for one in excluded:
        found[part_of(one.path)] += len(one.conditions)
    for number, line in enumerate(lines(root, PAGE) if (root / PAGE).exists() else [], 1):
        match = ROW.match(line)
        if match and match[1] in found and int(match[2]) != found[match[1]]:
            yield Violation(PAGE, number, f"{match[1]}: {match[2]} excluded, the sources exclude {found[match[1]]}")


def evaluate(root: Path, found: list[Decision], excluded: list[Exclusion], part: str) -> Iterator[Violation]:
    """Print the table; yield what is missing."""
    decisions = [one for one in found if part_of(one.path)]
    figures, missing = evaluated(root, decisions, excluded)
    print(f"{'part':14} shown of conditions  percent  wanted  excluded")
    for name, _, wanted in PARTS:
        shown, counted, without = figures[name]
        percent = 100.0 * shown / counted if counted else 100.0
        print(f"{name:14} {shown:5} of {counted:10} {percent:8.1f} {wanted:7} {without:9}")
        if part in (name, "all") or (not part and percent < wanted):
            yield from complaints(root, missing[name], bool(part))
    print(f"{'all':14} {sum(f[0] for f in figures.values()):5} of {sum(f[1] for f in figures.values()):10}"
          f", {len(decisions)} decisions")  # fmt: skip
    if not part:
        yield from outdated(root, page_rows(figures, len(decisions)))
        yield from unmeasured(root, found, excluded)
        yield from stale(decisions, excluded)


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--build", type=Path, help="a build folder of the preset host-mcdc whose tests have run")
    parser.add_argument("--part", default="", choices=["all", *(name for name, _, _ in PARTS)], metavar="PART",
                        help="all conditions that are not shown, of one part or of all")  # fmt: skip
    args = parser.parse_args()
    exclusions, violations = listed(all_exclusions(args.root), "MC/DC")
    decisions = measured(args.root.resolve(), args.build.resolve()) if args.build else []
    violations += without_part([*exclusions, *decisions])
    exclusions = [one for one in exclusions if part_of(one.path)]
    violations += excluded_rows(args.root, exclusions)
    if args.build:
        violations += evaluate(args.root.resolve(), decisions, exclusions, args.part)
    return report(violations, "mcdc")


if __name__ == "__main__":
    sys.exit(main())
