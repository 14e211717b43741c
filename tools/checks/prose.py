# SPDX-License-Identifier: Apache-2.0
"""Prose of the Markdown pages: width of the lines and of the cells of tables. Code, equations, tables, the targets of
links and comments are exempt."""

import re
from collections.abc import Iterator
from pathlib import Path

from tree import Violation

MAX_COLUMNS = 120
# A cell holds a phrase; whole sentences stand below the table.
MAX_CELL = 130

LINK_TARGET = re.compile(r"\]\([^()\s]*\)")
MARK = re.compile(r"<!--.*?-->")
MARKER = re.compile(r"^\s*(?:[-*+]|\d+\.)?\s*")
IMAGE = re.compile(r"\s*!\[[^\]]*\]\([^)]*\)\s*")


def visible(line: str) -> str:
    """The line as a reader sees it: without the targets of its links and the marks of its figures."""
    return MARK.sub("", LINK_TARGET.sub("]", line))


def fences(text: list[str]) -> Iterator[tuple[int, str]]:
    """Numbered lines outside of fenced code."""
    fenced = False
    for number, line in enumerate(text, start=1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def prose(text: list[str]) -> Iterator[tuple[int, str]]:
    """Numbered lines that are neither code, nor equations, nor rows of a table."""
    equation = code = False
    before = ""
    last = 0
    for number, line in fences(text):
        starts_block = not before.strip() or code or number != last + 1
        before, last = line, number
        if line.strip() == "$$":
            equation = not equation
        elif not equation:
            # An indented line is code only after a blank one; otherwise it continues a paragraph.
            code = line.startswith("    ") and starts_block
            if not code and not line.startswith("|"):
                yield number, line


def breakable(line: str) -> bool:
    """A line of several words: a single link, with or without a bullet, cannot be made narrower."""
    return " " in visible(MARKER.sub("", line))


def widest_cell(line: str) -> int:
    """Columns of the widest cell of a table's row."""
    return max((len(cell.strip()) for cell in visible(line).split("|")), default=0)


def check_markdown(path: Path, text: list[str]) -> Iterator[Violation]:
    """Everything about one page."""
    for number, line in fences(text):
        if line.startswith("|") and (width := widest_cell(line)) > MAX_CELL:
            yield Violation(path, number, f"{width} columns in a cell, at most {MAX_CELL}")
    for number, line in prose(text):
        if len(line) > MAX_COLUMNS and not IMAGE.fullmatch(line) and breakable(line):
            yield Violation(path, number, f"{len(line)} columns of prose, at most {MAX_COLUMNS}")
