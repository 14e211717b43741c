# SPDX-License-Identifier: Apache-2.0
"""Which memory each load and store of a function goes to, as far as its own code tells.

Followed are addresses that the code contains: literals, MOVW with MOVT, the stack pointer, and what is computed from
them. Assumed is that an address plus or minus anything stays in its memory. All else is not known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from fluxtrue_tools.bench.cycles import base
from fluxtrue_tools.bench.disassembly import Instruction, words
from fluxtrue_tools.wcet.flow import Flow, Memory

UNKNOWN, FLASH, SRAM_L, SRAM_U, PERIPHERAL, PRIVATE = "unknown", "flash", "SRAM_L", "SRAM_U", "peripheral", "private"
BEGINS = ((0xE000_0000, PRIVATE), (0x4000_0000, PERIPHERAL), (0x2000_0000, SRAM_U), (0x1C00_0000, SRAM_L), (0, FLASH))
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
    elif name == "movt" and (number := _NUMBER.search(instruction.operands)):
        place = memory_at(int(number.group(1)) << 16)
    elif name in KEEPING:
        sources = registers[1:] or ([] if name == "mov" else registers[:1])
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


def _joined(states: list[State]) -> State:
    first, *others = states
    return {r: place for r, place in first.items() if all(other.get(r) == place for other in others)}


def follow(flow: Flow, memory: Memory) -> dict[int, tuple[str, bool]]:
    """The memory of each access of a function, by the address of the instruction."""
    before = flow.before()
    behind: dict[int, State] = {}
    found: dict[int, tuple[str, bool]] = {}
    work = [flow.entry]
    while work:
        at = work.pop()
        known = [behind[b] for b in before[at] if b in behind]
        state: State = {} if at == flow.entry or not known else _joined(known)
        for instruction in flow.blocks[at].instructions:
            if (place := access(instruction, state)) is not None:
                found[instruction.address] = place
            state = after(instruction, state, memory)
        if behind.get(at) != state:
            behind[at] = state
            work += flow.after(at)
    return found
