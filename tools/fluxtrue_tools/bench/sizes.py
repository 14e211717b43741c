# SPDX-License-Identifier: Apache-2.0
"""Flash and RAM of an image by module, and of the control library by itself."""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from elftools.dwarf.die import DIE
from elftools.elf.elffile import ELFFile

from fluxtrue_tools import debug_info
from fluxtrue_tools.bench.disassembly import plain
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target.image import RAM_FROM, Image, Size

NM, SIZE = "arm-none-eabi-nm", "arm-none-eabi-size"
LIBRARIES = ("fx", "signal", "control")
TABLES = re.compile(r"\.rodata\.(fx_)?\w*_?table$")
# The drive's state: what the stages keep, and what they hand to each other; not the motor's data.
STATE = ("fast", "psi_d_error", "task", "samples", "windows", "commands", "mrai")
_SECTION = re.compile(r"^\.(text|rodata|data|bss)(\S*)\s+(\d+)\s")


@dataclass(frozen=True)
class Whole:
    """Of the image, in bytes."""

    size: Size
    stack: int  # part of the RAM


def _lines(*command: str) -> list[str]:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"{' '.join(command[:1])}: {done.stderr.strip()[:300]}")
    return done.stdout.splitlines()


def whole(elf: Path) -> Whole:
    """Flash and RAM as the linker counts them."""
    image = Image(elf)
    return Whole(Size.of(image), image.symbol("stack_top") - image.symbol("stack_bottom"))


def _module(source: str, name: str) -> str:
    """The layer of a source file; what the compiler's own library brought is named so."""
    path = source.rpartition(":")[0]
    if "motor_tables.c" in path:
        return "motor data and tables"
    for layer in (
        "fx",
        "signal",
        "control",
        "safety",
        "second_level",
        "comm",
        "drive",
        "storage",
        "calibration",
        "scope",
        "ecu",
    ):
        if f"/firmware/{layer}/" in path or (layer == "fx" and name.startswith("fx_")):
            return f"firmware/{layer}"
    if "/bus/" in path:
        return "firmware/comm"
    if "/hal/" in path:
        return "hal"
    return "C library" if path else "constants without a source line"


CODE = "tTwW"  # kinds of symbols; code in the RAM lies in the flash, too, from which it is copied
NAMED = 64  # bytes: variables from here on are listed by name


def modules(elf: Path) -> dict[str, tuple[int, int]]:
    """Bytes of flash and RAM by module; a function that was compiled into another counts with that."""
    flash: Counter[str] = Counter()
    ram: Counter[str] = Counter()
    seen: set[int] = set()
    for line in _lines(NM, "-S", "-l", "--size-sort", str(elf)):
        symbol, _, source = line.partition("\t")
        address, size, kind, name = symbol.split()[:4]
        if kind in "Nn" or int(address, 16) in seen:
            continue
        seen.add(int(address, 16))
        if int(address, 16) >= RAM_FROM and kind not in CODE:
            ram[f"variable {plain(name)}" if int(size, 16) >= NAMED else "small variables"] += int(size, 16)
        else:
            flash[_module(source, name)] += int(size, 16)
    image = whole(elf)
    flash["literals, padding, vectors"] = image.size.flash - flash.total()
    ram["stack"] = image.stack
    ram["padding"] = image.size.ram - ram.total()
    return {name: (flash[name], ram[name]) for name in sorted(flash | ram)}


def library(build: Path) -> dict[str, int]:
    """The control library compiled by itself, not across files: bytes of code, of constants, and of their tables."""
    bytes_of: Counter[str] = Counter(code=0, tables=0, constants=0, variables=0)
    for layer in LIBRARIES:
        archive = build / "firmware" / f"libfluxtrue_{layer}.a"
        if not archive.is_file():
            raise FluxtrueError(f"{archive}: not built")
        for line in _lines(SIZE, "-A", str(archive)):
            if found := _SECTION.match(line):
                kind, rest, size = found.groups()
                table = TABLES.match(f".{kind}{rest}")
                key = "tables" if table else {"text": "code", "rodata": "constants"}.get(kind, "variables")
                bytes_of[key] += int(size)
    return dict(bytes_of)


def _members(elf: ELFFile, type_name: str) -> dict[str, DIE]:
    """Names and types."""
    for unit in elf.get_dwarf_info().iter_CUs():
        for die in unit.get_top_DIE().iter_children():
            if die.tag == "DW_TAG_typedef" and debug_info.name(die) == type_name:
                members = [m for m in debug_info.bare(die).iter_children() if m.tag == "DW_TAG_member"]
                return {debug_info.name(m): m.get_DIE_from_attribute("DW_AT_type") for m in members}
    raise FluxtrueError(f"no debug information for the type '{type_name}'")


def state(elf: Path) -> dict[str, int]:
    """Bytes of RAM of each part of drive_t. Of the samples two slots hand over, the others are the scope's history."""
    file = ELFFile(BytesIO(elf.read_bytes()))
    parts = {name: debug_info.size(kind) for name, kind in _members(file, "drive_t").items()}
    samples = _members(file, "sample_box_t")
    slot = debug_info.size(samples["slot"]) // debug_info.elements(samples["slot"])
    handed_over = debug_info.size(samples["generation"]) + 2 * slot
    return parts | {"samples": handed_over, "history": parts["samples"] - handed_over}


def compiler() -> str:
    """The name and version of the compiler, on which the figures depend."""
    return _lines("arm-none-eabi-gcc", "--version")[0].strip()
