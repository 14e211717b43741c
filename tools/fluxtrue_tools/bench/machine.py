# SPDX-License-Identifier: Apache-2.0
"""An emulated Cortex-M4 (unicorn) that calls functions of an ELF file and counts instructions.

Counted is what is issued: every instruction of a basic block that is entered, skipped IT slots
included. Instructions are not cycles, and an emulator is not silicon. Cycles are estimated from them (cycles.py).
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_R3,
    UC_ARM_REG_SP,
    UC_CPU_ARM_CORTEX_M4,
)

from fluxtrue_tools.bench.cycles import PIPELINE, cycles
from fluxtrue_tools.bench.disassembly import Function, Instruction

CODE = (0x0000_0000, 0x0020_0000)  # where the linker puts code and constants
DATA = (0x2000_0000, 0x0080_0000)  # variables first, then blobs, the stack at the end
RETURN = 0x001F_FFF0  # where a called function returns to
SECOND = 0x0010_0000  # constants that are linked apart from the program
STACK_SIZE = 0x1_0000
ARGUMENTS = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3)
PT_LOAD, SHT_SYMTAB = 1, 2


@dataclass
class Elf:
    """The loadable parts and the symbols of a 32-bit little-endian ELF file."""

    segments: list[tuple[int, bytes, int]] = field(default_factory=list)  # address, bytes, size
    symbols: dict[str, int] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Elf:
        """Parse the file; anything but ELF32 little-endian is an error."""
        image = path.read_bytes()
        if image[:6] != b"\x7fELF\x01\x01":
            raise ValueError(f"{path}: not a 32-bit little-endian ELF file")
        elf = cls()
        ph_off, sh_off = struct.unpack_from("<II", image, 28)
        ph_size, ph_num, sh_size, sh_num = struct.unpack_from("<HHHH", image, 42)
        for i in range(ph_num):
            kind, off, address, _, in_file, in_memory = struct.unpack_from("<6I", image, ph_off + i * ph_size)
            if kind == PT_LOAD:
                elf.segments.append((address, image[off : off + in_file], in_memory))
        sections = [struct.unpack_from("<10I", image, sh_off + i * sh_size) for i in range(sh_num)]
        for _, kind, _, _, off, size, link, *_ in sections:
            if kind == SHT_SYMTAB:
                strings = sections[link][4]
                for at in range(off, off + size, 16):
                    name, value = struct.unpack_from("<II", image, at)
                    end = image.index(b"\0", strings + name)
                    elf.symbols[image[strings + name : end].decode()] = value
        return elf


class Machine:
    """One processor with one program in memory."""

    def __init__(self, path: Path) -> None:
        self.elf = Elf.read(path)
        self.uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        for start, size in (CODE, DATA):
            self.uc.mem_map(start, size)
        self._free = DATA[0]
        for address, content, size in self.elf.segments:
            self.uc.mem_write(address, content)
            if address >= DATA[0]:
                self._free = max(self._free, address + size)
        self._lengths: dict[tuple[int, int], int] = {}
        self._issued = 0
        self.cycles = 0  # of the last call that was counted; 0 without charge()
        self._listing: dict[int, Instruction] = {}
        self._costs: dict[tuple[int, int], int] = {}
        self._end = 0
        self._hook: int | None = None

    def place(self, content: bytes) -> int:
        """Copy the bytes into fresh memory and return their address."""
        address = (self._free + 7) & ~7
        self._free = address + len(content)
        if self._free > sum(DATA) - STACK_SIZE:
            raise MemoryError(f"{len(content)} bytes do not fit the emulated memory")
        self.uc.mem_write(address, content)
        return address

    def charge(self, functions: Iterable[Function]) -> None:
        """Estimate the cycles of counted calls, too, from the program's instructions."""
        self._listing = {i.address: i for function in functions for i in function.instructions}

    def add(self, path: Path) -> Elf:
        """Load the constants of another file beside the program."""
        elf = Elf.read(path)
        for address, content, _ in elf.segments:
            self.uc.mem_write(address, content)
        return elf

    def read(self, address: int, size: int) -> bytes:
        """The bytes at the address."""
        return bytes(self.uc.mem_read(address, size))

    def call(self, symbol: str, *arguments: int) -> int:
        """Call with up to four words in r0..r3; returns r0 and r1 as one 64-bit number."""
        uc = self.uc
        for register, value in zip(ARGUMENTS, arguments, strict=False):
            uc.reg_write(register, value & 0xFFFF_FFFF)
        uc.reg_write(UC_ARM_REG_SP, sum(DATA) - 16)
        uc.reg_write(UC_ARM_REG_LR, RETURN | 1)
        try:
            uc.emu_start(self.elf.symbols[symbol] | 1, RETURN)
        except UcError as error:
            raise RuntimeError(f"{symbol}{arguments}: {error}") from error
        if uc.reg_read(UC_ARM_REG_PC) != RETURN:
            raise RuntimeError(f"{symbol}{arguments}: did not return")
        return uc.reg_read(UC_ARM_REG_R0) | (uc.reg_read(UC_ARM_REG_R1) << 32)

    def count(self, symbol: str, *arguments: int) -> tuple[int, int]:
        """Do what call() does and return the number of instructions issued."""
        if self._hook is None:
            self._hook = self.uc.hook_add(UC_HOOK_BLOCK, self._on_block)
        self._issued = self.cycles = self._end = 0
        result = self.call(symbol, *arguments)
        return result, self._issued

    def _on_block(self, _uc: Uc, address: int, size: int, _data: object) -> None:
        if address == RETURN:
            return
        key = (address, size)
        if key not in self._lengths:
            self._lengths[key] = instructions(self.read(address, size))
        self._issued += self._lengths[key]
        if self._listing:
            self.cycles += self._cost(key) + (PIPELINE if self._end not in (0, address) else 0)
            self._end = address + size

    def _cost(self, block: tuple[int, int]) -> int:
        """Cycles of a basic block whose instructions follow one another."""
        if block not in self._costs:
            at, end = block[0], sum(block)
            total = 0
            while at < end:
                total += cycles(self._listing[at])
                at += self._listing[at].size
            self._costs[block] = total
        return self._costs[block]


def instructions(code: bytes) -> int:
    """The number of Thumb instructions: a first halfword of 0xE800 and above has a second."""
    at = number = 0
    while at < len(code):
        at += 4 if code[at + 1] >= 0xE8 else 2
        number += 1
    return number
