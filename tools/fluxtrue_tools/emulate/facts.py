# SPDX-License-Identifier: Apache-2.0
"""Register facts of the emulated peripherals, from the vendor's SVD file to one C table.

    python -m fluxtrue_tools.emulate.facts S32K144.svd tests/target/emulator/facts_table.c

The SVD comes with the crate s32k144 0.10.0 and is not part of the tree; names, offsets, reset values and the
fields' access are facts, everything else is left behind.
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.outputs import write_text

PERIPHERALS = (
    "MSCM", "FTFC", "DMA", "DMAMUX", "CAN0", "FTM0", "FTM2", "ADC0", "ADC1", "LPSPI0", "LPSPI1", "LPSPI2", "PDB0",
    "PDB1", "LPIT0", "SIM", "PORTA", "PORTB", "PORTC", "PORTD", "PORTE", "WDOG", "TRGMUX", "SCG", "PCC", "PMC", "SMC",
    "RCM", "PTA", "PTB", "PTC", "PTD", "PTE", "MCM", "LMEM",
)  # fmt: skip

# Masks that differ from the SVD's fields: the watchdog's counter register also takes 32-bit commands.
ANY_VALUE = {("WDOG", "CNT")}

# The bits of some registers have several meanings, of which a control bit chooses one. Those that are not modelled: of
# the DMA controller, offsets of a minor loop and links at its end.
OTHER_MEANINGS = {"DMA": ("_MLOFFNO", "_MLOFFYES", "_ELINKYES")}


@dataclass(frozen=True)
class Register:
    """One 8, 16 or 32-bit register."""

    name: str
    offset: int
    size: int
    reset: int
    writable: int
    fields: int


def _number(node: ElementTree.Element, tag: str) -> int:
    return int(node.findtext(tag, "0"), 0)


def _masks(node: ElementTree.Element) -> tuple[int, int]:
    """Bits that a write may change, and bits that are a field at all."""
    writable = fields = 0
    default = node.findtext("access", "read-write")
    for field in node.iter("field"):
        mask = ((1 << _number(field, "bitWidth")) - 1) << _number(field, "bitOffset")
        fields |= mask
        if field.findtext("access", default) != "read-only":
            writable |= mask
    return writable, fields


def registers(peripheral: ElementTree.Element) -> Iterator[Register]:
    """All registers, arrays unrolled."""
    for node in peripheral.iter("register"):
        writable, fields = _masks(node)
        if (peripheral.findtext("name"), node.findtext("name")) in ANY_VALUE:
            writable = fields = 0xFFFFFFFF
        name, offset = node.findtext("name", ""), _number(node, "addressOffset")
        if name.endswith(OTHER_MEANINGS.get(peripheral.findtext("name", ""), ())):
            continue
        for k in range(int(node.findtext("dim", "1"), 0)):
            yield Register(
                name.replace("%s", str(k)),
                offset + k * _number(node, "dimIncrement"),
                _number(node, "size") // 8,
                _number(node, "resetValue"),
                writable,
                fields,
            )


def table(device: ElementTree.Element) -> Iterator[str]:
    """The lines of the C file."""
    version = f"{device.findtext('name')} {device.findtext('version')}"
    yield "/* SPDX-License-Identifier: Apache-2.0 */"
    yield f"/* Written by tools/fluxtrue_tools/emulate/facts.py from the SVD file of {version}. */"
    yield '#include "facts.h"'
    yield ""
    nodes = {node.findtext("name"): node for node in device.iter("peripheral")}
    for name in PERIPHERALS:
        unique = {(r.offset, r.size): r for r in registers(nodes[name])}
        rows = sorted(unique.values(), key=lambda r: (r.offset, -r.size))
        yield f"static const fact_t {name.lower()}[] = {{"
        for r in rows:
            yield f'    {{"{r.name}", {r.offset:#x}, {r.size}, {r.reset:#x}, {r.writable:#x}, {r.fields:#x}}},'
        yield "};"
        yield ""
    yield "const facts_t facts[] = {"
    for name in PERIPHERALS:
        base = _number(nodes[name], "baseAddress")
        yield f'    {{"{name}", {base:#x}, {name.lower()}, sizeof {name.lower()} / sizeof {name.lower()}[0]}},'
    yield "};"
    yield "const int facts_count = sizeof facts / sizeof facts[0];"


def main(svd: Path, output: Path) -> None:
    """Write the table."""
    write_text(output, "\n".join(table(ElementTree.parse(svd).getroot())) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
