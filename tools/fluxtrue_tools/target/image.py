# SPDX-License-Identifier: Apache-2.0
"""A linked image: the checksum over its data, and how large it is."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path

from elftools.common.exceptions import ELFError
from elftools.elf.constants import SH_FLAGS
from elftools.elf.elffile import ELFFile
from elftools.elf.segments import Segment

from fluxtrue_tools.errors import FluxtrueError

RAM_FROM = 0x1000_0000  # everything the linker puts below is flash


class Image:
    """Loadable segments, their sections and the symbols of an ELF file, and its bytes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.content = bytearray(path.read_bytes())
            elf = ELFFile(BytesIO(bytes(self.content)))
            self.segments: list[Segment] = list(elf.iter_segments("PT_LOAD"))
            self.sections = [s for s in elf.iter_sections() if s["sh_flags"] & SH_FLAGS.SHF_ALLOC]
            table = elf.get_section_by_name(".symtab")
            symbols = table.iter_symbols() if table is not None else ()
            self.symbols = {symbol.name: int(symbol["st_value"]) for symbol in symbols}
        except OSError as error:
            raise FluxtrueError(f"{path}: {error.strerror}") from error
        except ELFError as error:
            raise FluxtrueError(f"{path}: no ELF file: {error}") from error

    def symbol(self, name: str) -> int:
        if name not in self.symbols:
            raise FluxtrueError(f"{self.path}: no symbol '{name}': not an image of this project")
        return self.symbols[name]

    def place(self, address: int, size: int) -> int:
        """Where in the file the bytes at a run-time address are."""
        for part in self.segments:
            inside = address - part["p_vaddr"]
            if 0 <= inside and inside + size <= part["p_filesz"]:
                return int(part["p_offset"] + inside)
        raise FluxtrueError(f"{self.path}: {size} bytes at {address:#x} are not in the file")


def seal(path: Path) -> str:
    """Compute and store the CRC-32 (IEEE 802.3) of everything between the two marks."""
    image = Image(path)
    start, end = image.symbol("protected_start"), image.symbol("protected_end")
    word = image.symbol("protected_crc")
    if end <= start:
        raise FluxtrueError(f"{path}: nothing is protected ({start:#x} to {end:#x})")
    at = image.place(start, end - start)
    crc = zlib.crc32(image.content[at : at + end - start])
    struct.pack_into("<I", image.content, image.place(word, 4), crc)
    path.write_bytes(image.content)
    return f"{path.name}: CRC-32 {crc:#010x} over {end - start} bytes at {start:#x}"


def size(path: Path, flash_most: int, ram_most: int) -> str:
    """Flash and RAM, against bounds."""
    sections = Image(path).sections
    flash = sum(s["sh_size"] for s in sections if s["sh_type"] == "SHT_PROGBITS")
    ram = sum(s["sh_size"] for s in sections if s["sh_addr"] >= RAM_FROM)
    text = f"{path.name}: flash {flash} of {flash_most} bytes, RAM {ram} of {ram_most} bytes with the stack"
    if flash > flash_most or ram > ram_most:
        raise FluxtrueError(text)
    return text
