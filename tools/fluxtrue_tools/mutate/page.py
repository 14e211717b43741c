# SPDX-License-Identifier: Apache-2.0
"""docs/safety/mutation.md: what has been measured, written from the kept outcomes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from fluxtrue_tools.mutate.listed import Listed, Sample
from fluxtrue_tools.mutate.run import DUPLICATE, EQUIVALENT, INVALID, KILLED, SURVIVED, TIMED_OUT, UNTESTED
from fluxtrue_tools.mutate.score import LISTED, Score

PAGE: Final = Path("docs", "safety", "mutation.md")
HEAD: Final = """# Mutation of the firmware

<!-- Written by `tools/fluxtrue mutate --page` from the outcomes that are kept below build/mutate. -->

Coverage shows what the unit tests execute, not what they assert. `tools/fluxtrue mutate` makes small errors in the C
sources of the firmware, one at a time: another relation (`<` to `<=` and `>=`, `==` to `!=`), `&&` to `||`, one operand
of a conjunction or disjunction alone, a negation left out, other arithmetic, shifts and bit operations, a constant one
larger or 0 (a fraction nine tenths, or 0), a condition that is always or never true, a statement deleted, a returned or
initial value 0, an element of a structure 0, a row of a table left out. Each mutant is compiled as the build compiles
its source, linked into each unit test that contains the source, and run; a unit test that compiles the source with
other definitions gets an object of its own. It is found if a test fails, or needs four times its time of a processor. A
mutant whose objects equal those of the source is no error (equivalent); one that equals another mutant counts once.
Header files are not mutated, nor are closed loops used to find mutants.

The parts in which every mutant must be found, and the survivors that are no errors, one by one with the reason, are in
[mutation.toml](mutation.toml).
"""
COLUMNS: Final = (KILLED, TIMED_OUT, LISTED, SURVIVED, UNTESTED, EQUIVALENT, DUPLICATE, INVALID)


def write(scores: Mapping[str, Score], made: Mapping[str, int], excluded: Counter[str], listed: Listed) -> str:
    """The page: of each part, how many mutants there are, how many were measured, and what became of them."""
    strict = {part.name for part in listed.content.strict}
    ordered = [name for name in scores if name in strict] + [name for name in scores if name not in strict]
    text = [HEAD, f"| part | mutants | measured | {' | '.join(COLUMNS)} | found |", "|---" * (len(COLUMNS) + 4) + "|"]
    text += [_row(name, scores[name], made[name], name in strict) for name in ordered]
    rest = sum(number for name, number in made.items() if name not in scores)
    text += [f"| all others | {rest} | 0 |{'  |' * (len(COLUMNS) + 1)}"] if rest else []
    text += ["", "*Found* is the share of those that are errors: not of equivalent, duplicate, listed and invalid ones",
             "(which do not compile). What is not measured completely is a random sample. Bold: none may survive.",
             ""]  # fmt: skip
    text += _samples(listed.content.sample) if listed.content.sample else []
    text += ["Left out of the sources, by places:", ""]
    text += [f"- {number}: {reason}" for reason, number in excluded.most_common()]
    return "\n".join(text) + "\n"


def _samples(samples: Sequence[Sample]) -> list[str]:
    """Random samples as they were found, because those of the table above have been mended since."""
    parts = list(dict.fromkeys(part for sample in samples for part in sample.found))
    seeds = " | ".join(f"seed {sample.seed}" for sample in samples)
    text = ["For some survivors of the random samples tests have been written since, and some are listed: the table",
            "above is therefore better than the firmware as a whole. What each sample showed when it was measured",
            "first, found of all errors without what is listed now:", "",
            f"| part | {seeds} |", "|---" + "|---" * len(samples) + "|"]  # fmt: skip
    for part in parts:
        cells = [_share(*sample.found[part]) if part in sample.found else "" for sample in samples]
        text.append(f"| `{part}` | {' | '.join(cells)} |")
    totals = [_share(*map(sum, zip(*sample.found.values(), strict=True))) for sample in samples]
    return [*text, f"| all of these | {' | '.join(totals)} |", ""]


def _share(found: int, errors: int) -> str:
    return f"{found} of {errors}, {100.0 * found / errors:.1f} %"


def _row(name: str, score: Score, made: int, strict: bool) -> str:
    numbers = " | ".join(str(score.numbers[column]) for column in COLUMNS)
    shown = f"**{name}**" if strict else f"`{name}`"
    share = f"{100.0 * score.share:.1f} %" if score.errors else ""
    return f"| {shown} | {made} | {sum(score.numbers.values())} | {numbers} | {share} |"
