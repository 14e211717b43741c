# SPDX-License-Identifier: Apache-2.0
"""An image with one deliberate error: a source file of the port is changed, compiled and linked in place of its own."""

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


def plant(built: Path, what: Plant, folder: Path) -> Path:
    """The image `built` with the error in it, sealed."""
    original = PORT / what.file
    text = original.read_text(encoding="utf-8")
    assert text.count(what.text) == 1, f"{what.file} contains {text.count(what.text)} times: {what.text}"
    source = folder / what.file
    source.write_text(text.replace(what.text, what.instead), encoding="utf-8")
    commands = _commands(built.parent)
    compile_it = _only(commands, f"-c {original}")
    place = shlex.split(compile_it)[shlex.split(compile_it).index("-o") + 1]
    planted_object, elf = str(folder / "planted.obj"), folder / "planted.elf"
    compile_it = compile_it.replace(place, planted_object).replace(f"-c {original}", f"-c {source}")
    _run(shlex.split(compile_it), built.parent)
    link = _only(_only(commands, "-o fluxtrue.elf").split(" && "), "-o fluxtrue.elf")
    link = link.replace(place, planted_object).replace("-o fluxtrue.elf", f"-o {elf}")
    _run(shlex.split(link.replace("fluxtrue.map", "planted.map")), built.parent)
    image.seal(elf)
    return elf
