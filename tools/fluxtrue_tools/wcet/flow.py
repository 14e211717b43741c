# SPDX-License-Identifier: Apache-2.0
"""The control-flow graph of a function of a linked image: basic blocks, edges, calls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from elftools.elf.elffile import ELFFile

from fluxtrue_tools.bench import stack
from fluxtrue_tools.bench.cycles import base
from fluxtrue_tools.bench.disassembly import Function, Instruction
from fluxtrue_tools.errors import FluxtrueError

PADDING = (("nop", ""), ("movs", "r0, r0"))  # between functions; the second one is zero
SHF_ALLOC = 2


@dataclass(frozen=True)
class Edge:
    """From a block to a block; `to` is None where the function is left. `taken`: not to the next one in memory."""

    to: int | None
    taken: bool


@dataclass(frozen=True)
class Call:
    """A call or a tail call; `target` is None for a call through a pointer."""

    site: int
    target: int | None


@dataclass
class Block:
    """Instructions that run one after the other, and where the last one leads."""

    address: int
    instructions: list[Instruction] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    calls: list[Call] = field(default_factory=list)


@dataclass
class Flow:
    """One function; only blocks that its first instruction reaches."""

    name: str
    entry: int
    blocks: dict[int, Block]

    def after(self, at: int) -> list[int]:
        """The blocks that may follow a block."""
        return [edge.to for edge in self.blocks[at].edges if edge.to is not None]

    def before(self) -> dict[int, list[int]]:
        """The blocks that each block may follow."""
        found: dict[int, list[int]] = {at: [] for at in self.blocks}
        for at in self.blocks:
            for follower in self.after(at):
                found[follower].append(at)
        return found


class Memory:
    """The bytes of the file that are in memory when the image runs."""

    def __init__(self, sections: Iterable[tuple[int, bytes]]) -> None:
        self._sections = list(sections)

    @classmethod
    def read(cls, elf: Path) -> Memory:
        with elf.open("rb") as file:
            return cls((s["sh_addr"], s.data()) for s in ELFFile(file).iter_sections()
                       if s["sh_flags"] & SHF_ALLOC and s["sh_type"] != "SHT_NOBITS")  # fmt: skip

    def number(self, address: int, size: int) -> int:
        for begin, content in self._sections:
            if begin <= address and address + size <= begin + len(content):
                return int.from_bytes(content[address - begin : address - begin + size], "little")
        raise FluxtrueError(f"the image has no content at {address:#x}")


def table_targets(instruction: Instruction, code: Mapping[int, Instruction], memory: Memory) -> list[int]:
    """Where a TBB or TBH may go. The table begins behind the instruction and ends at the first of its targets."""
    width = 1 if instruction.mnemonic.startswith("tbb") else 2
    table = at = instruction.address + instruction.size
    targets: set[int] = set()
    while not targets or at < min(targets):
        target = table + 2 * memory.number(at, width)
        if target not in code:
            break
        targets.add(target)
        at += width
    if not targets:
        raise FluxtrueError(f"the jump table at {table:#x} has no target in its function")
    return sorted(targets)


def _return(instruction: Instruction, name: str) -> tuple[list[Edge], list[Call]]:
    through_pointer = name == "bx" and instruction.operands != "lr"
    return [Edge(None, True)], [Call(instruction.address, None)] if through_pointer else []


class _Builder:
    """Edges and calls of each instruction, then blocks."""

    def __init__(self, function: Function, memory: Memory) -> None:
        self.function, self.memory = function, memory
        self.code = {i.address: i for i in function.instructions}

    def _jump(self, instruction: Instruction) -> tuple[list[Edge], list[Call]]:
        target = instruction.target
        if target in self.code:
            return [Edge(target, True)], []
        return [Edge(None, True)], [Call(instruction.address, target)]

    def step(self, instruction: Instruction) -> tuple[list[Edge], list[Call]]:
        name, conditional = base(instruction.mnemonic)
        follows = [Edge(instruction.address + instruction.size, False)]
        if name in ("tbb", "tbh"):
            return [Edge(t, True) for t in table_targets(instruction, self.code, self.memory)], []
        if name in ("bl", "blx"):
            if follows[0].to not in self.code:
                follows = []  # the called function does not return
            return follows, [Call(instruction.address, instruction.target if name == "bl" else None)]
        if name in ("b", "cbz", "cbnz"):
            edges, calls = self._jump(instruction)
            return edges + (follows if name != "b" or conditional else []), calls
        if name == "ldr" and instruction.far is not None:
            return self._jump(instruction)
        if stack.ends_function(instruction, name):
            edges, calls = _return(instruction, name)
            return edges + (follows if conditional else []), calls
        return follows, []

    def build(self) -> Flow:
        steps: dict[int, tuple[list[Edge], list[Call]]] = {}
        work = [self.function.address]
        while work:
            at = work.pop()
            if at in steps:
                continue
            if at not in self.code:
                raise FluxtrueError(f"{self.function.name}: runs on to {at:#x}, where it has no instruction")
            steps[at] = self.step(self.code[at])
            work += [e.to for e in steps[at][0] if e.to is not None]
        self._refuse_unreached(steps)
        return Flow(self.function.name, self.function.address, self._blocks(steps))

    def _refuse_unreached(self, steps: Mapping[int, object]) -> None:
        left = [a for a, i in self.code.items() if a not in steps and (i.bare, i.operands) not in PADDING]
        if left:
            raise FluxtrueError(f"{self.function.name}: nothing leads to the instruction at {left[0]:#x}")

    def _blocks(self, steps: Mapping[int, tuple[list[Edge], list[Call]]]) -> dict[int, Block]:
        begins = {self.function.address}
        for at, (edges, _) in steps.items():
            if len(edges) != 1 or edges[0].taken:
                begins |= {e.to for e in edges if e.to is not None}
                begins.add(at + self.code[at].size)
        blocks: dict[int, Block] = {}
        for at in sorted(begins & set(steps)):
            block = blocks[at] = Block(at)
            here = at
            while True:
                edges, calls = steps[here]
                block.instructions.append(self.code[here])
                block.calls += calls
                here += self.code[here].size
                if here in begins or len(edges) != 1 or edges[0].taken:
                    block.edges = edges
                    break
        return blocks


def build(function: Function, memory: Memory) -> Flow:
    """The graph of one function."""
    return _Builder(function, memory).build()
