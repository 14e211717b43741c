# SPDX-License-Identifier: Apache-2.0
"""A mutant: one small error in a C source, and how it is named."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Edit:
    """A range of bytes of a source, and what replaces it."""

    start: int
    end: int
    text: str
    operator: str  # what kind of error it is

    def apply(self, source: bytes) -> bytes:
        """The source with the error; it has the same lines."""
        lost = source[self.start : self.end].count(b"\n") - self.text.count("\n")
        return source[: self.start] + self.text.encode() + b"\n" * lost + source[self.end :]


@dataclass(frozen=True)
class Mutant:
    """An edit, named by its function and by its lines before and after: independent of the number of the line.

    Equal edits of equal lines of one function are distinguished by their order.
    """

    file: str  # below the root
    function: str  # empty outside of functions
    before: str
    after: str
    order: int
    line: int  # the first is 1
    edit: Edit

    @property
    def name(self) -> tuple[str, str, str, str, int]:
        """What remains when lines move."""
        return self.file, self.function, self.before, self.after, self.order

    def text(self) -> str:
        """The description for a report."""
        where = f"{self.file}:{self.line} {self.function}".rstrip()
        return f"{where} ({self.edit.operator})\n    - {self.before}\n    + {self.after}"


def _one_line(source: bytes) -> str:
    return " ".join(source.decode(errors="replace").split())


def _lines(source: bytes, edit: Edit) -> tuple[str, str]:
    """The lines that an edit changes, before and after it, each as one line."""
    first = source.rfind(b"\n", 0, edit.start) + 1
    last = source.find(b"\n", edit.end)
    last = len(source) if last < 0 else last
    after = source[first : edit.start] + edit.text.encode() + source[edit.end : last]
    return _one_line(source[first:last]), _one_line(after)


def named(file: str, source: bytes, edits: Iterable[tuple[str, Edit]]) -> list[Mutant]:
    """Mutants from pairs of function and edit; an edit that another one repeats is left out."""
    seen: dict[tuple[str, str, str], int] = {}
    known: set[tuple[int, int, str]] = set()
    mutants = []
    for function, edit in edits:
        what = (edit.start, edit.end, edit.text)
        if what in known:
            continue
        known.add(what)
        before, after = _lines(source, edit)
        order = seen.get((function, before, after), 0)
        seen[function, before, after] = order + 1
        line = source.count(b"\n", 0, edit.start) + 1
        mutants.append(Mutant(file, function, before, after, order, line, edit))
    return mutants


def of_lines(mutants: Sequence[Mutant], lines: set[int]) -> list[Mutant]:
    """The mutants that begin in one of these lines."""
    return [mutant for mutant in mutants if mutant.line in lines]
