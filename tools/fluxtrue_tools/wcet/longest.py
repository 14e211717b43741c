# SPDX-License-Identifier: Apache-2.0
"""The longest path through one function, by implicit path enumeration.

How often each edge is passed is an integer unknown. What flows into a block flows out of it (WC-1), the function is
entered and left once, and the header of a loop runs at most so many times for each time it is entered (WC-2). The
largest sum of costs is found by HiGHS. Source: docs/theory/worst-case-time.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.wcet.flow import Edge, Flow
from fluxtrue_tools.wcet.loops import Loop

ENTRY = -1
INFEASIBLE, OPTIMAL = 2, 0


@dataclass(frozen=True)
class Path:
    """The largest cost, and how often each block runs in it."""

    cost: int
    runs: dict[int, int]


@dataclass(frozen=True)
class Costs:
    """Of each block, of not going on to the next instruction in memory, and of entering a loop, by its header."""

    blocks: Mapping[int, int]
    taken: int = 0
    entered: Mapping[int, int] = field(default_factory=dict)


class _Rows:
    """The equations and inequalities, row by row."""

    def __init__(self) -> None:
        self.entries: list[tuple[int, int, float]] = []
        self.lower: list[float] = []
        self.upper: list[float] = []

    def add(self, terms: Iterable[tuple[int, float]], lower: float, upper: float) -> None:
        self.entries += [(len(self.lower), column, factor) for column, factor in terms]
        self.lower.append(lower)
        self.upper.append(upper)

    def constraint(self, columns: int) -> LinearConstraint:
        rows, places, factors = zip(*self.entries, strict=True)
        matrix = csr_array((factors, (rows, places)), shape=(len(self.lower), columns))
        return LinearConstraint(matrix, self.lower, self.upper)


class _Program:
    """The unknowns are the edges; the first enters the function."""

    def __init__(self, flow: Flow) -> None:
        self.edges: list[tuple[int, Edge]] = [(ENTRY, Edge(flow.entry, False))]
        self.edges += [(at, edge) for at, block in flow.blocks.items() for edge in block.edges]
        self.into: dict[int, list[int]] = {at: [] for at in flow.blocks}
        out: dict[int, list[int]] = {at: [] for at in flow.blocks}
        for k, (source, edge) in enumerate(self.edges):
            if edge.to is not None:
                self.into[edge.to].append(k)
            if source != ENTRY:
                out[source].append(k)
        self.rows = _Rows()
        self.rows.add([(0, 1.0)], 1, 1)
        for at in flow.blocks:
            self.rows.add([*((k, 1.0) for k in self.into[at]), *((k, -1.0) for k in out[at])], 0, 0)

    def entering(self, loop: Loop) -> list[int]:
        return [k for k in self.into[loop.header] if self.edges[k][0] not in loop.blocks]

    def bound(self, loop: Loop, header_runs: int) -> None:
        entering = self.entering(loop)
        back = [k for k in self.into[loop.header] if k not in entering]
        more = float(header_runs - 1)
        self.rows.add([*((k, 1.0) for k in back), *((k, -more) for k in entering)], -np.inf, 0)


def longest(
    flow: Flow, loops: Iterable[Loop], header_runs: Mapping[int, int], costs: Costs, excluded: Iterable[int] = ()
) -> Path | None:
    """The longest path, or None if none leaves the function.

    `header_runs`: by header, for each time the loop is entered. `excluded`: blocks that never run.
    """
    program = _Program(flow)
    cost = np.array([costs.blocks.get(edge.to or 0, 0) + (costs.taken if edge.taken else 0)
                     for _, edge in program.edges], dtype=float)  # fmt: skip
    for loop in loops:
        program.bound(loop, header_runs[loop.header])
        cost[program.entering(loop)] += costs.entered.get(loop.header, 0)
    never = set(excluded)
    upper = np.array([0.0 if edge.to in never else np.inf for _, edge in program.edges])
    done = milp(-cost, integrality=np.ones(len(cost)), bounds=Bounds(0, upper),
                constraints=program.rows.constraint(len(cost)))  # fmt: skip
    if done.status == INFEASIBLE:
        return None
    if done.status != OPTIMAL:
        raise FluxtrueError(f"{flow.name}: no longest path: {done.message}")
    runs = {at: round(sum(done.x[k] for k in program.into[at])) for at in flow.blocks}
    return Path(round(-done.fun), {at: number for at, number in runs.items() if number > 0})
