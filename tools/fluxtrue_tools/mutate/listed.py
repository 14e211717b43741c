# SPDX-License-Identifier: Apache-2.0
"""docs/safety/mutation.toml: parts of the firmware in which no mutant may survive, and survivors that are no errors.

An entry names a mutant by file, function and its lines before and after, so that it holds when lines move.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated, Final

from pydantic import Field

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.mutate.mutant import Mutant
from fluxtrue_tools.strict import Strict, parse, read_text

FILE: Final = Path("docs", "safety", "mutation.toml")
SOURCES: Final = ("firmware/*/*.c", "firmware/*/*/*.c")

ShortText = Annotated[str, Field(min_length=1, max_length=2000)]


class Part(Strict):
    """Files in which every mutant must be found or listed."""

    name: ShortText
    files: list[ShortText]  # globs; * matches / too


class Entry(Strict):
    """A mutant that no test can notice, and why."""

    file: ShortText
    function: str = ""
    before: ShortText
    after: list[Annotated[str, Field(max_length=2000)]]  # empty: the line is left out
    reason: ShortText


class Sample(Strict):
    """What a random sample has shown when it was measured first, before its survivors were evaluated."""

    seed: int
    found: dict[ShortText, Annotated[list[int], Field(min_length=2, max_length=2)]]  # part: found errors, errors


class List(Strict):
    """The file."""

    strict: list[Part] = Field(default_factory=list)
    equivalent: list[Entry] = Field(default_factory=list)
    sample: list[Sample] = Field(default_factory=list)


@dataclass(frozen=True)
class Listed:
    """What the file says of files and mutants."""

    content: List

    def is_strict(self, file: str) -> bool:
        """Whether no mutant of the file may survive."""
        return any(fnmatch(file, glob) for part in self.content.strict for glob in part.files)

    def part(self, file: str) -> str:
        """The file's part: that of the list, else its folder."""
        for part in self.content.strict:
            if any(fnmatch(file, glob) for glob in part.files):
                return part.name
        return str(Path(file).parent)

    def reason(self, mutant: Mutant) -> str | None:
        """Why a mutant is equivalent, if it is listed."""
        for entry in self.content.equivalent:
            place = (entry.file, entry.function, entry.before)
            if place == (mutant.file, mutant.function, mutant.before) and mutant.after in entry.after:
                return entry.reason
        return None

    def stale(self, mutants: Sequence[Mutant]) -> list[str]:
        """Entries that describe none of all mutants of their files."""
        files = {mutant.file for mutant in mutants}
        made = {(mutant.file, mutant.function, mutant.before, mutant.after) for mutant in mutants}
        return [f"{entry.file} {entry.function}: {after}" for entry in self.content.equivalent if entry.file in files
                for after in entry.after
                if (entry.file, entry.function, entry.before, after) not in made]  # fmt: skip


def load(root: Path) -> Listed:
    """The list of a checkout; an empty one if there is no such file."""
    path = root / FILE
    if not path.is_file():
        return Listed(List())
    listed = Listed(parse(List, read_text(path), str(FILE)))
    for entry in listed.content.equivalent:
        if not (root / entry.file).is_file():
            raise FluxtrueError(f"{FILE}: {entry.file}: there is no such file")
    return listed


def sources(root: Path, names: Sequence[str]) -> list[str]:
    """Sources of the firmware: all, or those that names, folders or globs choose."""
    every = sorted(str(path.relative_to(root)) for glob in SOURCES for path in root.glob(glob))
    if not names:
        return every
    chosen: set[str] = set()
    for name in names:
        plain = name.rstrip("/")
        found = [file for file in every if fnmatch(file, plain) or file.startswith(f"{plain}/")]
        if not found:
            raise FluxtrueError(f"{name}: no source of the firmware, allowed: one as firmware/safety/monitor.c, a "
                                "folder, or a glob")  # fmt: skip
        chosen.update(found)
    return sorted(chosen)
