# SPDX-License-Identifier: Apache-2.0
"""A linked image: the checksum over its data, and how large it is."""

from __future__ import annotations

import re
import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile
from elftools.elf.segments import Segment

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.outputs import atomic

AREAS = ("protected", "hot", "vectors", "program")  # a port must seal the first, the motor's data
RAM_FROM = 0x1000_0000  # everything the linker puts below is flash


class Image:
    """Loadable segments, their sections and the symbols of an ELF file, and its bytes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with reading(path, "an ELF file"):
            self.content = bytearray(path.read_bytes())
            elf = ELFFile(BytesIO(bytes(self.content)))
            self.segments: list[Segment] = list(elf.iter_segments("PT_LOAD"))
            self.sections = [s for s in elf.iter_sections() if s["sh_flags"] & SH_FLAGS.SHF_ALLOC]
            table = elf.get_section_by_name(".symtab")
            symbols = table.iter_symbols() if table is not None else ()
            self.symbols = {symbol.name: int(symbol["st_value"]) for symbol in symbols}

    def symbol(self, name: str) -> int:
        if name not in self.symbols:
            raise FluxtrueError(f"{self.path}: no symbol '{name}': not an image of this project")
        return self.symbols[name]

    def place(self, address: int, size: int) -> int:
        """The offset in the file of the bytes at a run-time address."""
        for part in self.segments:
            inside = address - part["p_vaddr"]
            if inside >= 0 and inside + size <= part["p_filesz"]:
                return int(part["p_offset"] + inside)
        raise FluxtrueError(f"{self.path}: {size} bytes at {address:#x} are not in the file")


MARK = b"fluxtrue-ver".ljust(16, b"\0")  # FLUXTRUE_VERSION_MARK of firmware/types/version.h
VERSION = struct.Struct("<16s3I12s")  # version_t there


@dataclass(frozen=True)
class Version:
    """Version in an image: three numbers and a text."""

    numbers: tuple[int, int, int]
    text: str


def version(path: Path) -> Version:
    """The version in an ELF file, a .bin or a dump of the flash: found by its mark, which must be there once."""
    with reading(path, "a readable file"):
        content = path.read_bytes()
    places = [match.start() for match in re.finditer(re.escape(MARK), content)]
    if len(places) != 1 or places[0] + VERSION.size > len(content):
        raise FluxtrueError(f"{path}: the mark of a version was found {len(places)} times, allowed: once")
    _, major, minor, patch, text = VERSION.unpack_from(content, places[0])
    return Version((major, minor, patch), text.rstrip(b"\0").decode("ascii", "replace"))


def _seal(image: Image, area: str) -> str:
    start, end = image.symbol(f"{area}_start"), image.symbol(f"{area}_end")
    word = image.symbol(f"{area}_crc")
    if end <= start:
        raise FluxtrueError(f"{image.path}: nothing is {area} ({start:#x} to {end:#x})")
    at = image.place(start, end - start)
    crc = zlib.crc32(image.content[at : at + end - start])
    struct.pack_into("<I", image.content, image.place(word, 4), crc)
    return f"CRC-32 {crc:#010x} over {end - start} bytes at {start:#x}"


def seal(path: Path) -> str:
    """Compute and store the CRC-32 (IEEE 802.3) of everything between the two marks of each area."""
    image = Image(path)
    areas = [AREAS[0], *(area for area in AREAS[1:] if f"{area}_crc" in image.symbols)]
    done = [_seal(image, area) for area in areas]
    with atomic(path) as scratch:
        scratch.write_bytes(image.content)
    return f"{path.name}: " + "; ".join(done)


@dataclass(frozen=True)
class Size:
    """Bytes of an image: of flash, of RAM with the stack, and of code in the RAM, which its flash holds, too."""

    flash: int
    ram: int
    ram_code: int

    @classmethod
    def of(cls, image: Image) -> Size:
        """By the sections that are loaded or reserved."""
        flash = sum(s["sh_size"] for s in image.sections if s["sh_type"] == "SHT_PROGBITS")
        in_ram = [s for s in image.sections if s["sh_addr"] >= RAM_FROM]
        code = sum(s["sh_size"] for s in in_ram if s["sh_flags"] & SH_FLAGS.SHF_EXECINSTR)
        return cls(int(flash), int(sum(s["sh_size"] for s in in_ram) - code), int(code))


def size(path: Path, most: Size) -> str:
    """Flash and RAM, against bounds."""
    found = Size.of(Image(path))
    text = (f"{path.name}: flash {found.flash} of {most.flash} bytes, RAM {found.ram} of {most.ram} bytes with the "
            f"stack, code in the RAM {found.ram_code} of {most.ram_code} bytes")  # fmt: skip
    if found.flash > most.flash or found.ram > most.ram or found.ram_code > most.ram_code:
        raise FluxtrueError(text)
    return text
