# SPDX-License-Identifier: Apache-2.0
"""The instructions of a linked image, as the binary utilities of its compiler print them."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass, field, replace
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError

OBJDUMP = "arm-none-eabi-objdump"
CONDITIONS = ("eq", "ne", "cs", "hs", "cc", "lo", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")
_FUNCTION = re.compile(r"^([0-9a-f]{8}) <(.+)>:$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\t([0-9a-f ]+?)\s*\t(\S+)(?:\t(.*))?$")
_TARGET = re.compile(r"(?:^|, )([0-9a-f]+) <")
_REGISTER_RANGE = re.compile(r"([rsd])(\d+)-[rsd](\d+)")
_WORD = re.compile(r"^\s*([0-9a-f]+):\t[0-9a-f ]+?\s*\t\.word\t0x([0-9a-f]+)")
FAR, VENEER = ("ldr", "pc, [pc]"), "_veneer"  # the jump in a veneer, and the end of its name
_COPY = re.compile(r"\.(lto_priv|constprop|isra|part|cold)(\.\d+)?")


@dataclass(frozen=True)
class Instruction:
    """One instruction; `target`: where a direct branch goes, or one to the constant behind it (`far`)."""

    address: int
    size: int
    mnemonic: str
    operands: str = ""
    far: int | None = None

    @property
    def target(self) -> int | None:
        if self.far is not None:
            return self.far
        found = _TARGET.search(self.operands)
        return int(found.group(1), 16) if found else None

    @property
    def bare(self) -> str:
        """The mnemonic without width and type: movge for movge.w."""
        return self.mnemonic.partition(".")[0]


@dataclass
class Function:
    """The instructions between two symbols; constants between them are left out."""

    name: str
    address: int
    instructions: list[Instruction] = field(default_factory=list)


def plain(name: str) -> str:
    """The name in the source of a copy that the optimiser has made."""
    return _COPY.sub("", name)


def words(operands: str) -> int:
    """Words in a register list; a double register has two."""
    listed = operands[operands.index("{") + 1 : operands.index("}")]
    number = 0
    for part in map(str.strip, listed.split(",")):
        span = _REGISTER_RANGE.fullmatch(part)
        count = int(span.group(3)) - int(span.group(2)) + 1 if span else 1
        number += 2 * count if part.startswith("d") else count
    return number


def parse(text: str) -> list[Function]:
    """Functions of the listing in order of their addresses."""
    functions: list[Function] = []
    for line in text.splitlines():
        if head := _FUNCTION.match(line):
            functions.append(Function(head.group(2), int(head.group(1), 16)))
        elif (found := _LINE.match(line)) and functions and not found.group(3).startswith("."):
            address, code, mnemonic, operands = found.groups()
            operands = re.split(r"\s*[@;]", operands or "")[0].strip()
            size = len(code.replace(" ", "")) // 2
            functions[-1].instructions.append(Instruction(int(address, 16), size, mnemonic, operands))
        elif functions and functions[-1].instructions and (constant := _WORD.match(line)):
            _lead(functions[-1].instructions, int(constant.group(1), 16), int(constant.group(2), 16))
    return functions


def _lead(code: list[Instruction], address: int, constant: int) -> None:
    """A veneer of the linker, between flash and RAM: ldr pc with the constant behind it, bit 0 set for Thumb code."""
    last = code[-1]
    if (last.bare, last.operands) == FAR and last.address + last.size == address:
        code[-1] = replace(last, far=constant & ~1)


def read(elf: Path) -> list[Function]:
    """All code of the file."""
    if shutil.which(OBJDUMP) is None:
        raise FluxtrueError(f"{OBJDUMP} not found: install binutils-arm-none-eabi or run tools/setup")
    done = subprocess.run([OBJDUMP, "-d", str(elf)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"{elf}: {done.stderr.strip()[:300]}")
    functions = parse(done.stdout)
    if not functions:
        raise FluxtrueError(f"{elf}: contains no code")
    return functions
