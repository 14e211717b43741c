# SPDX-License-Identifier: Apache-2.0
"""One C header with the registers a port uses, from the maker's description."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.target.svd import Device, Register

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]  # goes into the header as it is
Pattern = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*\*?$")]


class Block(BaseModel):
    """One kind of peripheral: its instances, and the fields used of each register."""

    model_config = ConfigDict(extra="forbid")
    instances: Annotated[list[Name], Field(min_length=1)]
    registers: dict[Pattern, list[Name]]
    interrupts: list[Name] = []


class Wanted(BaseModel):
    """The list a port keeps."""

    model_config = ConfigDict(extra="forbid")
    device: Name
    guard: Name
    blocks: dict[Name, Block]


@dataclass(frozen=True)
class Chosen:
    """A block with its registers looked up."""

    name: str
    block: Block
    registers: list[tuple[Register, list[str]]]


def load(path: Path) -> Wanted:
    """Read and check the list."""
    try:
        return Wanted.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FluxtrueError(f"{path}: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise FluxtrueError(f"{path}: {place}: {first['msg']}") from error


def choose(wanted: Wanted, device: Device, path: Path) -> list[Chosen]:
    """Look everything up; a name the SVD file does not know is an error."""
    if wanted.device != device.name:
        raise FluxtrueError(f"{device.path}: describes {device.name}, {path} wants {wanted.device}")
    chosen = []
    for name, block in wanted.blocks.items():
        known = device.registers(block.instances[0])
        found = []
        for register, fields in block.registers.items():
            if register not in known:
                raise FluxtrueError(f"{path}: {name}: no register '{register}' in {device.name}")
            names = {f.name for f in known[register].fields}
            if unknown := set(fields) - names:
                raise FluxtrueError(f"{path}: {name}.{register}: no field '{min(unknown)}', "
                                    f"allowed: {', '.join(sorted(names))}")  # fmt: skip
            found.append((known[register], fields))
        found.sort(key=lambda pair: pair[0].offset)
        chosen.append(Chosen(name, block, found))
    return chosen


def _structure(chosen: Chosen) -> list[str]:
    lines, at, gap = ["typedef struct {"], 0, 0
    for register, _ in chosen.registers:
        if register.offset > at:
            lines.append(f"    uint8_t reserved{gap}[{register.offset - at:#x}];")
            gap += 1
        const = "const " if register.access == "read-only" else ""
        array = f"[{register.count}]" if register.count > 1 else ""
        lines.append(f"    {const}volatile uint{register.bits}_t {register.name}{array};")
        at = register.offset + register.size * register.count
    lines.append(f"}} {chosen.name}_t;")
    lines += [f"_Static_assert(offsetof({chosen.name}_t, {r.name}) == {r.offset:#x}, \"{r.name}\");"
              for r, _ in chosen.registers]  # fmt: skip
    return lines


def _fields(chosen: Chosen) -> list[str]:
    lines = []
    for register, used in chosen.registers:
        prefix = f"{chosen.name}_{register.name}".upper()
        if register.name.upper().startswith(f"{chosen.name}_".upper()):
            prefix = register.name.upper()
        for field in sorted((f for f in register.fields if f.name in used), key=lambda f: f.lsb):
            name = f"{prefix}_{field.name}".upper()
            if field.width == 1:
                lines.append(f"#define {name} {field.mask:#x}U")
            else:
                lines.append(f"#define {name}_MASK {field.mask:#x}U")
                lines.append(f"#define {name}(x) (((uint32_t)(x) << {field.lsb}) & {field.mask:#x}U)")
    return lines


def _instances(chosen: Chosen, device: Device, fake: bool) -> list[str]:
    lines = []
    for instance in chosen.block.instances:
        if fake:
            lines.append(f"extern {chosen.name}_t fake_{instance};")
            lines.append(f"#define {instance} (&fake_{instance})")
        else:
            lines.append(f"#define {instance} (({chosen.name}_t *){device.base(instance):#010x}U)")
    return lines


def header(wanted: Wanted, device: Device, chosen: list[Chosen], path: Path) -> str:
    """The C header."""
    lines = [
        "/* SPDX-License-Identifier: Apache-2.0 */",
        f"#ifndef {wanted.guard}",
        f"#define {wanted.guard}",
        f"/** Registers of the {device.name} that this port uses: names, addresses and bits.",
        f" * Source   {device.path.name}, version {device.version}; written by `tools/fluxtrue target registers`",
        f" *          from {path.name}: change that list, not this file",
        " * Context  private to the port; with FAKE_REGISTERS the instances are variables of a test */",
        "#include <stddef.h>",
        "#include <stdint.h>",
    ]
    for one in chosen:
        lines += ["", *_structure(one), *_fields(one)]
        for instance in one.block.instances:
            numbers = device.interrupts(instance)
            for name in one.block.interrupts:
                if name in numbers:
                    lines.append(f"#define IRQ_{name.upper()} {numbers[name]}U")
    lines += ["", "#if defined(FAKE_REGISTERS)"]
    for one in chosen:
        lines += _instances(one, device, fake=True)
    lines += ["#else"]
    for one in chosen:
        lines += _instances(one, device, fake=False)
    return "\n".join([*lines, "#endif", "", "#endif", ""])
