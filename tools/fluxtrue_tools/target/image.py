# SPDX-License-Identifier: Apache-2.0
"""A linked image: the checksum over its data, and how large it is."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError

PT_LOAD, SHT_SYMTAB = 1, 2
RAM_FROM = 0x1000_0000  # everything the linker puts below is flash


@dataclass(frozen=True)
class Segment:
    """A loadable part: where it lies in the file, in flash and at run time."""

    offset: int
    address: int
    load: int
    in_file: int
    in_memory: int


class Image:
    """Segments and symbols of a 32-bit little-endian ELF file."""

    def __init__(self, path: Path) -> None:
        try:
            self.content = bytearray(path.read_bytes())
        except OSError as error:
            raise FluxtrueError(f"{path}: {error.strerror}") from error
        if self.content[:6] != b"\x7fELF\x01\x01":
            raise FluxtrueError(f"{path}: not a 32-bit little-endian ELF file")
        self.path = path
        try:
            self._read()
        except (struct.error, ValueError, IndexError) as error:
            raise FluxtrueError(f"{path}: a damaged ELF file: {error}") from error

    def _read(self) -> None:
        content = self.content
        ph_off, sh_off = struct.unpack_from("<II", content, 28)
        ph_size, ph_num, sh_size, sh_num = struct.unpack_from("<HHHH", content, 42)
        headers = [struct.unpack_from("<6I", content, ph_off + i * ph_size) for i in range(ph_num)]
        self.segments = [Segment(*rest) for kind, *rest in headers if kind == PT_LOAD]
        self.symbols: dict[str, int] = {}
        sections = [struct.unpack_from("<10I", content, sh_off + i * sh_size) for i in range(sh_num)]
        for _, kind, _, _, offset, size, link, *_ in sections:
            if kind == SHT_SYMTAB:
                names = sections[link][4]
                for at in range(offset, offset + size, 16):
                    name, value = struct.unpack_from("<II", content, at)
                    end = content.index(b"\0", names + name)
                    self.symbols[content[names + name : end].decode()] = value

    def symbol(self, name: str) -> int:
        if name not in self.symbols:
            raise FluxtrueError(f"{self.path}: no symbol '{name}': not an image of this project")
        return self.symbols[name]

    def place(self, address: int, size: int) -> int:
        """Where in the file the bytes at a run-time address are."""
        for part in self.segments:
            if part.address <= address and address + size <= part.address + part.in_file:
                return part.offset + address - part.address
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
    image = Image(path)
    flash = sum(p.in_file for p in image.segments if p.load < RAM_FROM)
    ram = sum(p.in_memory for p in image.segments if p.address >= RAM_FROM)
    text = f"{path.name}: flash {flash} of {flash_most} bytes, RAM {ram} of {ram_most} bytes with the stack"
    if flash > flash_most or ram > ram_most:
        raise FluxtrueError(text)
    return text
