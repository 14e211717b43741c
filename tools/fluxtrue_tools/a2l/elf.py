# SPDX-License-Identifier: Apache-2.0
"""What an ELF file of the firmware says about its calibration values and measurements.

The source lists them once (firmware/calibration/calibration_list.h, measurement_list.h, and the lists of names such as
FAULT_LIST); firmware/ecu/a2l_records.c puts the lists, with offsets, into a section that is never loaded.
"""

import re
import struct
from dataclasses import dataclass
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading

SECTION = ".a2l"
OBJECT = "ecu"
MOTOR = "motor"
# kind, name, text, unit, type, base, lo, hi, count, offset: a2l_record_t.
RECORD = struct.Struct("<8s40s112s12s8s12sffII")
RANGES = {"U32": (0.0, 4294967295.0), "U16": (0.0, 65535.0), "U8": (0.0, 255.0), "S16": (-32768.0, 32767.0)}
ADDRESS_MAX = 0xFFFFFFFF
Q15_ONE = 32768.0


@dataclass(frozen=True)
class Value:
    """One calibratable value or one measurement."""

    name: str
    text: str
    unit: str
    type: str
    base: str
    lo: float
    hi: float
    address: int
    count: int = 0  # of an array


@dataclass(frozen=True)
class Base:
    """What 2^15 stands for in a per-unit measurement."""

    name: str
    unit: str
    full: float

    @property
    def factor(self) -> float:
        """Physical value of one step."""
        return self.full / Q15_ONE


@dataclass(frozen=True)
class Signal:
    """One signal that the scope can capture."""

    name: str
    text: str
    base: Base
    number: int  # by which commands name it


@dataclass(frozen=True)
class Word:
    """What a value, or a bit, of a measurement with this base means."""

    base: str
    is_bit: bool
    value: int
    name: str
    text: str


@dataclass(frozen=True)
class Description:
    """Everything that the description file contains."""

    machine: str
    values: tuple[Value, ...]
    measurements: tuple[Value, ...]
    frozen: tuple[Value, ...]  # before the first fault; not recorded, read once
    bases: tuple[Base, ...]
    step_s: float  # of the 1 kHz task: the faster raster
    words: tuple[Word, ...] = ()
    period_s: float = 0.0  # of the PWM
    scope: tuple[Value, ...] = ()  # state and memory of the scope
    signals: tuple[Signal, ...] = ()


def _text(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii")


def _symbol(elf: ELFFile, path: Path, name: str) -> int:
    for section in elf.iter_sections():
        if isinstance(section, SymbolTableSection):
            for symbol in section.get_symbol_by_name(name) or ():
                if symbol["st_shndx"] != "SHN_UNDEF":
                    return int(symbol["st_value"])
    raise FluxtrueError(f"{path}: no symbol '{name}': not a firmware that serves XCP")


def _bytes_at(elf: ELFFile, path: Path, address: int, size: int) -> bytes:
    for segment in elf.iter_segments("PT_LOAD"):
        start, length = segment["p_vaddr"], segment["p_filesz"]
        if start <= address and address + size <= start + length:
            offset = address - start
            return bytes(segment.data()[offset : offset + size])
    raise FluxtrueError(f"{path}: nothing is stored at address {address:#x}")


def _records(elf: ELFFile, path: Path) -> list[tuple[str, Value, int]]:
    section = elf.get_section_by_name(SECTION)
    if section is None:
        raise FluxtrueError(f"{path}: no section '{SECTION}': not a firmware that serves XCP")
    data = bytes(section.data())
    if len(data) % RECORD.size:
        raise FluxtrueError(f"{path}: section '{SECTION}' has {len(data)} bytes, "
                            f"allowed: a multiple of {RECORD.size}")  # fmt: skip
    records = []
    for kind, name, text, unit, type_, base, lo, hi, count, offset in RECORD.iter_unpack(data):
        value = Value(_text(name), _text(text), _text(unit), _text(type_), _text(base), lo, hi, 0, count)
        records.append((_text(kind), value, offset))
    return records


def _unit_of(name: str, unit: str) -> str:
    """A measurement's name ends in its unit."""
    match = re.search(r"_(A|V|Nm|Vs|rpm|ohm|C|Hz|W|ms)$", name)
    return unit or (match.group(1) if match else "")


def _placed(value: Value, path: Path, address: int, base: Base | None) -> Value:
    if not 0 < address <= ADDRESS_MAX:
        raise FluxtrueError(f"{path}: '{value.name}' lies at {address:#x}, allowed: 32-bit addresses "
                            "(link at a fixed address)")  # fmt: skip
    lo, hi = value.lo, value.hi
    if base is not None:
        lo, hi = -base.full, base.full * (1.0 - 1.0 / Q15_ONE)
    elif lo == hi == 0.0:
        lo, hi = RANGES.get(value.type, (-3.4e38, 3.4e38))
    unit = _unit_of(value.name, value.unit)
    return Value(value.name, value.text, unit, value.type, value.base, lo, hi, address, value.count)


def read(path: Path) -> Description:
    """Description of the firmware in an ELF file."""
    with reading(path, "an ELF file of the firmware"), path.open("rb") as stream:
        return _describe(ELFFile(stream), path)


def _scale(name: str, bases: dict[str, Base]) -> Base:
    """The base of a captured signal; two of them are not the motor's."""
    fixed = {"ANGLE": Base("ANGLE", "deg", 180.0), "NONE": Base("NONE", "", Q15_ONE)}
    if name == "ZERO":
        return Base(name, "A", 8.0 * bases["CURRENT"].full)  # Q28: the upper half has three bits fewer than Q15
    return fixed[name] if name in fixed else bases[name]


def _describe(elf: ELFFile, path: Path) -> Description:
    records = _records(elf, path)
    ecu, motor = _symbol(elf, path, OBJECT), _symbol(elf, path, MOTOR)
    bases, times = {"ONE": Base("ONE", "", 1.0)}, {"step_s": 1e-3, "period_s": 0.0}
    for kind, value, offset in records:
        if kind in ("base", "step"):
            (number,) = struct.unpack("<f", _bytes_at(elf, path, motor + offset, 4))
            if kind == "base":
                bases[value.name] = Base(value.name, value.unit, number)
            else:
                times[value.name] = number
    placed = {
        wanted: tuple(
            _placed(value, path, ecu + offset, bases.get(value.base))
            for kind, value, offset in records if kind == wanted
        )
        for wanted in ("value", "measure", "frozen", "scope")
    }  # fmt: skip
    for kind, what in (("value", "value to calibrate"), ("measure", "measurement")):
        if not placed[kind]:
            raise FluxtrueError(f"{path}: section '{SECTION}' has no {what}: not a firmware that serves XCP")
    words = tuple(Word(value.base, kind == "bit", number, value.name.lower(), value.text)
                  for kind, value, number in records if kind in ("word", "bit"))  # fmt: skip
    signals = tuple(Signal(value.name, value.text, _scale(value.base, bases), number)
                    for kind, value, number in records if kind == "signal")  # fmt: skip
    return Description("fluxtrue", placed["value"], placed["measure"], placed["frozen"], tuple(bases.values()),
                       times["step_s"], words, times["period_s"], placed["scope"], signals)  # fmt: skip
