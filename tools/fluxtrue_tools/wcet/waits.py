# SPDX-License-Identifier: Apache-2.0
"""The most that a function waits for its memories, by the model of tools/fluxtrue_tools/bench/memory.py.

What ran before is not known, so at first nothing is in the code cache. A line is known to be there if every path to an
instruction has fetched it and nothing later has taken its place (must analysis, one line for each set, which holds for
any replacement). A loop without calls whose lines have sets of their own fetches each line once for each time it is
entered. An access that may go to the flash is charged with its own line and with fetching the line again whose place it
may take.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from fluxtrue_tools.bench.disassembly import Instruction
from fluxtrue_tools.bench.memory import MOST
from fluxtrue_tools.wcet import places
from fluxtrue_tools.wcet.flow import Block, Flow, Memory
from fluxtrue_tools.wcet.loops import Loop

FLASH_END = 0x80000
VECTOR_WORDS, STACKED_WORDS = 1, 26 + 1  # with registers of the floating-point unit, aligned
Cache = dict[int, int]  # set: line

# An exception: its vector from the flash, its frame twice to and from SRAM_L.
AROUND = MOST.code_bus + MOST.fill + 2 * STACKED_WORDS * MOST.code_bus
# What one exception that preempts may cost the handler below: every line has to be fetched again.
DISPLACED = MOST.sets * MOST.fill


@dataclass
class Waits:
    """Cycles of each block, and those of each time a loop is entered, by its header."""

    blocks: dict[int, int] = field(default_factory=dict)
    entered: dict[int, int] = field(default_factory=dict)


def lines_of(instruction: Instruction) -> range:
    """Lines of the flash that it is fetched from, with those that are fetched ahead."""
    if instruction.address >= FLASH_END:
        return range(0)
    last = instruction.address + instruction.size + MOST.fetch_ahead_bytes - 1
    return range(instruction.address // MOST.line_bytes, last // MOST.line_bytes + 1)


def access_wait(place: str, store: bool, number: int) -> int:
    """Cycles of `number` accesses of one instruction."""
    narrow = MOST.narrow_store if store else 0
    cost = {places.SRAM_L: MOST.code_bus + narrow, places.SRAM_U: narrow, places.PERIPHERAL: MOST.peripheral,
            places.PRIVATE: 0, places.FLASH: MOST.code_bus + 2 * MOST.fill}  # fmt: skip
    # The firmware stores nothing to the flash.
    cost[places.UNKNOWN] = max(wait for memory, wait in cost.items() if memory != places.FLASH or not store)
    return number * cost[place]


def _steady(flow: Flow, loops: Iterable[Loop]) -> dict[int, set[int]]:
    """Outermost loops in which every line stays once it has been fetched, with these lines, by header."""
    found: dict[int, set[int]] = {}
    taken: set[int] = set()
    for loop in sorted(loops, key=lambda one: -len(one.blocks)):
        blocks = [flow.blocks[b] for b in loop.blocks]
        lines = {line for block in blocks for i in block.instructions for line in lines_of(i)}
        alone = len({line % MOST.sets for line in lines}) == len(lines)
        if alone and loop.header not in taken and not any(block.calls for block in blocks):
            found[loop.header] = lines
            taken |= loop.blocks
    return found


def _fetch(block: Block, cache: Cache) -> tuple[int, Cache]:
    """Waiting time of fetching the instructions of a block, and the lines known to be in the cache after it."""
    now = dict(cache)
    calls = {call.site for call in block.calls}
    waited = 0
    for instruction in block.instructions:
        for line in lines_of(instruction):
            if now.get(line % MOST.sets) != line:
                waited += MOST.fill
                now[line % MOST.sets] = line
        if instruction.address in calls:
            now = {}
    return waited, now


def _joined(caches: list[Cache]) -> Cache:
    first, *others = caches
    return {place: line for place, line in first.items() if all(other.get(place) == line for other in others)}


def _fetches(flow: Flow, inside: set[int]) -> dict[int, int]:
    before = flow.before()
    behind: dict[int, Cache] = {}
    waited: dict[int, int] = {}
    work = [flow.entry]
    while work:
        at = work.pop()
        known = [behind[b] for b in before[at] if b in behind]
        cache = {} if at == flow.entry or not known else _joined(known)
        if at in inside:
            waited[at], cache = 0, {}
        else:
            waited[at], cache = _fetch(flow.blocks[at], cache)
        if behind.get(at) != cache:
            behind[at] = cache
            work += flow.after(at)
    return waited


def most(flow: Flow, loops: list[Loop], memory: Memory, arguments: places.State) -> Waits:
    """What one run of the function waits at most, apart from the functions that it calls."""
    steady = _steady(flow, loops)
    inside = {block for loop in loops if loop.header in steady for block in loop.blocks}
    waits = Waits(_fetches(flow, inside), {h: MOST.fill * len(lines) for h, lines in steady.items()})
    accessed = places.follow(flow, memory, arguments).accesses
    for at, block in flow.blocks.items():
        for instruction in (i for i in block.instructions if i.address in accessed):
            place, store = accessed[instruction.address]
            waits.blocks[at] += access_wait(place, store, places.accesses(instruction))
    return waits
