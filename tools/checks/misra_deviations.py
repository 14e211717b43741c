# SPDX-License-Identifier: Apache-2.0
"""The data of docs/safety/misra.toml: categories, rules that are left out, deviations, errors of the checker."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from misra_run import Finding
from tree import Violation

CATEGORIES: Final = ("mandatory", "required", "advisory")
REASON_MIN: Final = 20  # characters: a reason is a sentence


def rule_key(rule: str) -> tuple[int, ...]:
    """Rules in the order of their numbers."""
    return tuple(int(part) for part in rule.split("."))


@dataclass(frozen=True)
class Entry:
    """A deviation from a rule (`safe`: why it does no harm), or an error of the checker (`instead`: what finds it)."""

    rule: str
    reason: str
    line: str = ""
    files: tuple[str, ...] = ("*",)
    safe: str = ""
    instead: str = ""
    number: int = 0

    @property
    def of_tool(self) -> bool:
        """Whether the code obeys the rule and only the checker says otherwise."""
        return bool(self.instead)

    def covers(self, finding: Finding, line: str) -> bool:
        """Whether the finding is one of this entry's."""
        return (
            finding.rule == self.rule
            and any(fnmatchcase(finding.path, pattern) for pattern in self.files)
            and re.search(self.line, line) is not None
        )

    def scope(self) -> str:
        """Files and lines in one phrase."""
        where = "firmware and hal" if self.files == ("*",) else ", ".join(self.files)
        return f"{where}, lines with {self.line}" if self.line else where


@dataclass(frozen=True)
class Rules:
    """Everything the file says."""

    category: dict[str, str]
    disapplied: dict[str, str]
    entries: tuple[Entry, ...]

    @property
    def enabled(self) -> list[str]:
        """The rules that are checked."""
        return sorted(self.category.keys() - self.disapplied.keys(), key=rule_key)

    def faults(self, source: Path, implemented: set[str]) -> Iterator[Violation]:
        """What is wrong with the data itself."""
        for rule in sorted(implemented ^ self.category.keys(), key=rule_key):
            wrong = "has no category" if rule in implemented else "is not a rule of the add-on"
            yield Violation(source, 0, f"rule {rule} {wrong}")
        for rule, reason in self.disapplied.items():
            if self.category.get(rule) != "advisory":
                yield Violation(source, 0, f"rule {rule}: only an advisory rule may be left out")
            if len(reason) < REASON_MIN:
                yield Violation(source, 0, f"rule {rule}: left out without a reason")
        for entry in self.entries:
            yield from self._faults_of(source, entry)

    def _faults_of(self, source: Path, entry: Entry) -> Iterator[Violation]:
        category = self.category.get(entry.rule, "unknown")
        if entry.rule not in self.enabled:
            yield Violation(source, entry.number, f"rule {entry.rule} is not enabled")
        if len(entry.reason) < REASON_MIN:
            yield Violation(source, entry.number, f"rule {entry.rule}: no reason")
        if entry.of_tool == bool(entry.safe):
            either = "either `safe` (a deviation) or `instead` (an error of the checker)"
            yield Violation(source, entry.number, f"rule {entry.rule}: {either}")
        elif category == "mandatory" and not entry.of_tool:
            yield Violation(source, entry.number, f"rule {entry.rule} is mandatory: nothing may deviate from it")
        if entry.files == ("*",) and not entry.line:
            yield Violation(source, entry.number, f"rule {entry.rule}: an entry names files or text of the line")


def _entry(table: dict[str, Any], number: int) -> Entry:
    files = table.pop("files", ["*"])
    return Entry(**table, files=tuple(files), number=number)


def read(text: str) -> Rules:
    """The file; unknown keys are errors (TypeError)."""
    data = tomllib.loads(text)
    numbers = [number for number, line in enumerate(text.splitlines(), 1) if line.strip() == "[[entry]]"]
    entries = [_entry(table, number) for table, number in zip(data.pop("entry", []), numbers, strict=True)]
    category = {rule: name for name in CATEGORIES for rule in data.pop(name, [])}
    disapplied = {rule: one["reason"] for one in data.pop("disapplied", []) for rule in one["rules"]}
    if data:
        raise TypeError(f"unknown keys: {', '.join(data)}")
    return Rules(category, disapplied, tuple(entries))
