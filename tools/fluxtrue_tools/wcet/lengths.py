# SPDX-License-Identifier: Apache-2.0
"""How many bytes a copy has at most, where its length is a constant on every path to the call."""

from __future__ import annotations

from fluxtrue_tools.bench.cycles import base
from fluxtrue_tools.bench.disassembly import Instruction
from fluxtrue_tools.wcet.flow import Flow

LENGTH = "r2"
SEVERAL = ("pop", "ldmia", "ldmdb", "ldrd", "smull", "umull", "smlal", "umlal", "umaal", "vmov")  # results
READS = ("cmp", "cmn", "tst", "teq", "str", "strb", "strh", "strd", "stmia", "stmdb", "push", "cbz", "cbnz", "it")


def _after(instruction: Instruction, length: int | None) -> int | None:
    """The largest value of the register behind the instruction; None: not known."""
    name, conditional = base(instruction.mnemonic)
    if name in ("bl", "blx"):
        return None
    if name in READS or LENGTH not in instruction.operands.replace("{", " ").replace(",", " ").split():
        return length
    if not instruction.operands.startswith(f"{LENGTH},") and name not in SEVERAL:
        return length
    number = instruction.operands.partition("#")[2]
    if name not in ("mov", "movw") or not number.isdigit():
        return None
    if conditional:
        return None if length is None else max(length, int(number))
    return int(number)


def at_calls(flow: Flow) -> dict[int, int]:
    """The length by the address of the call, where it is known."""
    before = flow.before()
    behind: dict[int, int | None] = {}
    found: dict[int, int | None] = {}
    work = [flow.entry]
    while work:
        at = work.pop()
        known = [behind[b] for b in before[at] if b in behind]
        numbers = [length for length in known if length is not None]
        length = max(numbers) if numbers and len(numbers) == len(known) and at != flow.entry else None
        for instruction in flow.blocks[at].instructions:
            found[instruction.address] = length
            length = _after(instruction, length)
        if at not in behind or behind[at] != length:
            behind[at] = length
            work += flow.after(at)
    sites = [call.site for block in flow.blocks.values() for call in block.calls]
    return {site: length for site in sites if (length := found[site]) is not None}
