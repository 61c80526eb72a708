"""Execution order of a system from the declared output dependencies.

One macro step runs the parts one after another (Gauss-Seidel): a part gets the newest outputs of the
parts before it and, over a cut connection, the outputs of the last step.  The order cuts as little as
possible: first as few connections as possible into inputs with direct feedthrough, then as few
connections as possible at all, then the declared order of the parts.  So sources come first, and a loop
is cut where a part does not pass the input on within the step.  A loop of direct feedthrough all round
(an algebraic loop) has no such place and is refused by name.

The search is exact for loops of up to 12 parts and greedy (least new cuts next) beyond.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gyrobench.errors import GyrobenchError

EXACT = 12

Port = tuple[str, str]  # (part, variable)


class AlgebraicLoopError(GyrobenchError):
    """A loop in which every part passes its input on at once; ``loop`` lists its ports, ``remedy`` what opens it."""

    def __init__(self, loop: list[Port], remedy: str = "") -> None:
        self.loop = loop
        names = " -> ".join(f"{p}.{v}" for p, v in [*loop, loop[0]])
        super().__init__(
            f"algebraic loop: {names}. Every part of it has direct feedthrough, so no execution order exists; use a "
            "part whose output does not depend on that input at once, or declare the dependencies of its outputs "
            "(ModelStructure) if it does not" + (f"\n  {remedy}" if remedy else "")
        )


@dataclass(frozen=True)
class Link:
    """One scalar connection; ``wire`` is the line of the system that it belongs to."""

    source: Port
    target: Port
    wire: str


@dataclass(frozen=True)
class Cut:
    """A connection that carries the value of the last step."""

    wire: str  # "rebalance.i -> gyro.i"
    why: str
    steps: int = 1

    def __str__(self) -> str:
        return f"{self.wire}: one step delay ({self.why})"


@dataclass(frozen=True)
class ExecutionOrder:
    """The order and its cuts; what ``show`` prints, what both engines use and what the report states."""

    order: tuple[str, ...]
    cuts: tuple[Cut, ...]

    def as_dict(self, step: float) -> dict[str, Any]:
        """JSON-able: order, cuts (sentences) and delays (seconds by wire)."""
        return {
            "order": list(self.order),
            "cuts": [str(c) for c in self.cuts],
            "delays": {c.wire: c.steps * step for c in self.cuts},
        }


def _algebraic_loop(links: Sequence[Link], through: Mapping[str, Mapping[str, set[str]]]) -> list[Port] | None:
    """The shortest loop of connections and direct feedthrough, or None."""
    after: dict[Port, list[Port]] = {}
    for link in links:
        after.setdefault(link.source, []).append(link.target)
    used = set(after)
    for target in dict.fromkeys(link.target for link in links):
        part, name = target
        after[target] = [(part, y) for y, xs in through[part].items() if name in xs and (part, y) in used]
    best: list[Port] | None = None
    for start in dict.fromkeys(link.source for link in links):
        came: dict[Port, Port] = {}
        queue = deque([start])
        while queue and start not in came:
            here = queue.popleft()
            for there in after.get(here, []):
                if there not in came:
                    came[there] = here
                    queue.append(there)
        if start in came:
            loop, here = [start], came[start]
            while here != start:
                loop.append(here)
                here = came[here]
            loop = [start, *reversed(loop[1:])]
            if best is None or len(loop) < len(best):
                best = loop
    return best


def _components(n: int, after: Sequence[set[int]]) -> list[list[int]]:
    """Strongly connected components in execution order, declared order among the ready ones."""
    reach = [{i} for i in range(n)]
    for i in range(n):
        stack = [i]
        while stack:
            for k in after[stack.pop()]:
                if k not in reach[i]:
                    reach[i].add(k)
                    stack.append(k)
    groups: list[list[int]] = []
    for i in range(n):
        if not any(i in g for g in groups):
            groups.append([k for k in range(n) if k in reach[i] and i in reach[k]])
    placed: list[list[int]] = []
    while groups:
        ready = next(g for g in groups if not any(o is not g and g[0] in reach[o[0]] for o in groups))
        placed.append(ready)
        groups.remove(ready)
    return placed


Cost = tuple[int, int]  # (cuts into feedthrough inputs, cuts)


def _arrange(nodes: list[int], cost: Mapping[tuple[int, int], Cost]) -> list[int]:
    """The order of the parts of one loop with the least cost; cost[(i, k)] is that of cutting i -> k."""

    def price(k: int, missing: Iterable[int]) -> Cost:
        found = [cost[(i, k)] for i in missing if i != k and (i, k) in cost]
        return sum(c[0] for c in found), sum(c[1] for c in found)

    if len(nodes) > EXACT:
        rest, result = list(nodes), []
        while rest:
            k = min(rest, key=lambda v: (price(v, rest), v))
            result.append(k)
            rest.remove(k)
        return result
    best: dict[frozenset[int], tuple[Cost, list[int]]] = {frozenset(): ((0, 0), [])}
    for _ in nodes:
        longer: dict[frozenset[int], tuple[Cost, list[int]]] = {}
        for placed, (spent, order) in best.items():
            rest = [v for v in nodes if v not in placed]
            for k in rest:
                p = price(k, rest)
                offer = ((spent[0] + p[0], spent[1] + p[1]), [*order, k])
                key = placed | {k}
                if key not in longer or offer < longer[key]:
                    longer[key] = offer
        best = longer
    return best[frozenset(nodes)][1]


def execution_order(
    parts: Sequence[str], links: Sequence[Link], through: Mapping[str, Mapping[str, set[str]]]
) -> ExecutionOrder:
    """Order and cuts of the parts (in declared order) under the given connections.

    through: for each part, output -> inputs with direct feedthrough (gyrobench.system.fmu_variables.feedthrough).
    Raises :class:`AlgebraicLoopError`.
    """
    loop = _algebraic_loop(links, through)
    if loop is not None:
        raise AlgebraicLoopError(loop)
    index = {p: i for i, p in enumerate(parts)}
    direct = {p: {x for xs in through[p].values() for x in xs} for p in parts}
    after: list[set[int]] = [set() for _ in parts]
    wires: dict[tuple[int, int], dict[str, bool]] = {}
    for link in links:
        i, k = index[link.source[0]], index[link.target[0]]
        after[i].add(k)
        hard = link.target[1] in direct[link.target[0]]
        group = wires.setdefault((i, k), {})
        group[link.wire] = group.get(link.wire, False) or hard
    cost = {pair: (sum(g.values()), len(g)) for pair, g in wires.items()}
    order: list[int] = []
    for nodes in _components(len(parts), after):
        order += _arrange(nodes, cost)
    place = {v: i for i, v in enumerate(order)}
    cuts: list[Cut] = []
    for link in links:
        i, k = index[link.source[0]], index[link.target[0]]
        if place[i] >= place[k] and all(c.wire != link.wire for c in cuts):
            if wires[(i, k)][link.wire]:
                why = f"{link.target[0]} passes it on, but not round the loop"
            else:
                why = f"no output of {link.target[0]} depends on it at once"
            cuts.append(Cut(link.wire, why))
    return ExecutionOrder(tuple(parts[i] for i in order), tuple(cuts))
