# SPDX-License-Identifier: Apache-2.0
"""The unit tests of a build folder: which of them contain a source's object, and how they are compiled and linked.

The programs are those that the build has made. Nothing in the build folder is changed.
"""

import hashlib
import json
import os
import re
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile

from fluxtrue_tools.errors import FluxtrueError

LABEL: Final = "unit"
UNITY: Final = "unit_"  # names of tests of single parts
DEPENDENCIES: Final = {"-MD": 1, "-MMD": 1, "-MT": 2, "-MF": 2, "-MQ": 2}  # options and how many words they take
_GLOBAL: Final = re.compile(r"^[0-9a-f]+ [A-Z] (\S+)$", re.MULTILINE)  # of an object
_SYMBOL: Final = re.compile(r"^[0-9a-f]+ [A-Za-z] (\S+)$", re.MULTILINE)  # a hidden one is local in a program
_OBJECT: Final = re.compile(r"^[0-9a-f]+ a (\S+\.c)$", re.MULTILINE)


def _output(command: Sequence[str | Path], folder: Path) -> str:
    run = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        raise FluxtrueError(f"{folder}: {command[0]} failed: {(run.stderr or run.stdout).strip()[-300:]}")
    return run.stdout


@dataclass(frozen=True)
class Program:
    """A unit test."""

    name: str
    path: Path
    command: tuple[str, ...]
    folder: Path  # where it runs

    @cached_property
    def key(self) -> str:
        """A hash of what is loaded: neither debugging information nor the name of the build folder."""
        content = hashlib.sha256()
        with self.path.open("rb") as file:
            for section in ELFFile(file).iter_sections():
                if section["sh_flags"] & SH_FLAGS.SHF_ALLOC and section["sh_type"] != "SHT_NOTE":
                    content.update(section.data())
        return content.hexdigest()

    @cached_property
    def _symbols(self) -> str:
        return _output(["nm", "-a", self.path], self.folder)

    @cached_property
    def objects(self) -> set[str]:
        """Names of the sources whose objects it contains, without their folders."""
        return set(_OBJECT.findall(self._symbols))

    @cached_property
    def defined(self) -> set[str]:
        """The symbols that the program defines."""
        return set(_SYMBOL.findall(self._symbols))


@dataclass(frozen=True)
class Variant:
    """A way in which the build compiles a source, and the tests that contain this object."""

    compiler: tuple[str, ...]
    tests: tuple[Program, ...]
    own: str  # the object in a test's link command; empty: it is in the firmware's library


class Build:
    """A build folder of CMake and Ninja, with its tests."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.folder = root, folder
        self._linkers: dict[str, list[str]] = {}
        if not (folder / "compile_commands.json").is_file() or not (folder / "build.ninja").is_file():
            raise FluxtrueError(f"{folder}: no build with tests: run tools/test --quick once")

    @cached_property
    def programs(self) -> list[Program]:
        """All unit tests that are programs of this build."""
        listing = json.loads(_output(["ctest", "--show-only=json-v1", "-L", f"^{LABEL}$"], self.folder))
        tests = [test for test in listing["tests"] if test.get("command")]
        return [self._program(test) for test in tests if Path(test["command"][0]).is_relative_to(self.folder)]

    def _program(self, test: dict[str, Any]) -> Program:
        properties = {one["name"]: one["value"] for one in test.get("properties", ())}
        path = Path(test["command"][0])
        folder = Path(properties.get("WORKING_DIRECTORY", path.parent))
        return Program(test["name"], path, tuple(test["command"]), folder)

    def make(self, programs: Sequence[Program], jobs: int) -> None:
        """Bring the programs up to date."""
        targets = [str(program.path.relative_to(self.folder)) for program in programs]
        _output(["ninja", "-j", str(jobs), *targets], self.folder)

    @cached_property
    def _entries(self) -> list[dict[str, Any]]:
        entries: list[dict[str, Any]] = json.loads((self.folder / "compile_commands.json").read_text(encoding="utf-8"))
        return entries

    @cached_property
    def _commands(self) -> dict[Path, dict[str, Any]]:
        """The compiler's call for each source of the firmware's own libraries, or of the only target that has it."""
        found: dict[Path, dict[str, Any]] = {}
        for entry in self._entries:
            file = Path(entry["file"])
            own = file.is_relative_to(self.root) and f" -o {file.relative_to(self.root).parts[0]}/" in entry["command"]
            if own or file not in found:
                found[file] = entry
        return found

    def variants(self, file: str) -> list[Variant]:
        """The firmware's own way first, then those of unit tests that compile the source with other definitions."""
        entry = self._entry(file)
        found = [Variant(_compiler(entry), tuple(self.tests_of(file)), "")]
        by_target = {one.path.name: one for one in self.programs if one.name.startswith(UNITY)}
        for other in self._entries:
            made = _output_of(other)
            target = by_target.get(_target(made)) if other["file"] == entry["file"] and other is not entry else None
            if target is not None:
                found.append(Variant(_compiler(other), (target,), str(made)))
        return found

    def _entry(self, file: str) -> dict[str, Any]:
        entry = self._commands.get(self.root / file)
        if entry is None:
            raise FluxtrueError(f"{file}: not compiled in {self.folder}")
        return entry

    def tests_of(self, file: str) -> list[Program]:
        """The programs that contain the object of a source, the nearest by name first."""
        entry = self._entry(file)
        made = self.folder / _output_of(entry)
        exported = set(_GLOBAL.findall(_output(["nm", made], self.folder)))
        basename, parts = Path(file).name, set(Path(file).with_suffix("").as_posix().replace("/", "_").split("_"))

        def distance(program: Program) -> tuple[int, str]:
            return -len(parts & set(program.name.split("_"))), program.name

        able = [one for one in self.programs if basename in one.objects and exported <= one.defined]
        return sorted((one for one in able if _library(made) in map(_name, self.linker(one))), key=distance)

    def linker(self, program: Program) -> list[str]:
        """The call that links a program, without its output."""
        if program.name not in self._linkers:
            self._linkers[program.name] = self._read_linker(program)
        return self._linkers[program.name]

    def _read_linker(self, program: Program) -> list[str]:
        target = str(program.path.relative_to(self.folder))
        last = _output(["ninja", "-t", "commands", target], self.folder).strip().splitlines()[-1]
        words = shlex.split(last.removeprefix(": && ").removesuffix(" && :"))
        at = words.index("-o") if "-o" in words else -1
        if at < 0 or words[at + 1] != target:
            raise FluxtrueError(f"{target}: its link command is not understood: {last[:200]}")
        return words[:at] + words[at + 2 :]


def _compiler(entry: dict[str, Any]) -> tuple[str, ...]:
    """The call that compiles a source, without source, output and dependencies, and without a cache."""
    words, left = [], shlex.split(entry["command"])
    if Path(left[0]).name == "ccache":
        left.pop(0)
    while left:
        word = left.pop(0)
        if word in ("-o", "-c"):
            left.pop(0)
        elif word in DEPENDENCIES:
            del left[: DEPENDENCIES[word] - 1]
        else:
            words.append(word)
    return tuple(words)


def _output_of(entry: dict[str, Any]) -> Path:
    words = shlex.split(entry["command"])
    return Path(words[words.index("-o") + 1])


def _target(made: Path) -> str:
    """The target of CMake that an object belongs to."""
    return next((part for part in made.parts if part.endswith(".dir")), "").removesuffix(".dir")


def _library(made: Path) -> str:
    """The library that CMake makes of an object. A program without it may compile the source otherwise."""
    return f"lib{_target(made)}.a"


def _name(word: str) -> str:
    return word.rpartition("/")[2]


def with_object(linker: Sequence[str], made: Path, own: str = "") -> list[str]:
    """A linker's call with one more object before all others: what it defines is not taken from a library. A test's own
    object is replaced."""
    if own:
        return [str(made) if word == own else word for word in linker]
    first = next(n for n, word in enumerate(linker) if word.endswith((".o", ".a")))
    return [*linker[:first], str(made), *linker[first:]]


def build_folder(root: Path) -> Path:
    """The build that a test belongs to, else build/host."""
    return Path(os.environ.get("FLUXTRUE_BUILD_DIR", root / "build" / "host"))
