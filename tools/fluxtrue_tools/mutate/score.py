# SPDX-License-Identifier: Apache-2.0
"""Numbers of mutants by outcome, for each part of the firmware, and what is wrong with them."""

import csv
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fluxtrue_tools.mutate.listed import Listed
from fluxtrue_tools.mutate.run import (
    DUPLICATE,
    EQUIVALENT,
    INVALID,
    KILLED,
    SURVIVED,
    TIMED_OUT,
    UNTESTED,
    Result,
)

LISTED = "listed"  # survived, and the list says why that is no error
COLUMNS = (KILLED, TIMED_OUT, LISTED, SURVIVED, UNTESTED, EQUIVALENT, DUPLICATE, INVALID)


@dataclass
class Score:
    """Numbers of one part."""

    numbers: Counter[str] = field(default_factory=Counter)
    cpu_s: float = 0.0

    @property
    def errors(self) -> int:
        """Mutants that a test could notice."""
        return sum(self.numbers[name] for name in (KILLED, TIMED_OUT, SURVIVED, UNTESTED))

    @property
    def share(self) -> float:
        """Found ones of them; 1 if there are none."""
        return (self.numbers[KILLED] + self.numbers[TIMED_OUT]) / self.errors if self.errors else 1.0


def classified(result: Result, listed: Listed, equal: set[tuple[str, str]]) -> str:
    """The outcome, or LISTED. `equal`: files and objects of listed mutants."""
    if result.outcome in (SURVIVED, UNTESTED):
        known = listed.reason(result.mutant) is not None
        return LISTED if known or (result.mutant.file, result.content) in equal else result.outcome
    return result.outcome


def scores(results: Iterable[tuple[Result, str]], listed: Listed) -> dict[str, Score]:
    """The scores by part, in the order of the files."""
    found: dict[str, Score] = {}
    for result, outcome in results:
        score = found.setdefault(listed.part(result.mutant.file), Score())
        score.numbers[outcome] += 1
        score.cpu_s += result.cpu_s
    return found


def table(found: dict[str, Score]) -> list[str]:
    """A row for each part, and one for all."""
    whole = Score()
    for score in found.values():
        whole.numbers.update(score.numbers)
        whole.cpu_s += score.cpu_s
    head = f"{'':34}" + "".join(f"{name:>11}" for name in COLUMNS) + f"{'found':>9}{'CPU':>9}"
    return [head, *(_row(name, score) for name, score in (*found.items(), ("all", whole)))]


def _row(name: str, score: Score) -> str:
    numbers = "".join(f"{score.numbers[column]:>11}" for column in COLUMNS)
    return f"{name:34}{numbers}{score.share:>9.1%}{score.cpu_s:>7.0f} s"


def wrongly_listed(results: Sequence[Result], listed: Listed) -> list[str]:
    """Listed mutants that a test does notice."""
    return [f"{result.mutant.text()}\n    is {result.outcome} by {result.by or 'the compiler'}" for result in results
            if listed.reason(result.mutant) is not None and result.found]  # fmt: skip


def write_csv(path: Path, results: Iterable[tuple[Result, str]]) -> None:
    """Every mutant with its outcome."""
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("file", "line", "function", "operator", "before", "after", "outcome", "test", "cpu_s"))
        for result, outcome in results:
            one = result.mutant
            rows.writerow((one.file, one.line, one.function, one.edit.operator, one.before, one.after, outcome,
                           result.by, result.cpu_s))  # fmt: skip
