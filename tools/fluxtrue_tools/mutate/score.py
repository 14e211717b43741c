# SPDX-License-Identifier: Apache-2.0
"""Numbers of mutants by outcome, for each part of the firmware, and what is wrong with them."""

import csv
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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

NORMAL_95 = 1.96  # standard deviations
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


@dataclass(frozen=True)
class Estimate:
    """Found share of all errors, from random samples of the parts, with a confidence of 95 %."""

    share: float
    half_width: float

    def __str__(self) -> str:
        low, high = max(0.0, self.share - self.half_width), min(1.0, self.share + self.half_width)
        return f"{self.share:.1%} found, with a confidence of 95 % between {low:.1%} and {high:.1%}"


def estimate(found: Mapping[str, Score], made: Mapping[str, int]) -> Estimate:
    """Each part weighs what it has of errors: its mutants times the share of them that are errors in its sample.

    The variance is that of a stratified sample without replacement. A part without a survivor is given one of two more
    errors, because a sample in which all were found does not show that all are.
    """
    measured = {name: score for name, score in found.items() if score.errors}
    weights = {name: made[name] * score.errors / sum(score.numbers.values()) for name, score in measured.items()}
    whole = sum(weights.values())
    if not whole:
        return Estimate(1.0, 0.0)
    share, variance = 0.0, 0.0
    for name, score in measured.items():
        weight, errors = weights[name] / whole, score.errors
        assumed = (score.share * errors + 1.0) / (errors + 2.0)
        rest = 1.0 - sum(score.numbers.values()) / made[name]
        share += weight * score.share
        variance += weight**2 * rest * assumed * (1.0 - assumed) / errors
    return Estimate(share, NORMAL_95 * math.sqrt(variance))


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
