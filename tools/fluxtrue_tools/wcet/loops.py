# SPDX-License-Identifier: Apache-2.0
"""Natural loops of a control-flow graph and their nesting."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet.flow import Flow


@dataclass
class Loop:
    """The blocks between a block that is entered from outside and the blocks that lead back to it."""

    function: str
    header: int
    latches: list[int]
    blocks: set[int] = field(default_factory=set)
    parent: Loop | None = None
    inner: list[Loop] = field(default_factory=list)

    def own(self) -> set[int]:
        """Blocks that are in no loop within this one."""
        return self.blocks - {b for loop in self.inner for b in loop.blocks}


def _order(flow: Flow, successors: Mapping[int, list[int]]) -> list[int]:
    """Reverse postorder."""
    post: list[int] = []
    seen = {flow.entry}
    path: list[tuple[int, Iterator[int]]] = [(flow.entry, iter(successors[flow.entry]))]
    while path:
        at, left = path[-1]
        following = next((s for s in left if s not in seen), None)
        if following is None:
            post.append(at)
            path.pop()
        else:
            seen.add(following)
            path.append((following, iter(successors[following])))
    return post[::-1]


def _dominators(order: list[int], before: Mapping[int, list[int]]) -> dict[int, int]:
    """The immediate dominator of each block (Cooper, Harvey and Kennedy, A Simple, Fast Dominance Algorithm, 2001)."""
    place = {at: k for k, at in enumerate(order)}
    found = {order[0]: order[0]}
    changed = True
    while changed:
        changed = False
        for at in order[1:]:
            new = -1
            for other in (p for p in before[at] if p in found):
                a, b = other, new if new >= 0 else other
                while a != b:
                    while place[a] > place[b]:
                        a = found[a]
                    while place[b] > place[a]:
                        b = found[b]
                new = a
            if found.get(at) != new:
                found[at] = new
                changed = True
    return found


def _dominates(found: Mapping[int, int], upper: int, lower: int) -> bool:
    while lower != upper and found[lower] != lower:
        lower = found[lower]
    return lower == upper


def _body(header: int, latches: list[int], before: Mapping[int, list[int]]) -> set[int]:
    blocks, work = {header}, list(latches)
    while work:
        at = work.pop()
        if at not in blocks:
            blocks.add(at)
            work += before[at]
    return blocks


def _nest(loops: list[Loop]) -> list[Loop]:
    for loop in loops:
        around = [other for other in loops if other is not loop and loop.header in other.blocks]
        loop.parent = min(around, key=lambda other: len(other.blocks), default=None)
        if loop.parent is not None:
            loop.parent.inner.append(loop)
    return loops


def find(flow: Flow) -> list[Loop]:
    """All loops in order of their headers; one that can be entered at two places is an error."""
    successors = {at: flow.after(at) for at in flow.blocks}
    order = _order(flow, successors)
    place = {at: k for k, at in enumerate(order)}
    before = flow.before()
    dominators = _dominators(order, before)
    latches: dict[int, list[int]] = {}
    for at in order:
        for header in (s for s in successors[at] if place[s] <= place[at]):
            if not _dominates(dominators, header, at):
                raise FluxtrueError(f"{flow.name}: the loop at {header:#x} can be entered at two places")
            latches.setdefault(header, []).append(at)
    return _nest([Loop(flow.name, h, who, _body(h, who, before)) for h, who in sorted(latches.items())])
