# SPDX-License-Identifier: Apache-2.0
"""An image that differs from a built one in a file: with one deliberate error, or for another machine. The file is
compiled by the command of the build and linked in place of its own."""

from __future__ import annotations

import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.emulate.build import ROOT
from fluxtrue_tools.target import image

PORT = ROOT / "hal" / "s32k144"


@dataclass(frozen=True)
class Plant:
    """Text of a file of the port, which must occur exactly once, and what stands there instead."""

    file: str
    text: str
    instead: str

    def __post_init__(self) -> None:
        count = (PORT / self.file).read_text(encoding="utf-8").count(self.text)
        assert count == 1, f"{self.file} contains {count} times: {self.text}"


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def _commands(folder: Path) -> list[str]:
    """What ninja would run for the image, in order."""
    command = ["ninja", "-t", "commands", "fluxtrue.elf"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.splitlines()


def _only(lines: list[str], part: str) -> str:
    found = [line for line in lines if part in line]
    assert len(found) == 1, f"{len(found)} commands contain {part!r}"
    return found[0]


def relinked(built: Path, instead: dict[Path, Path], folder: Path) -> Path:
    """The image `built` with some of its source files compiled from other ones, sealed."""
    commands, elf = _commands(built.parent), folder / "relinked.elf"
    link = _only(_only(commands, "-o fluxtrue.elf").split(" && "), "-o fluxtrue.elf")
    for original, source in instead.items():
        compile_it = _only(commands, f"-c {original}")
        place = shlex.split(compile_it)[shlex.split(compile_it).index("-o") + 1]
        another = str(folder / Path(place).name)  # the linker script places the motor's data by this name
        _run(shlex.split(compile_it.replace(place, another).replace(f"-c {original}", f"-c {source}")), built.parent)
        link = link.replace(place, another)
    link = link.replace("-o fluxtrue.elf", f"-o {elf}").replace("fluxtrue.map", f"{folder.name}.map")
    _run(shlex.split(link), built.parent)
    image.seal(elf)
    return elf


def with_motor(built: Path, tables: Path) -> dict[Path, Path]:
    """For relinked(): the data of another machine, as `tools/fluxtrue motor build` has written them."""
    found = list(built.parent.glob("motors/*/motor_tables.c"))
    assert len(found) == 1, f"{len(found)} machines in {built.parent}"
    return {found[0]: tables}


def with_error(what: Plant, folder: Path) -> dict[Path, Path]:
    """For relinked(): the file with the error in it."""
    original = PORT / what.file
    source = folder / what.file
    source.write_text(original.read_text(encoding="utf-8").replace(what.text, what.instead), encoding="utf-8")
    return {original: source}


def plant(built: Path, what: Plant, folder: Path) -> Path:
    """The image `built` with the error in it, sealed."""
    return relinked(built, with_error(what, folder), folder)
