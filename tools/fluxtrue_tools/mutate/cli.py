# SPDX-License-Identifier: Apache-2.0
"""fluxtrue mutate: do the unit tests notice small errors in the firmware?"""

import os
import random
import shutil
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.mutate import listed as lists
from fluxtrue_tools.mutate import page, score
from fluxtrue_tools.mutate.changed import changed as files_changed
from fluxtrue_tools.mutate.listed import Listed
from fluxtrue_tools.mutate.mutant import Mutant
from fluxtrue_tools.mutate.operators import mutants
from fluxtrue_tools.mutate.programs import Build, build_folder
from fluxtrue_tools.mutate.run import SURVIVED, UNTESTED, Baseline, Kept, Measurement, Result, Source
from fluxtrue_tools.sim.build import ROOT

SHARE_MIN = 0.95  # of the found mutants outside of the parts in which all must be found


class Campaign:
    """The measurement of some files."""

    def __init__(self, root: Path, build: Build, listed: Listed, fresh: bool, jobs: int) -> None:
        self.root, self.build, self.listed, self.fresh, self.jobs = root, build, listed, fresh, jobs
        self.folder = root / "build" / "mutate"
        self.baseline = Baseline(Kept(self.folder / "tests.jsonl", fresh))
        self.equal: set[tuple[str, str]] = set()
        self.results: list[Result] = []

    def measure(self, file: str, chosen: Sequence[Mutant], every: Sequence[Mutant],
                only_known: bool = False) -> list[Result]:  # fmt: skip
        """The outcomes of the chosen ones of a file's mutants, or those that are kept."""
        work = self.folder / "work" / str(os.getpid()) / file  # another measurement may be under way
        source = Source(self.build, file, work, self.baseline)
        kept = Kept(self.kept(file), self.fresh)
        measurement = Measurement(source, kept)
        results = measurement.known(chosen) if only_known else list(measurement.all(chosen, self.jobs))
        if any(result.outcome in (SURVIVED, UNTESTED) for result in results):
            self._compile_listed(source, every)
        shutil.rmtree(self.folder / "work" / str(os.getpid()), ignore_errors=True)
        self.results += results
        return results

    def kept(self, file: str) -> Path:
        """Where a file's outcomes are kept."""
        return self.folder / "outcomes" / f"{file.replace('/', '-')}.jsonl"

    def _compile_listed(self, source: Source, every: Sequence[Mutant]) -> None:
        """A survivor with the object of a listed mutant is the same."""
        for mutant in every:
            if self.listed.reason(mutant) is not None:
                made = source.compile(mutant.edit.apply(source.text), source.work / "listed")
                self.equal.update([(source.file, made[1])] if made is not None else [])

    def classified(self) -> list[tuple[Result, str]]:
        """All results with what they count as."""
        return [(result, score.classified(result, self.listed, self.equal)) for result in self.results]


def _chosen(listed: Listed, names: Sequence[str], strict: bool, changes: bool, base: str) -> list[str]:
    files = lists.sources(ROOT, names)
    if changes:
        differing = files_changed(ROOT, base, files)
        if differing is None and not strict:
            raise FluxtrueError(f"--base {base}: git knows no merge base with it")
        if differing:
            return differing
        if not strict:
            return []
    return [file for file in files if listed.is_strict(file)] if strict else files


def _sample(found: dict[str, list[Mutant]], number: int | None, seed: int) -> dict[str, list[Mutant]]:
    """All, or so many of all files together."""
    every = [mutant for of_file in found.values() for mutant in of_file]
    if number is None or number >= len(every):
        return found
    names = {mutant.name for mutant in random.Random(seed).sample(every, number)}
    return {file: [one for one in of_file if one.name in names] for file, of_file in found.items()}


def _sample_each(found: dict[str, list[Mutant]], number: int, seed: int, listed: Listed) -> dict[str, list[Mutant]]:
    """So many of each part: the same ones whichever other parts are measured."""
    parts: dict[str, dict[str, list[Mutant]]] = {}
    for file, of_file in found.items():
        parts.setdefault(listed.part(file), {})[file] = of_file
    chosen: dict[str, list[Mutant]] = {}
    for part in parts.values():
        chosen |= _sample(part, number, seed)
    return chosen


def _made(every: dict[str, list[Mutant]], listed: Listed) -> Counter[str]:
    """Numbers of mutants by part."""
    made: Counter[str] = Counter()
    for file, found in every.items():
        made[listed.part(file)] += len(found)
    return made


def _report(campaign: Campaign, every: dict[str, list[Mutant]], excluded: Counter[str], whole: bool) -> int:
    rows = campaign.classified()
    missed = [(result, outcome) for result, outcome in rows if outcome in (SURVIVED, UNTESTED)]
    for result, outcome in missed:
        click.echo(f"{outcome.upper()}: {result.mutant.text()}")
    wrong = score.wrongly_listed(campaign.results, campaign.listed)
    for text in wrong:
        click.echo(f"LISTED AS EQUIVALENT: {text}")
    found = score.scores(rows, campaign.listed)
    click.echo("\n".join(score.table(found)))
    if not whole:
        click.echo(f"estimate: {score.estimate(found, _made(every, campaign.listed))}")
    for reason, number in excluded.most_common():
        click.echo(f"left out: {number:6} {reason}")
    score.write_csv(campaign.folder / "mutants.csv", rows)
    strict = sum(campaign.listed.is_strict(result.mutant.file) for result, _ in missed)
    others = score.Score(Counter(outcome for result, outcome in rows
                                 if not campaign.listed.is_strict(result.mutant.file)))  # fmt: skip
    if strict or wrong or (whole and others.share < SHARE_MIN):
        click.echo(f"{strict} survivors where none may be, {len(wrong)} wrongly listed, {others.share:.1%} found "
                   f"of the others, at least {SHARE_MIN:.0%} wanted")  # fmt: skip
        return 1
    return 0


def _write_page(campaign: Campaign, every: dict[str, list[Mutant]], excluded: Counter[str]) -> int:
    """What is known of all files."""
    for file, found in every.items():
        if campaign.kept(file).is_file():
            campaign.measure(file, found, found, only_known=True)
    text = page.write(score.scores(campaign.classified(), campaign.listed), _made(every, campaign.listed), excluded,
                      campaign.listed)  # fmt: skip
    (ROOT / page.PAGE).write_text(text, encoding="utf-8")
    return 0


def check(listed: Listed, found: dict[str, list[Mutant]]) -> None:
    """Refuse a list that names what is no mutant."""
    stale = listed.stale([mutant for of_file in found.values() for mutant in of_file])
    if stale:
        raise FluxtrueError(f"{lists.FILE}: no such mutant: {'; '.join(stale)}")


def _print(every: dict[str, list[Mutant]]) -> int:
    for mutant in (one for of_file in every.values() for one in of_file):
        click.echo(mutant.text())
    return 0


def _measure(campaign: Campaign, every: dict[str, list[Mutant]], sampled: dict[str, list[Mutant]]) -> None:
    for file, chosen in sampled.items():
        if chosen:
            results = campaign.measure(file, chosen, every[file])
            missed = sum(result.outcome in (SURVIVED, UNTESTED) for result in results)
            click.echo(f"{file}: {len(chosen)} mutants, {missed} survived", err=True)


@click.command(cls=paths.Command)
@click.argument("names", nargs=-1, type=kinds.Text())
@click.option("--strict", is_flag=True, help="Only the parts in which no mutant may survive.")
@click.option("--changed", "changes", is_flag=True,
              help="Only files that differ from --base; with --strict, if there are none, those parts.")  # fmt: skip
@click.option("--base", type=kinds.Text(), default="main", show_default=True, help="The branch to compare with.")
@click.option("--sample", type=click.IntRange(1, 1_000_000), help="So many mutants only, chosen at random.")
@click.option("--each", is_flag=True, help="The --sample is that of each part, not of all together.")
@click.option("--seed", type=click.IntRange(0, 2**31), default=1, show_default=True, help="Of the choice.")
@click.option("--jobs", type=click.IntRange(1, 256), default=1, show_default=True, help="Mutants at the same time.")
@click.option("--fresh", is_flag=True, help="Measure again what is known.")
@click.option("--as-built", is_flag=True, help="Do not bring the unit tests of build/host up to date first.")
@click.option("--list", "only_list", is_flag=True,
              help="Print the mutants, and check that the listed ones are among them.")  # fmt: skip
@click.option("--page", "only_page", is_flag=True, help="Write docs/safety/mutation.md from what is known.")
def mutate(names: tuple[str, ...], strict: bool, changes: bool, base: str, sample: int | None, each: bool, seed: int,
           jobs: int, fresh: bool, as_built: bool, only_list: bool, only_page: bool) -> int:  # fmt: skip
    """Make small errors in C sources of the firmware, one at a time, and see which of them no unit test notices.

    NAMES: sources, folders or globs; all of the firmware if there are none. Outcomes are kept below build/mutate by the
    content of source and tests, so that a measurement that was stopped continues. Ends with exit code 1 if an error
    survives where docs/safety/mutation.toml allows none, or, measured completely, too many elsewhere.
    """
    if not changes:
        paths.refuse_given("without --changed", "base")
    if sample is None:
        paths.refuse_given("without --sample", "seed", "each")
    listed = lists.load(ROOT)
    files = _chosen(listed, names, strict, changes, base)
    build = None if only_list else Build(ROOT, build_folder(ROOT))
    made = {file: mutants(ROOT, file) for file in files}
    every = {file: found for file, (found, _) in made.items()}
    excluded = sum((counted for _, counted in made.values()), Counter[str]())
    check(listed, every)
    if build is None:
        return _print(every)
    if not as_built:
        build.make(build.programs, jobs)
    campaign = Campaign(ROOT, build, listed, fresh, jobs)
    if only_page:
        return _write_page(campaign, every, excluded)
    sampled = _sample_each(every, sample, seed, listed) if each and sample else _sample(every, sample, seed)
    _measure(campaign, every, sampled)
    return _report(campaign, every, excluded, whole=sample is None)
