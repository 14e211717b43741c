# SPDX-License-Identifier: Apache-2.0
"""The worst case of each handler: callees first, then the callers with what their callees cost."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.bench import cycles, disassembly
from fluxtrue_tools.bench.disassembly import Function, Instruction, plain
from fluxtrue_tools.wcet import flow, lengths, lines, longest, loops, places, waits
from fluxtrue_tools.wcet.facts import Facts

COPIES = ("memcpy", "memset", "memmove")


@dataclass(frozen=True)
class Cost:
    """What an instruction costs, what a taken branch costs more, and what an exception costs before and after."""

    name: str
    of: Callable[[Instruction], int]
    taken: int
    around: int
    with_waits: bool = False  # for memories, the most


INSTRUCTIONS = Cost("instructions", lambda _: 1, 0, 0)
CYCLES = Cost("cycles", cycles.cycles, cycles.PIPELINE, cycles.ENTRY + cycles.RETURN)
MOST = Cost("most", CYCLES.of, CYCLES.taken, CYCLES.around + waits.AROUND, with_waits=True)


@dataclass(frozen=True)
class Annotated:
    """A loop with its statement, and how often its header may run each time it is entered."""

    loop: loops.Loop
    statement: lines.Statement | None
    where: str
    tests_first: bool  # the header runs once more, to leave the loop
    endless: bool  # nothing leaves the loop


class Image:
    """The functions of an image, their graphs and loops."""

    def __init__(self, functions: Iterable[Function], memory: flow.Memory, source: lines.Lines) -> None:
        self.lines, self._memory = source, memory
        self._functions = {f.name: f for f in functions}
        self.starts = {f.address: f.name for f in self._functions.values()}
        self._flows: dict[str, flow.Flow] = {}
        self._loops: dict[str, list[Annotated]] = {}
        self._waits: dict[str, waits.Waits] = {}
        self._arguments: dict[str, places.State] = {}

    @classmethod
    def read(cls, elf: Path) -> Image:
        return cls(disassembly.read(elf), flow.Memory.read(elf), lines.Lines.read(elf))

    @property
    def all(self) -> list[Function]:
        return list(self._functions.values())

    @property
    def functions(self) -> list[str]:
        return list(self._functions)

    def names(self, wanted: str) -> list[str]:
        """The image's functions made from a function of the source."""
        return [name for name in self._functions if plain(name) == wanted]

    def flow(self, name: str) -> flow.Flow:
        if name not in self._flows:
            self._flows[name] = flow.build(self._functions[name], self._memory)
        return self._flows[name]

    def loops(self, name: str) -> list[Annotated]:
        if name not in self._loops:
            graph = self.flow(name)
            found = loops.find(graph)
            statements = lines.Statements(graph, found, self.lines)
            self._loops[name] = [self._annotated(graph, loop, statements.of[loop.header]) for loop in found]
        return self._loops[name]

    def waits(self, name: str) -> waits.Waits:
        if name not in self._waits:
            listed = [one.loop for one in self.loops(name)]
            self._waits[name] = waits.most(self.flow(name), listed, self._memory, self._arguments.get(name, {}))
        return self._waits[name]

    def enter(self, handlers: Iterable[str], pointers: Mapping[str, list[str]]) -> None:
        """Find what the arguments of all functions that the handlers reach point into."""
        order: list[str] = []
        wanted = [*handlers, *(listed for functions in pointers.values() for listed in functions)]
        unknown = [name for function in wanted for name in self.names(function)]
        for name in unknown:
            self._callees_first(name, order)
        entered: dict[str, list[places.State]] = {name: [{}] for name in unknown}
        for name in reversed(order):
            self._arguments[name] = places.joined(entered[name])
            states = places.follow(self.flow(name), self._memory, self._arguments[name]).calls
            for call in (call for block in self.flow(name).blocks.values() for call in block.calls):
                target = self.starts.get(call.target) if call.target is not None else None
                if target is not None:
                    entered.setdefault(target, []).append(states[call.site])

    def _callees_first(self, name: str, order: list[str]) -> None:
        if name in order:
            return
        for call in (call for block in self.flow(name).blocks.values() for call in block.calls):
            if call.target is not None and call.target in self.starts:
                self._callees_first(self.starts[call.target], order)
        order.append(name)

    def _annotated(self, graph: flow.Flow, loop: loops.Loop, statement: lines.Statement | None) -> Annotated:
        if statement is not None:
            where = f"{statement.function}, {Path(statement.file).name}:{statement.head}: {statement.text}"
        else:
            line = self.lines.at(loop.header)
            where = f"{plain(loop.function)}, {Path(line.file).name}:{line.number}" if line else f"{loop.header:#x}"
        leaving = {b for b in loop.blocks if any(e.to not in loop.blocks for e in graph.blocks[b].edges)}
        return Annotated(loop, statement, where, not set(loop.latches) <= leaving, not leaving)


class Handlers:
    """Bounds of functions for one cost in one mode of operation; what is missing is collected in `problems`."""

    def __init__(self, image: Image, mode: str, facts: Facts, pointers: Mapping[str, list[str]], cost: Cost) -> None:
        self.image, self.mode, self.facts, self.cost = image, mode, facts, cost
        self.problems: set[str] = set()
        self.reached: set[str] = set()
        self._pointers = pointers
        self._known: dict[tuple[str, int], longest.Path | None] = {}
        self._lengths: dict[str, dict[int, int]] = {}
        self._excluded: dict[str, set[int]] = {}
        self._most_copied: dict[str, int] = {}

    def worst(self, name: str, copied: int = 0) -> int | None:
        """The bound of a function; None: it never returns. `copied`: bytes, of a function that copies."""
        key = name, copied
        if key not in self._known:
            self.reached.add(name)
            self._most_copied[name] = max(copied, self._most_copied.get(name, 0))
            self._known[key] = self._bound(name, copied)
        path = self._known[key]
        return path.cost if path else None

    def handler(self, name: str) -> int:
        """The bound of a function of the source that the processor calls."""
        found = [cost for copy in self.image.names(name) if (cost := self.worst(copy)) is not None]
        if not found:
            self.problems.add(f"{name}: not in the image, or it never returns")
        return max(found, default=0) + self.cost.around

    def header_runs(self, name: str) -> dict[int, int]:
        """How often the header of each loop runs at most each time the loop is entered."""
        copied = self._most_copied.get(name, 0)
        return {one.loop.header: self._header_runs(one, copied) for one in self.image.loops(name)}

    def excluded(self, name: str) -> set[int]:
        """Blocks that no run contains in this mode, or none that returns."""
        return self._excluded.get(name, set())

    def _bound(self, name: str, copied: int) -> longest.Path | None:
        graph, listed = self.image.flow(name), self.image.loops(name)
        runs = {one.loop.header: self._header_runs(one, copied) for one in listed}
        excluded = {header for header, most in runs.items() if most == 0}
        waited = self.image.waits(name) if self.cost.with_waits else waits.Waits()
        costs = {}
        for at, block in graph.blocks.items():
            costs[at] = sum(self.cost.of(i) for i in block.instructions) + waited.blocks.get(at, 0)
            if self._is_absent(block):
                excluded.add(at)
                continue
            for call in block.calls:
                below = self._called(name, block, call)
                if below is None:
                    excluded.add(at)
                else:
                    costs[at] += below
            if not block.edges and at not in excluded:
                self.problems.add(f"{name}: nothing follows the call at {block.calls[-1].site:#x}, which returns")
        self._excluded[name] = excluded
        own = longest.Costs(costs, self.cost.taken, waited.entered)
        return longest.longest(graph, [one.loop for one in listed], runs, own, excluded)

    def shares(self, name: str) -> dict[str, int]:
        """What the functions of the source have of the bound of a function of the image."""
        shares: dict[str, int] = {}
        self._add(shares, name, 0, 1)
        return shares

    def _add(self, shares: dict[str, int], name: str, copied: int, times: int) -> None:
        path, graph = self._known[name, copied], self.image.flow(name)
        for at, runs in path.runs.items() if path else ():
            block = graph.blocks[at]
            for instruction in block.instructions:
                place = self.image.lines.at(instruction.address)
                function = (lines.function_at(place) if place else "") or plain(name)
                shares[function] = shares.get(function, 0) + times * runs * self.cost.of(instruction)
            for call in block.calls:
                target = self.image.starts.get(call.target) if call.target is not None else None
                if target is not None:
                    self._add(shares, target, self._length(name, call) if target in COPIES else 0, times * runs)

    def _is_absent(self, block: flow.Block) -> bool:
        if not self.facts.absent:
            return False
        places = {self.image.lines.at(i.address) for i in block.instructions}
        return all(place is not None and lines.function_at(place) in self.facts.absent for place in places)

    def _header_runs(self, one: Annotated, copied: int) -> int:
        if one.statement is not None and one.statement.function in self.facts.absent:
            return 0
        if one.endless:
            return 1
        passes = self.facts.passes(one.loop, one.statement, self.image.lines.at(one.loop.header))
        if passes is None:
            self.problems.add(f"no bound for the loop of {one.where}")
            return 1
        return passes.of(copied) + int(one.tests_first)

    def _called(self, name: str, block: flow.Block, call: flow.Call) -> int | None:
        if call.target is None:
            return self._through_pointer(name)
        target = self.image.starts.get(call.target)
        if target is None:
            self.problems.add(f"{name}: calls {call.target:#x}, where no function begins")
            return 0
        if plain(target).partition(".")[0] in self.facts.absent:
            return None
        return self.worst(target, self._length(name, call) if target in COPIES else 0)

    def _through_pointer(self, name: str) -> int | None:
        targets = [copy for wanted in self._pointers.get(plain(name), []) for copy in self.image.names(wanted)]
        if not targets:
            self.problems.add(f"{name}: a call through a pointer is not listed")
            return 0
        return max((cost for cost in map(self.worst, targets) if cost is not None), default=None)

    def _length(self, name: str, call: flow.Call) -> int:
        """Bytes of a copy: a constant of the code, or the annotation of the function."""
        if name not in self._lengths:
            self._lengths[name] = lengths.at_calls(self.image.flow(name))
        if call.site in self._lengths[name]:
            return self._lengths[name][call.site]
        place = self.image.lines.at(call.site)
        function = lines.function_at(place) if place else ""
        annotated = self.facts.copied(function)
        if annotated is None:
            self.problems.add(f"no length for the copy in {function or hex(call.site)}")
            return 0
        return annotated
