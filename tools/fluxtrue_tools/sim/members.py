# SPDX-License-Identifier: Apache-2.0
"""Members of the firmware's state by the names of its source, found in the debug information of library or image.

Tests use them to plant a fault in memory, and to read what no name of fluxtrue_get() tells.
"""

import ctypes
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from elftools.dwarf.die import DIE
from elftools.elf.elffile import ELFFile

from fluxtrue_tools.debug_info import bare, size
from fluxtrue_tools.debug_info import name as name_of
from fluxtrue_tools.errors import FluxtrueError

INSTANCE: Final = "fluxtrue"  # struct of hal/host/instance.h
_PART: Final = re.compile(r"([A-Za-z_]\w*)((?:\[\d+\])*)")
_SIGNED, _FLOAT, _BOOLEAN = (5, 6), 4, 2  # DW_ATE_signed, _signed_char, _float, _boolean
_INTEGERS: Final = {1: ctypes.c_uint8, 2: ctypes.c_uint16, 4: ctypes.c_uint32, 8: ctypes.c_uint64}
_SIGNED_INTEGERS: Final = {1: ctypes.c_int8, 2: ctypes.c_int16, 4: ctypes.c_int32, 8: ctypes.c_int64}
_FLOATS: Final = {4: ctypes.c_float, 8: ctypes.c_double}


def _member(die: DIE, name: str) -> tuple[DIE, int] | None:
    """Type and offset of a member, also of one in an unnamed struct or union."""
    for child in die.iter_children():
        if child.tag != "DW_TAG_member":
            continue
        at = child.attributes.get("DW_AT_data_member_location")
        offset = int(at.value) if at else 0
        kind = child.get_DIE_from_attribute("DW_AT_type")
        if name_of(child) == name:
            return kind, offset
        if not name_of(child) and (inner := _member(bare(kind), name)):
            return inner[0], offset + inner[1]
    return None


@dataclass(frozen=True)
class Members:
    """The layout of a type."""

    path: str
    type: str
    root: DIE

    def find(self, member: str) -> tuple[int, Any]:
        """Offset and ctypes type of a number."""
        die, offset = self.root, 0
        for part in member.split("."):
            match = _PART.fullmatch(part)
            found = _member(bare(die), match[1]) if match else None
            if match is None or found is None:
                raise FluxtrueError(f"{member}: the firmware's state has no member '{part}' there")
            die, offset = found[0], offset + found[1]
            for index in re.findall(r"\d+", match[2]):
                element = bare(bare(die).get_DIE_from_attribute("DW_AT_type"))
                die, offset = element, offset + int(index) * size(element)
        return offset, _number(member, bare(die))

    def place(self, member: str) -> tuple[int, Any]:
        """The same, found once."""
        return _place(self.path, self.type, member)

    def read(self, address: int, member: str) -> float:
        """The number at an instance in this process."""
        offset, kind = self.place(member)
        return float(kind.from_address(address + offset).value)

    def write(self, address: int, member: str, value: float) -> None:
        """Changes it there; whole numbers wrap as in C."""
        offset, kind = self.place(member)
        kind.from_address(address + offset).value = as_value(kind, value)


def as_value(kind: Any, value: float) -> float | int:
    """What a ctypes type takes."""
    return value if kind in _FLOATS.values() else int(value)


def _pointers(die: DIE, path: str) -> Iterator[str]:
    die = bare(die)
    if die.tag == "DW_TAG_pointer_type":
        yield path
    elif die.tag == "DW_TAG_array_type":
        yield from _pointers(die.get_DIE_from_attribute("DW_AT_type"), path)
    elif die.tag in ("DW_TAG_structure_type", "DW_TAG_union_type"):
        for child in die.iter_children():
            if child.tag == "DW_TAG_member":
                inside = ".".join(part for part in (path, name_of(child)) if part)
                yield from _pointers(child.get_DIE_from_attribute("DW_AT_type"), inside)


def pointers(path: str) -> list[str]:
    """Names of all members of the state that are addresses; the elements of an array have the name of the array."""
    return list(_pointers(members(path).root, ""))


def _number(member: str, die: DIE) -> Any:
    if die.tag == "DW_TAG_enumeration_type":
        return _INTEGERS[size(die)]
    if die.tag == "DW_TAG_base_type":
        encoding = int(die.attributes["DW_AT_encoding"].value)
        kinds = _FLOATS if encoding == _FLOAT else _SIGNED_INTEGERS if encoding in _SIGNED else _INTEGERS
        return kinds[size(die)]
    raise FluxtrueError(f"{member}: not a number")


@cache
def _place(path: str, kind: str, member: str) -> tuple[int, Any]:
    return members(path, kind).find(member)


def _is_type(die: DIE, kind: str) -> bool:
    """A struct with a tag, or the name of one without."""
    whole = die.tag == "DW_TAG_typedef" or (die.tag == "DW_TAG_structure_type" and "DW_AT_byte_size" in die.attributes)
    return whole and name_of(die) == kind


@cache
def members(path: str, kind: str = INSTANCE) -> Members:
    """The members of a type in a library or an image built with debug information."""
    file = Path(path).open("rb")  # noqa: SIM115 (pyelftools reads when it is asked)
    elf = ELFFile(file)
    if not elf.has_dwarf_info():
        raise FluxtrueError(f"{path}: no debug information, allowed: a build with -g, as the presets make it")
    for unit in elf.get_dwarf_info().iter_CUs():
        for die in unit.get_top_DIE().iter_children():
            if _is_type(die, kind):
                return Members(path, kind, die)
    raise FluxtrueError(f"{path}: no type {kind} in its debug information")
