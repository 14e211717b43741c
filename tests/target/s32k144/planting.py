# SPDX-License-Identifier: Apache-2.0
"""Images that differ from a built image in some source files: with a planted error, or with another machine's data.

Each changed file is compiled by the build's own command and linked in place of the original. Link-time optimisation
takes several seconds per image. An image with a planted error does without it unless its error is one of time; the same
image without the error must then pass the check, so that what the check finds is the error.
"""

from __future__ import annotations

import atexit
import functools
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from fluxtrue_tools.emulate.build import ROOT, Parts
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target import image

PORT = ROOT / "hal" / "s32k144"
FIRMWARE = ROOT / "firmware"


@dataclass(frozen=True)
class PlantedError:
    """A text of a file of the port or of the firmware, which must occur exactly once, and what replaces it."""

    file: str
    text: str
    replacement: str
    within: Path = PORT

    def __post_init__(self) -> None:
        count = (self.within / self.file).read_text(encoding="utf-8").count(self.text)
        assert count == 1, f"{self.file} must contain this text once, not {count} times: {self.text}"


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def _commands(folder: Path) -> list[str]:
    """The commands that ninja would run for the image, in order."""
    command = ["ninja", "-t", "commands", "fluxtrue.elf"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.splitlines()


def _only(lines: list[str], part: str) -> str:
    found = [line for line in lines if part in line]
    assert len(found) == 1, f"{len(found)} commands contain {part!r}"
    return found[0]


def relinked(built: Path, replacements: dict[Path, Path], folder: Path, *, as_built: bool = True) -> Path:
    """The image `built` with some of its source files replaced by others, sealed; `as_built`: with link-time
    optimisation."""
    commands, elf = _commands(built.parent), folder / "relinked.elf"
    link = _only(_only(commands, "-o fluxtrue.elf").split(" && "), "-o fluxtrue.elf")
    options = "" if as_built else " -fno-lto"
    for original, source in replacements.items():
        command = _only(commands, f"-c {original}")
        built_object = shlex.split(command)[shlex.split(command).index("-o") + 1]
        new_object = str(folder / Path(built_object).name)  # the linker script places the motor's data by this name
        command = command.replace(built_object, new_object).replace(f"-c {original}", f"-c {source}{options}")
        _run(shlex.split(command), built.parent)
        link = link.replace(built_object, new_object)
    link = link.replace("-o fluxtrue.elf", f"-o {elf}{options}").replace(
        f"{built.parent}/fluxtrue.map", f"{folder}/relinked.map"
    )
    _run(shlex.split(link), built.parent)
    image.seal(elf)
    return elf


def with_motor(built: Path, tables: Path) -> dict[Path, Path]:
    """For relinked(): the data of another machine, as `tools/fluxtrue motor build` has written them."""
    found = list(built.parent.glob("motors/*/motor_tables.c"))
    assert len(found) == 1, f"{len(found)} machines in {built.parent}"
    return {found[0]: tables}


def with_error(error: PlantedError, folder: Path) -> dict[Path, Path]:
    """The file with the planted error, for relinked()."""
    original = error.within / error.file
    source = folder / original.name
    text = original.read_text(encoding="utf-8").replace(error.text, error.replacement)
    source.write_text(text, encoding="utf-8")
    return {original: source}


def image_with_error(built: Path, errors: Iterable[PlantedError], folder: Path, *, as_built: bool = False) -> Path:
    """The image `built` with the planted errors, sealed; without link-time optimisation unless `as_built`."""
    sources: dict[Path, Path] = {}
    for error in errors:
        changed = with_error(error, folder)
        assert sources.keys().isdisjoint(changed), "each error replaces a whole file: two in one file are not possible"
        sources |= changed
    return relinked(built, sources, folder, as_built=as_built)


_passed: set[tuple[Callable[[Parts], None], Path]] = set()


@functools.cache
def _image_without_error(built: Path) -> Path:
    """The image that is linked like those with a planted error."""
    folder = Path(tempfile.mkdtemp(prefix="relinked"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return relinked(built, {}, folder, as_built=False)


def assert_passes_without_error(check: Callable[[Parts], None], parts: Parts) -> None:
    """The check passes on the image that is linked like those with a planted error. It runs once for each image."""
    if (check, parts.image) not in _passed:
        check(replace(parts, image=_image_without_error(parts.image)))
        _passed.add((check, parts.image))


def assert_found(
    check: Callable[[Parts], None], parts: Parts, error: PlantedError, folder: Path, *, as_built: bool = False
) -> None:
    """The check, which `parts` passes, fails on the image with the planted error. `as_built` is for errors of less than
    a microsecond, for which the image must be as fast as the built one."""
    if not as_built:
        assert_passes_without_error(check, parts)
    planted = replace(parts, image=image_with_error(parts.image, [error], folder, as_built=as_built))
    with pytest.raises((AssertionError, FluxtrueError)):
        check(planted)
