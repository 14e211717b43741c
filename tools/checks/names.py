# SPDX-License-Identifier: Apache-2.0
"""What the pages name exists: targets of links, paths, source files, functions, types and their fields."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from prose import fences
from tree import Violation, files, lines, run

LINK = re.compile(r"\]\(([^)\s#]+)(?:#[^)]*)?\)")
CODE = re.compile(r"`([^`]+)`")
REMOTE = re.compile(r"[a-z]+:")
PATH = re.compile(r"(?:firmware|hal|tests|tools|docs)/[\w./*-]+")
FILE = re.compile(r"[\w-]+\.(?:c|h|py)")
FUNCTION = re.compile(r"(\w+)\(\)")
FIELD = re.compile(r"(\w+_t)(?:\.(\w+))?")
TYPE = re.compile(
    r"typedef (?:struct|union|enum) ?\w*\s*\{((?:[^{}]|\{[^{}]*\})*)\}\s*(\w+_t);|typedef [^{};]*?\b(\w+_t);"
)
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
WORD = re.compile(r"\b\w+(?=\s*\()")
SOURCES = (".c", ".h", ".py", ".in", ".js")
STANDARD = {"int16_t", "int32_t", "int64_t", "uint8_t", "uint16_t", "uint32_t", "uint64_t", "size_t"}
# Written by the build, or an example of a reader's own.
ELSEWHERE = ("motor_si.c", "hal/acme/")
# Pages that mention names of the past.
PAST = {Path("CHANGELOG.md")}
PAST_FOLDER = Path("docs/decisions")


class Tree:
    """The names that exist in a checkout, and that a page may therefore use."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.files = {path.name for path in files(root)}
        self.functions: set[str] = set()
        self.fields: dict[str, set[str]] = {}
        for path in files(root, *SOURCES):
            text = "\n".join(lines(root, path))
            self.functions.update(WORD.findall(text))
            if path.suffix == ".h":
                self._add_types(COMMENT.sub("", text))

    def _add_types(self, text: str) -> None:
        for body, name, alias in TYPE.findall(text):
            self.fields.setdefault(name or alias, set()).update(re.findall(r"\w+", body))

    def has_field(self, name: str, field: str) -> bool:
        """A type, and a field of it if one is named. Types of the C standard have none."""
        return name in STANDARD or (name in self.fields and (not field or field in self.fields[name]))

    def has_path(self, name: str) -> bool:
        """A file or folder, or a pattern that fits one."""
        found = self.root.glob(name.rstrip("/")) if "*" in name else [self.root / name]
        return any(path.exists() for path in found)


def link_problems(tree: Tree, path: Path, line: str) -> Iterator[str]:
    """Targets inside the project that do not exist."""
    for target in LINK.findall(line):
        if not REMOTE.match(target) and not (tree.root / path.parent / target).exists():
            yield f"the link leads nowhere: {target}"


def name_problems(tree: Tree, line: str) -> Iterator[str]:
    """Paths, files and functions in code spans that do not exist."""
    for code in CODE.findall(line):
        if code.startswith(ELSEWHERE):
            continue
        if PATH.fullmatch(code):
            if not tree.has_path(code):
                yield f"there is no {code}"
        elif FILE.fullmatch(code):
            if code not in tree.files:
                yield f"there is no file {code}"
        elif (match := FUNCTION.fullmatch(code)) and match.group(1) not in tree.functions:
            yield f"there is no function {code}"
        elif (match := FIELD.fullmatch(code)) and not tree.has_field(match.group(1), match.group(2) or ""):
            yield f"there is no {code}"


def check(root: Path) -> Iterator[Violation]:
    """All pages."""
    tree = Tree(root)
    for path in files(root, ".md"):
        is_past = path in PAST or path.is_relative_to(PAST_FOLDER)
        for number, line in fences(lines(root, path)):
            problems = list(link_problems(tree, path, line))
            problems += [] if is_past else name_problems(tree, line)
            yield from (Violation(path, number, problem) for problem in problems)


if __name__ == "__main__":
    sys.exit(run(check, "names"))
