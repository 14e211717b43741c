# SPDX-License-Identifier: Apache-2.0
"""From the loops of an image to the loop statements of the C source, by the line table of the debugging data."""

from __future__ import annotations

import bisect
import functools
import os
import re
from dataclasses import dataclass
from pathlib import Path

from elftools.elf.elffile import ELFFile

from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.wcet.flow import Flow
from fluxtrue_tools.wcet.loops import Loop

_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])'", re.DOTALL)
_KEYWORD = re.compile(r"\b(for|while|do)\b")
_ATTRIBUTE = re.compile(r"__attribute__\(\([^\n]*?\)\)")
_HEAD = re.compile(r"^[A-Za-z_][^;={}()]*?\b(\w+)\(", re.MULTILINE)


@dataclass(frozen=True, order=True)
class Line:
    """A line of a source file; `file` as the compiler was given it."""

    file: str
    number: int


@dataclass(frozen=True)
class Statement:
    """A loop statement: its function, first and last line, and the line that holds its condition, as text."""

    file: str
    function: str
    first: int
    last: int
    head: int
    text: str


class Lines:
    """Address to source line."""

    def __init__(self, rows: list[tuple[int, int, Line]]) -> None:
        self._rows = sorted(rows)
        self._begins = [row[0] for row in self._rows]

    @classmethod
    def read(cls, elf: Path) -> Lines:
        rows: list[tuple[int, int, Line]] = []
        with elf.open("rb") as file:
            data = ELFFile(file).get_dwarf_info()
            for unit in data.iter_CUs():
                program = data.line_program_for_CU(unit)
                if program is not None:
                    folder = unit.get_top_DIE().attributes.get("DW_AT_comp_dir")
                    rows += _rows(program, folder.value.decode() if folder else "")
        return cls(rows)

    def at(self, address: int) -> Line | None:
        k = bisect.bisect_right(self._begins, address) - 1
        if k >= 0 and address < self._rows[k][1]:
            return self._rows[k][2]
        return None


def _name(program, compiled_in: str, number: int) -> str:  # type: ignore[no-untyped-def]
    fifth = program["version"] >= 5
    entry = program["file_entry"][number if fifth else number - 1]
    folders = program["include_directory"]
    place = entry.dir_index if fifth else entry.dir_index - 1
    folder = folders[place].decode() if place >= 0 else ""
    return _in_checkout(os.path.normpath(Path(compiled_in, folder, entry.name.decode())))


def _in_checkout(path: str) -> str:
    """The file of this checkout, also if a compiler cache has given the object of another one."""
    parts = Path(path).parts
    for folder in (name for name in ("firmware", "hal") if name in parts):
        here = ROOT.joinpath(*parts[len(parts) - 1 - parts[::-1].index(folder) :])
        if here.is_file():
            return str(here)
    return path


def _rows(program, compiled_in: str) -> list[tuple[int, int, Line]]:  # type: ignore[no-untyped-def]
    rows = []
    names: dict[int, str] = {}
    before = None
    for entry in program.get_entries():
        state = entry.state
        if state is None:
            continue
        if before is not None and before[0] < state.address:
            rows.append((before[0], state.address, before[1]))
        if state.file not in names:
            names[state.file] = _name(program, compiled_in, state.file)
        before = None if state.end_sequence else (state.address, Line(names[state.file], state.line))
    return rows


def _blank(match: re.Match[str]) -> str:
    return re.sub(r"[^\n]", " ", match.group())


def _plain(source: str) -> str:
    """The source with blanks for comments, literals and attributes."""
    return _ATTRIBUTE.sub(_blank, _COMMENT.sub(_blank, source))


def _closing(text: str, at: int, pair: str) -> int:
    """The place of the bracket that closes the one at `at`."""
    depth = 0
    for k in range(at, len(text)):
        depth += (text[k] == pair[0]) - (text[k] == pair[1])
        if depth == 0:
            return k
    return len(text) - 1


def _end(text: str, at: int) -> int:
    """Where the statement that begins at or after `at` ends."""
    begin = at + len(text[at:]) - len(text[at:].lstrip())
    if text[begin : begin + 1] == "{":
        return _closing(text, begin, "{}")
    if word := re.match(r"(for|while|if|switch)\b\s*", text[begin:]):
        return _end(text, _closing(text, begin + word.end(), "()") + 1)
    end = text.find(";", begin)
    return end if end >= 0 else len(text) - 1


def statements(file: str, source: str) -> list[Statement]:
    """The loop statements of a C file."""
    text = _plain(source)
    lines = source.splitlines()
    heads = [(m.start(), m.group(1)) for m in _HEAD.finditer(text)]
    found: list[Statement] = []
    closings: set[int] = set()

    def line(at: int) -> int:
        return text.count("\n", 0, at) + 1

    def add(first: int, last: int, head: int) -> None:
        function = next((name for at, name in reversed(heads) if at <= first), "")
        found.append(Statement(file, function, line(first), line(last), line(head), lines[line(head) - 1].strip()))

    for word in _KEYWORD.finditer(text):
        if word.group() == "do":
            close = _end(text, word.end())
            condition = text.index("while", close)
            closings.add(condition)
            add(word.start(), text.index(";", condition), condition)
        elif word.start() not in closings:
            add(word.start(), _end(text, _closing(text, text.index("(", word.start()), "()") + 1), word.start())
    return found


def _source(file: str) -> str:
    """The text of a C file; empty if there is no such file, for example for code of the compiler itself."""
    path = Path(file)
    return path.read_text(encoding="utf-8") if path.is_file() and path.suffix in (".c", ".h") else ""


@functools.cache
def _heads(file: str) -> tuple[tuple[int, str], ...]:
    """Line and name of each function of a file."""
    text = _plain(_source(file))
    return tuple((text.count("\n", 0, head.start()) + 1, head.group(1)) for head in _HEAD.finditer(text))


@functools.cache
def _of_file(file: str) -> tuple[Statement, ...]:
    return tuple(statements(file, _source(file)))


def function_at(line: Line) -> str:
    """The function of the source that the line is in."""
    return next((name for begin, name in reversed(_heads(line.file)) if begin <= line.number), "")


class Statements:
    """The statements that the loops of one function of the image were compiled from.

    The one whose condition the loop's own code evaluates; because code of other loops may have been moved there, first
    one whose condition stands where the loop goes back, then one around such a place, then one of the header, and of
    several the outermost. A statement belongs to the innermost of the loops that could be it.
    """

    def __init__(self, flow: Flow, loops: list[Loop], lines: Lines) -> None:
        self._flow, self._lines = flow, lines
        self.of: dict[int, Statement | None] = {}
        for loop in sorted(loops, key=lambda one: len(one.blocks)):
            inner = [self.of[one.header] for one in loop.inner]
            self.of[loop.header] = self._find(loop, [s for s in inner if s is not None])

    def _at(self, blocks: set[int]) -> set[Line]:
        places = (self._lines.at(i.address) for b in blocks for i in self._flow.blocks[b].instructions)
        return {place for place in places if place is not None}

    def _find(self, loop: Loop, inner: list[Statement]) -> Statement | None:
        ends = (self._lines.at(self._flow.blocks[b].instructions[-1].address) for b in loop.latches)
        latches = {place for place in ends if place is not None}
        header = self._at({loop.header})
        own = self._at(loop.own()) | latches
        candidates = [s for place in own for s in _of_file(place.file) if s.head == place.number]

        def rank(candidate: Statement) -> tuple[int, int]:
            head = Line(candidate.file, candidate.head)
            around = any(p.file == candidate.file and candidate.first <= p.number <= candidate.last for p in latches)
            order = 0 if head in latches else 1 if around else 2 if head in header else 3
            return order, candidate.first - candidate.last

        free = [c for c in candidates if c not in inner]
        return min(free, key=rank, default=None) or self._around(latches, inner) or next(iter(inner), None)

    @staticmethod
    def _around(latches: set[Line], inner: list[Statement]) -> Statement | None:
        """The innermost statement around the end of a loop whose condition has no code of its own, or around the
        statements of the loops within it."""
        places = [(p.file, p.number, p.number) for p in latches] + [(s.file, s.first, s.last) for s in inner]
        around = [s for file, first, last in places for s in _of_file(file)
                  if s.first <= first and last <= s.last and s not in inner]  # fmt: skip
        return min(around, key=lambda s: s.last - s.first, default=None)
