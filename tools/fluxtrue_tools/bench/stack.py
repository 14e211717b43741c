# SPDX-License-Identifier: Apache-2.0
"""The deepest stack of an image, from its own instructions.

The optimiser works across files and leaves no call graph of the sources that still holds; the linked image is what
runs. Each function is followed along all of its paths with the movements of the stack pointer; calls, tail calls and
jumps make the graph. What cannot be known from the code (a call through a pointer) must be listed by hand.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from fluxtrue_tools.bench.cycles import base
from fluxtrue_tools.bench.disassembly import Function, Instruction, plain, words

FRAME_WORDS, EXTENDED_WORDS, ALIGN_WORDS = 8, 26, 1
HEAP = re.compile(r"_?(malloc|calloc|realloc|free|sbrk)(_r)?$")
_IMMEDIATE = re.compile(r"#(-?\d+)")
_INTO_SP = re.compile(r"^sp\b")


@dataclass
class Node:
    """One function: own stack, calls with the depth they happen at, and what is not known."""

    name: str
    deepest: int = 0
    calls: dict[str, int] = field(default_factory=dict)
    indirect: dict[int, int] = field(default_factory=dict)  # address, depth
    unknown: list[str] = field(default_factory=list)
    floats: bool = False


def movement(instruction: Instruction) -> int | None:
    """Bytes by which the stack grows; None: cannot be known."""
    name, _ = base(instruction.mnemonic)
    text = instruction.operands
    sizes = {"push": 1, "vpush": 1, "pop": -1, "vpop": -1}
    if name in sizes:
        return 4 * words(text) * sizes[name]
    if text.startswith("sp!"):
        return 4 * words(text) * (1 if name.endswith("db") and name[-4] != "l" and "st" in name else -1)
    if "[sp" in text and (text.endswith("]!") or re.search(r"\[sp\], #", text)):
        return -int(_IMMEDIATE.findall(text)[-1])
    if not _INTO_SP.match(text) or name in ("cmp", "cmn", "tst") or name[:3] in ("stm", "ldm"):
        return 0
    number = _IMMEDIATE.search(text)
    operands = [part.strip() for part in text.split(",")]
    if number and name in ("sub", "subw", "add", "addw") and set(operands[:-1]) == {"sp"}:
        return int(number.group(1)) * (1 if name.startswith("sub") else -1)
    return None


def ends_function(instruction: Instruction, name: str) -> bool:
    """Whether the instruction ends the function: a return, or a jump through a register."""
    into_pc = name in ("pop", "ldm", "ldmia") and "pc" in instruction.operands
    return name == "bx" or into_pc or (name in ("ldr", "mov") and instruction.operands.startswith("pc"))


class _Walk:
    """All paths through one function."""

    def __init__(self, function: Function, starts: Mapping[int, str]) -> None:
        self.node = Node(function.name)
        self.code = {i.address: i for i in function.instructions}
        self.entry, self.starts = function.address, starts
        self.seen: dict[int, int] = {}
        self.work: list[tuple[int, int]] = [(function.address, 0)]
        self.tables: list[int] = []

    def run(self) -> Node:
        self._drain()
        # Instructions that only a jump table leads to have the depth of that jump.
        while self.tables and (left := [a for a in self.code if a not in self.seen]):
            self.work.append((left[0], max(self.tables)))
            self._drain()
        self.node.floats = any(i.mnemonic.startswith("v") for i in self.code.values())
        return self.node

    def _drain(self) -> None:
        while self.work:
            at, depth = self.work.pop()
            if at not in self.code or self.seen.get(at, -1) >= depth:
                continue
            if at in self.seen:
                self.node.unknown.append(f"{at:#x}: reached with {self.seen[at]} and {depth} bytes of stack")
                continue
            self.seen[at] = depth
            self._step(self.code[at], depth)

    def _jump(self, target: int, depth: int) -> None:
        if target in self.code and target != self.entry:
            self.work.append((target, depth))
        elif target != self.entry:
            self._call(target, depth)

    def _call(self, target: int, depth: int) -> None:
        name = self.starts.get(target)
        if name is None:
            self.node.unknown.append(f"calls {target:#x}, where no function begins")
        else:
            self.node.calls[name] = max(depth, self.node.calls.get(name, 0))

    def _step(self, instruction: Instruction, depth: int) -> None:
        node = self.node
        name, conditional = base(instruction.mnemonic)
        moved = movement(instruction)
        if moved is None:
            node.unknown.append(f"{instruction.address:#x}: {instruction.mnemonic} {instruction.operands}")
            moved = 0
        after = depth + moved
        node.deepest = max(node.deepest, depth, after)
        if name == "msr" and "MSP" in instruction.operands.upper():
            node.unknown.append(f"{instruction.address:#x}: sets the stack pointer")
        if self._goes_away(instruction, name, conditional, after):
            return
        leaves = ends_function(instruction, name)
        if not leaves or conditional:
            # A conditional return that is not taken leaves the stack as it was.
            self.work.append((instruction.address + instruction.size, depth if leaves else after))

    def _goes_away(self, instruction: Instruction, name: str, conditional: bool, depth: int) -> bool:
        """Record where the instruction leads; true if the next one in memory never follows."""
        target = instruction.target
        into_pc = name == "ldr" and instruction.operands.startswith("pc") and "[sp]" not in instruction.operands
        if name in ("tbb", "tbh"):
            self.tables.append(depth)
            return True
        if into_pc and target is not None:
            self._jump(target, depth)
            return not conditional
        if name == "blx" or (name == "bx" and instruction.operands != "lr") or into_pc:
            self.node.indirect[instruction.address] = depth
        elif name == "bl" and target is not None:
            self._call(target, depth)
        elif name in ("b", "cbz", "cbnz") and target is not None:
            self._jump(target, depth)
            return name == "b" and not conditional
        return False


def graph(functions: Iterable[Function]) -> dict[str, Node]:
    """All functions by name."""
    listed = list(functions)
    starts = {f.address: f.name for f in listed}
    return {f.name: _Walk(f, starts).run() for f in listed}


@dataclass(frozen=True)
class Level:
    """A priority: its handlers, of which one runs at a time."""

    name: str
    handlers: tuple[str, ...]


@dataclass(frozen=True)
class Use:
    """Worst case of one level."""

    name: str
    handler: str
    path: tuple[str, ...]
    stack: int
    frame: int  # what the exception stacks of the level below
    floats: bool


class Depths:
    """Worst stack of each function; problems are collected, not raised."""

    def __init__(self, nodes: dict[str, Node], pointers: Mapping[str, Sequence[str]]) -> None:
        self.nodes = nodes
        self.problems: list[str] = []
        self._pointers = pointers
        self._known: dict[str, tuple[int, tuple[str, ...], bool]] = {}
        self._open: list[str] = []

    def find(self, name: str) -> str | None:
        """The image's name of a function of the source."""
        return name if name in self.nodes else next((n for n in self.nodes if plain(n) == name), None)

    def worst(self, name: str) -> tuple[int, tuple[str, ...], bool]:
        """Bytes, the path that takes them, and whether any function of the tree uses the floating-point unit."""
        if name in self._known:
            return self._known[name]
        if name in self._open:
            self.problems.append("recursion: " + " > ".join([*self._open[self._open.index(name) :], name]))
            return 0, (), False
        self._open.append(name)
        node = self.nodes[name]
        self.problems += [f"{name}: stack not known: {what}" for what in node.unknown]
        calls = node.calls | self._through_pointers(node)
        deepest, path, floats = node.deepest, (name,), node.floats
        for callee, depth in sorted(calls.items()):
            below, way, also = self.worst(callee)
            floats = floats or also
            if depth + below > deepest:
                deepest, path = depth + below, (name, *way)
        self._open.pop()
        self._known[name] = deepest, path, floats
        return self._known[name]

    def _through_pointers(self, node: Node) -> dict[str, int]:
        if not node.indirect:
            return {}
        targets = self._pointers.get(plain(node.name))
        if targets is None:
            where = ", ".join(f"{a:#x}" for a in node.indirect)
            self.problems.append(f"{node.name}: calls through a pointer at {where}; list what it may call")
            return {}
        found = {}
        for target in targets:
            name = self.find(target)
            if name is None:
                self.problems.append(f"{node.name}: listed as calling '{target}', which is not in the image")
            else:
                found[name] = max(node.indirect.values())
        return found


def heap(names: Iterable[str]) -> list[str]:
    """Functions of a heap among the symbols."""
    return sorted(f"heap: the image contains '{name}'" for name in names if HEAP.match(name))


def levels(depths: Depths, wanted: Sequence[Level]) -> list[Use]:
    """From the background up: worst case of each level, and the frame with which it interrupts the one below."""
    uses: list[Use] = []
    for level in wanted:
        cases = []
        for handler in level.handlers:
            name = depths.find(handler)
            if name is None:
                depths.problems.append(f"level '{level.name}': no function '{handler}' in the image")
            else:
                cases.append((*depths.worst(name), name))
        if not cases:
            continue
        stack, path, _, handler = max(cases)
        below_floats = bool(uses) and uses[-1].floats
        frame = 4 * ((EXTENDED_WORDS if below_floats else FRAME_WORDS) + ALIGN_WORDS) if uses else 0
        uses.append(Use(level.name, handler, path, stack, frame, any(c[2] for c in cases)))
    return uses
