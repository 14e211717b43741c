# SPDX-License-Identifier: Apache-2.0
"""The memory that each load and store of a function accesses, as far as it follows from its code.

Followed are addresses that the code contains: literals, MOVW with MOVT, the stack pointer, and what is computed from
them. Assumed is that an address plus or minus anything stays in its memory. All else is not known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from fluxtrue_tools.bench.cycles import base
from fluxtrue_tools.bench.disassembly import Instruction, words
from fluxtrue_tools.wcet.flow import Flow, Memory

UNKNOWN, FLASH, SRAM_L, SRAM_U, PERIPHERAL, PRIVATE = "unknown", "flash", "SRAM_L", "SRAM_U", "peripheral", "private"
BEGINS = ((0xE000_0000, PRIVATE), (0x4000_0000, PERIPHERAL), (0x2000_0000, SRAM_U), (0x1C00_0000, SRAM_L), (0, FLASH))
ARGUMENTS = ("r0", "r1", "r2", "r3")
CLOBBERED = ("r0", "r1", "r2", "r3", "ip", "lr")
STORES = ("str", "strb", "strh", "strd", "stmia", "stmdb", "push", "vpush", "vstr", "vstmia", "vstmdb")
LOADS = ("ldr", "ldrb", "ldrh", "ldrsb", "ldrsh", "ldrd", "ldmia", "ldmdb", "pop", "vpop", "vldr", "vldmia", "vldmdb",
         "tbb", "tbh")  # fmt: skip
KEEPING = ("add", "addw", "sub", "subw", "mov")
_BASE = re.compile(r"\[(\w+)")
_REGISTER = re.compile(r"\b(?:r\d+|sl|fp|ip|sp|lr|pc|r1[0-5])\b")
_NUMBER = re.compile(r"#(-?\d+)")
State = dict[str, str]


def memory_at(address: int) -> str:
    return next(name for begin, name in BEGINS if address >= begin)


def accesses(instruction: Instruction) -> int:
    """Words, or less, that it loads or stores; each is an access."""
    name, _ = base(instruction.mnemonic)
    if name in ("ldrd", "strd"):
        return 2
    if name in ("vldr", "vstr"):
        return 2 if instruction.operands.startswith("d") else 1
    return words(instruction.operands) if "{" in instruction.operands else 1


def _address_register(instruction: Instruction, name: str) -> str:
    if name in ("push", "pop", "vpush", "vpop"):
        return "sp"
    found = _BASE.search(instruction.operands)
    return found.group(1) if found else instruction.operands.partition(",")[0].rstrip("!").strip()


def access(instruction: Instruction, state: Mapping[str, str]) -> tuple[str, bool] | None:
    """The memory and whether it is a store; None: no access to memory."""
    name, _ = base(instruction.mnemonic)
    if name not in STORES and name not in LOADS:
        return None
    register = _address_register(instruction, name)
    place = FLASH if register == "pc" else SRAM_L if register == "sp" else state.get(register, UNKNOWN)
    return place, name in STORES


def literal(instruction: Instruction, memory: Memory) -> int | None:
    """The value that the instruction loads from beside the code."""
    name, conditional = base(instruction.mnemonic)
    if name != "ldr" or conditional or "[pc" not in instruction.operands:
        return None
    offset = _NUMBER.search(instruction.operands)
    return memory.number((instruction.address + 4 & ~3) + int(offset.group(1)) if offset else 0, 4)


def _written(instruction: Instruction, name: str) -> list[str]:
    """Registers that may have another value afterwards."""
    if name in ("bl", "blx"):
        return [*CLOBBERED]
    if name in ("cmp", "cmn", "tst", "teq", "b", "cbz", "cbnz", "bx", "it", "nop", *STORES):
        return (
            [_address_register(instruction, name)]
            if "!" in instruction.operands or "]," in instruction.operands
            else []
        )
    registers: list[str] = _REGISTER.findall(instruction.operands)
    if "{" in instruction.operands:
        return registers
    if name in ("ldrd", "smull", "umull", "smlal", "umlal", "umaal", "smlalbb", "smlald", "smlsld"):
        return registers[:2]
    return registers[:1] + ([_address_register(instruction, name)] if "!" in instruction.operands else [])


def _pointed(instruction: Instruction, name: str, state: State, memory: Memory) -> str | None:
    """The memory that the result of an instruction points into; None: not known, or it may be the flash."""
    registers = _REGISTER.findall(instruction.operands)
    place: str | None = None
    if (value := literal(instruction, memory)) is not None:
        place = memory_at(value)
    elif name in ("movt", "mov") and (number := _NUMBER.search(instruction.operands)):
        place = memory_at(int(number.group(1)) << (16 if name == "movt" else 0) & 0xFFFF_FFFF)
    elif name in KEEPING:
        sources = registers[1:] or registers[:1]
        place = next((state[r] for r in sources if r in state), SRAM_L if "sp" in registers[1:] else None)
    return None if place == FLASH else place


def after(instruction: Instruction, state: State, memory: Memory) -> State:
    """The memories that the registers point into behind the instruction."""
    name, conditional = base(instruction.mnemonic)
    moved = "!" in instruction.operands or "]," in instruction.operands
    address = _address_register(instruction, name) if moved else ""  # remains in its memory
    written = [r for r in _written(instruction, name) if r not in ("sp", address)]
    place = _pointed(instruction, name, state, memory)
    new = dict(state)
    for register in written:
        if place is not None and (not conditional or state.get(register) == place):
            new[register] = place
        else:
            new.pop(register, None)
    return new


def joined(states: list[State]) -> State:
    """What holds in all of them."""
    first, *others = states
    return {r: place for r, place in first.items() if all(other.get(r) == place for other in others)}


@dataclass
class Followed:
    """The memory of each access of a function and what its arguments point into at each call, by address."""

    accesses: dict[int, tuple[str, bool]] = field(default_factory=dict)
    calls: dict[int, State] = field(default_factory=dict)


def follow(flow: Flow, memory: Memory, arguments: State) -> Followed:
    """All of a function, of whose arguments is known what they point into."""
    before = flow.before()
    behind: dict[int, State] = {}
    found = Followed()
    sites = {call.site for block in flow.blocks.values() for call in block.calls}
    work = [flow.entry]
    while work:
        at = work.pop()
        known = [behind[b] for b in before[at] if b in behind]
        if at == flow.entry:
            known.append(arguments)
        state = joined(known)
        for instruction in flow.blocks[at].instructions:
            if (place := access(instruction, state)) is not None:
                found.accesses[instruction.address] = place
            if instruction.address in sites:
                found.calls[instruction.address] = {r: state[r] for r in ARGUMENTS if r in state}
            state = after(instruction, state, memory)
        if behind.get(at) != state:
            behind[at] = state
            work += flow.after(at)
    return found
