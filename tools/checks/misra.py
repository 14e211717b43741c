# SPDX-License-Identifier: Apache-2.0
"""Rules of MISRA C:2012 that the add-on of Cppcheck implements, against the deviations in docs/safety/misra.toml.

    misra.py BUILD [FILE ...]     check firmware/ (BUILD holds the generated headers), or only what concerns the files
    misra.py BUILD --write        make docs/safety/misra.md

Every finding needs an entry that covers it; an entry that covers nothing is an error. Files given by name are read
without the rules that span files, and without the question whether an entry is used.
"""

import argparse
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from misra_deviations import Entry, Rules, read, rule_key
from misra_page import page
from misra_run import Analysis, Finding, analyse, implemented
from tree import PROJECT, Violation, lines, report

SOURCE: Final = Path("docs/safety/misra.toml")
PAGE: Final = Path("docs/safety/misra.md")
# What the target's compiler defines. The portable half of fx is seen without the instructions of the Cortex-M4.
TARGET: Final = ("FLUXTRUE_MRAI=1", "__arm__=1", "__ARM_FEATURE_DSP=1")
PORTABLE: Final = ("FLUXTRUE_MRAI=1", "__arm__=1")
# Generated code and the headers of others are read, but only findings below these folders count.
OURS: Final = ("firmware/", "hal/")


@dataclass(frozen=True)
class Tree:
    """Where the checkout and its generated headers are, and how many processes may work."""

    root: Path
    generated: Path
    jobs: int

    def found(self, macros: tuple[str, ...], paths: Sequence[Path], spanning: bool) -> set[Finding]:
        """What the add-on reports of files."""
        include = (self.root / "firmware", self.root, self.generated)
        return analyse(Analysis(self.root, include, macros, self.jobs), paths, spanning)


def findings(tree: Tree, chosen: Sequence[Path]) -> list[Finding]:
    """What the add-on reports in the project's files; with all files, also by the rules that span them."""
    paths = sorted(chosen or (tree.root / "firmware").rglob("*.c"))
    portable = [path for path in paths if path.is_relative_to(tree.root / "firmware" / "fx")]
    found = tree.found(TARGET, paths, not chosen) | tree.found(PORTABLE, portable, False)
    return sorted(one for one in found if one.path.startswith(OURS))


def allowed(rules: Rules, rule: str) -> str:
    """What the entries of a rule cover, for the message about a finding that none of them covers."""
    texts = [entry.scope() for entry in rules.entries if entry.rule == rule]
    return "; ".join(texts) if texts else "nothing"


def uncovered(root: Path, rules: Rules, found: Sequence[Finding], used: Counter[Entry]) -> Iterator[Violation]:
    """Findings without an entry; counts the findings of each entry."""
    texts: dict[str, list[str]] = {}
    for one in found:
        if one.rule in rules.disapplied:
            continue
        text = texts.setdefault(one.path, lines(root, Path(one.path)))
        line = text[one.line - 1] if 0 < one.line <= len(text) else ""
        entry = next((entry for entry in rules.entries if entry.covers(one, line)), None)
        if entry:
            used[entry] += 1
        else:
            category = rules.category.get(one.rule, "unknown")
            yield Violation(Path(one.path), one.line,
                            f"MISRA C:2012 rule {one.rule} ({category}); {SOURCE} allows it in: "
                            f"{allowed(rules, one.rule)}")  # fmt: skip


def stale(rules: Rules, found: Sequence[Finding], used: Counter[Entry]) -> Iterator[Violation]:
    """Entries, and rules that do not apply, of which there is no finding."""
    for entry in rules.entries:
        if not used[entry]:
            yield Violation(SOURCE, entry.number, f"rule {entry.rule}: no finding needs this entry ({entry.scope()})")
    seen = {one.rule for one in found}
    for rule in sorted(rules.disapplied.keys() - seen, key=rule_key):
        yield Violation(SOURCE, 0, f"rule {rule} need not be left out: there is no finding")


def check(tree: Tree, rules: Rules, chosen: Sequence[Path]) -> Iterator[Violation]:
    """The data, the findings, the entries, the page."""
    yield from rules.faults(SOURCE, implemented())
    found = findings(tree, chosen)
    used: Counter[Entry] = Counter()
    yield from uncovered(tree.root, rules, found, used)
    if chosen:
        return
    yield from stale(rules, found, used)
    if not (tree.root / PAGE).is_file() or "\n".join(lines(tree.root, PAGE)) + "\n" != page(rules):
        yield Violation(PAGE, 0, "not made from misra.toml: run misra.py BUILD --write")


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("--root", type=Path, default=PROJECT)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", action="store_true", help=f"make {PAGE}")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="default: every C file of firmware/")
    given = parser.parse_args()
    root = given.root.resolve()
    try:
        rules = read((root / SOURCE).read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, TypeError) as error:
        sys.exit(f"error: {SOURCE}: {error}")
    if given.write:
        (root / PAGE).write_text(page(rules), encoding="utf-8")
        return 0
    tree = Tree(root, given.build.resolve() / "generated", given.jobs)
    return report(check(tree, rules, [path.resolve() for path in given.files]), "MISRA C:2012")


if __name__ == "__main__":
    sys.exit(main())
