# SPDX-License-Identifier: Apache-2.0
"""Facts beside the code: bounds of loops, lengths of copies, modes of operation (hal/s32k144/wcet.toml).

Every loop that a handler reaches must have a bound. tests/target/s32k144/test_wcet.py compares the bounds with what the
emulated drive executes.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fluxtrue_tools.bench.build import ROOT
from fluxtrue_tools.bench.disassembly import plain
from fluxtrue_tools.wcet.lines import Line, Statement
from fluxtrue_tools.wcet.loops import Loop

FILE = ROOT / "hal" / "s32k144" / "wcet.toml"


@dataclass(frozen=True)
class Passes:
    """The most passes through a loop each time it is entered: a number, or one for so many bytes of a copy."""

    most: int = 0
    each_bytes: int = 0

    def of(self, copied: int) -> int:
        return -(-copied // self.each_bytes) if self.each_bytes else self.most


@dataclass
class Facts:
    """The annotations of one mode of operation, and which of them have been used."""

    loops: Mapping[str, Passes]
    copies: Mapping[str, int]
    absent: frozenset[str] = frozenset()
    used: set[str] = field(default_factory=set)

    def passes(self, loop: Loop, statement: Statement | None, line: Line | None) -> Passes | None:
        """The annotation of a loop: by its statement or, in code without source, by function and line."""
        if statement is None:
            name, rest = plain(loop.function), str(line.number if line else "")
        else:
            name, rest = statement.function, statement.text
        found = [key for key in self.loops if _matches(key, name, rest)]
        if not found:
            return None
        key = max(found, key=len)  # the most specific one
        self.used.add(key)
        return self.loops[key]

    def copied(self, function: str) -> int | None:
        """The most bytes that a copy in this function of the source may have."""
        if function in self.copies:
            self.used.add(function)
        return self.copies.get(function)

    def unused(self) -> list[str]:
        return sorted({*self.loops, *self.copies} - self.used)


def _matches(key: str, name: str, rest: str) -> bool:
    function, colon, text = key.partition(": ")
    return function == name and (not colon or rest.startswith(text))


def _passes(value: Any) -> Passes:
    return Passes(each_bytes=value["bytes"]) if isinstance(value, dict) else Passes(most=value)


def load(path: Path = FILE) -> dict[str, Any]:
    """The file as it is."""
    with path.open("rb") as file:
        return tomllib.load(file)


def modes(data: Mapping[str, Any]) -> dict[str, Facts]:
    """For each mode of operation what holds in it; the first, 'anything', has no exclusions."""
    elsewhere = data.get("loops_of_other_images", {})
    loops = {key: _passes(value) for key, value in (data["loops"] | elsewhere).items()}
    always = frozenset(data["absent"])
    found = {"anything": Facts(loops, data["copies"], always)}
    for name, mode in data.get("modes", {}).items():
        own = {key: _passes(value) for key, value in mode.get("loops", {}).items()}
        found[name] = Facts(loops | own, data["copies"], always | frozenset(mode["absent"]))
    return found
