# SPDX-License-Identifier: Apache-2.0
"""Registers of a microcontroller as a CMSIS-SVD file describes them: names, places, bits."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading

ARRAY_MAX = 4096  # registers
_NAME = re.compile(r"[A-Za-z_]\w*(\[?%s\]?\w*)?", re.ASCII)


@dataclass(frozen=True)
class Field:
    """Some bits of a register."""

    name: str
    lsb: int
    width: int
    access: str

    @property
    def mask(self) -> int:
        return ((1 << self.width) - 1) << self.lsb


@dataclass(frozen=True)
class Register:
    """One register, or an array of equal ones."""

    name: str
    offset: int
    bits: int
    access: str
    reset: int
    fields: tuple[Field, ...]
    count: int = 1

    @property
    def size(self) -> int:
        return self.bits // 8


class Device:
    """The peripherals of one SVD file."""

    def __init__(self, path: Path) -> None:
        with reading(path, "an SVD file"):
            self._root = ET.parse(path).getroot()
        self.path = path
        self.name = self._root.findtext("name", "?")
        self.version = self._root.findtext("version", "?")
        self._peripherals = {p.findtext("name", ""): p for p in self._root.iter("peripheral")}

    def _peripheral(self, name: str) -> ET.Element:
        if name not in self._peripherals:
            raise FluxtrueError(f"{self.path}: no peripheral '{name}'")
        return self._peripherals[name]

    def base(self, peripheral: str) -> int:
        """Address of the peripheral."""
        return int(self._peripheral(peripheral).findtext("baseAddress", "0"), 0)

    def interrupts(self, peripheral: str) -> dict[str, int]:
        """Interrupt numbers by name."""
        found = self._peripheral(peripheral).iter("interrupt")
        return {i.findtext("name", ""): int(i.findtext("value", "0"), 0) for i in found}

    def registers(self, peripheral: str) -> dict[str, Register]:
        """The registers by name; ``NAME*`` stands for the array NAME0, NAME1 ... and for SVD's NAME%s."""
        element = self._peripheral(peripheral)
        if parent := element.get("derivedFrom"):
            element = self._peripheral(parent)
        found: dict[str, Register] = {}
        for node in element.iter("register"):
            found |= _expand(node)
        return _arrays(found) | found


def _number(node: ET.Element, tag: str, default: str = "0", largest: int = 0xFFFF_FFFF) -> int:
    found = int(node.findtext(tag) or default, 0)
    if not 0 <= found <= largest:
        raise ValueError(f"{tag} = {found:#x}, allowed: 0 to {largest:#x}")
    return found


def _name(node: ET.Element) -> str:
    """The name of a register or a field, which becomes a part of a C name; %s stands for a number."""
    found = node.findtext("name", "")
    if not _NAME.fullmatch(found):
        raise ValueError(f"name = {found[:60]!r}, allowed: a C name")
    return found


def _expand(node: ET.Element) -> dict[str, Register]:
    fields = tuple(
        Field(_name(f), _number(f, "bitOffset", largest=63), _number(f, "bitWidth", largest=64),
              f.findtext("access", "read-write"))
        for f in node.iter("field")
    )  # fmt: skip
    name, offset = _name(node), _number(node, "addressOffset")
    count, step = _number(node, "dim", "1", ARRAY_MAX), _number(node, "dimIncrement")
    bits = _number(node, "size", "32", largest=64)
    access, reset = node.findtext("access", "read-write"), _number(node, "resetValue")

    def member(text: str, place: int, number: int = 1) -> Register:
        return Register(text, place, bits, access, reset, fields, number)

    single = [member(name.replace("%s", str(k)), offset + k * step) for k in range(count)]
    found = {register.name: register for register in single}
    if count > 1 and step == bits // 8 and name.endswith("%s"):
        found[name.replace("%s", "*")] = member(name.removesuffix("%s"), offset, count)
    return found


def _arrays(registers: dict[str, Register]) -> dict[str, Register]:
    """Numbered registers that lie one after the other."""
    groups: dict[str, list[Register]] = {}
    for register in registers.values():
        if register.count == 1 and (match := re.fullmatch(r"(.*?)(\d+)", register.name)):
            groups.setdefault(match[1], []).append(register)
    arrays = {}
    for stem, members in groups.items():
        first = min(members, key=lambda r: r.offset)
        places = sorted(r.offset for r in members)
        if places == [first.offset + k * first.size for k in range(len(members))]:
            arrays[f"{stem}*"] = Register(stem, first.offset, first.bits, first.access, first.reset,
                                          first.fields, len(members))  # fmt: skip
    return arrays
