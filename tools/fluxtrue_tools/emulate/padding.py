# SPDX-License-Identifier: Apache-2.0
"""Bytes of an image's variables that belong to no member.

C leaves their values open: a structure copied as a whole takes over what its source had there, for example what an
interrupt left on the stack. Who compares two states of the memory must leave them out.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from elftools.dwarf.die import DIE
from elftools.elf.elffile import ELFFile

from fluxtrue_tools.debug_info import bare, elements
from fluxtrue_tools.errors import FluxtrueError

_ADDRESS: Final = 0x03  # DW_OP_addr
_DECLARED: Final = ("DW_AT_specification", "DW_AT_abstract_origin")  # the latter: after optimization across files
_RECORDS: Final = ("DW_TAG_structure_type", "DW_TAG_union_type")


def _type(die: DIE) -> DIE:
    """The type of a variable, member or array's element, without typedef, const and volatile."""
    while "DW_AT_type" not in die.attributes:
        die = die.get_DIE_from_attribute(next(name for name in _DECLARED if name in die.attributes))
    return bare(die.get_DIE_from_attribute("DW_AT_type"))


def _placed(member: DIE) -> tuple[int, bytes]:
    """Offset of a member, and 1 for each of its bytes that belongs to a value; a bit field uses each byte
    in which it lies."""
    bit = member.attributes.get("DW_AT_data_bit_offset")
    if bit is not None:
        first, last = int(bit.value), int(bit.value) + int(member.attributes["DW_AT_bit_size"].value) - 1
        return first // 8, b"\1" * (last // 8 - first // 8 + 1)
    at = member.attributes.get("DW_AT_data_member_location")
    return int(at.value) if at else 0, _used(_type(member))


def _used(die: DIE) -> bytes:
    """1 for each byte of a type that belongs to a value, 0 for padding."""
    if die.tag == "DW_TAG_array_type":
        return _used(_type(die)) * elements(die)
    used = bytearray(int(die.attributes["DW_AT_byte_size"].value))
    if die.tag not in _RECORDS:
        return b"\1" * len(used)
    for member in die.iter_children():
        if member.tag == "DW_TAG_member":
            offset, bytes_of_it = _placed(member)
            for n, byte in enumerate(bytes_of_it, offset):
                used[n] |= byte
    return bytes(used)


def _variables(elf: ELFFile) -> Iterator[tuple[int, DIE]]:
    """Address and type of each variable with a fixed address."""
    for unit in elf.get_dwarf_info().iter_CUs():
        for die in unit.iter_DIEs():
            where = die.attributes.get("DW_AT_location") if die.tag == "DW_TAG_variable" else None
            if where is not None and where.form == "DW_FORM_exprloc" and where.value[:1] == [_ADDRESS]:
                yield int.from_bytes(bytes(where.value[1:5]), "little"), _type(die)


def padding(image: Path) -> frozenset[int]:
    """The addresses of all padding in an image's variables."""
    with image.open("rb") as file:
        elf = ELFFile(file)
        if not elf.has_dwarf_info():
            raise FluxtrueError(f"{image}: no debug information, allowed: an image built with -g, as the presets do")
        return frozenset(
            address + n for address, kind in _variables(elf) for n, used in enumerate(_used(kind)) if not used
        )
