"""Execution order: hand cases and a fuzz test against brute force."""

from __future__ import annotations

import itertools
import random

import pytest

from gyrobench.system.execution_order import AlgebraicLoopError, Link, execution_order


def link(text: str) -> Link:
    a, b = (tuple(s.strip().split(".")) for s in text.split("->"))
    return Link(a, b, text)  # type: ignore[arg-type]


def test_sources_first_and_loop_cut_without_feedthrough() -> None:
    # the gyro's u does not depend on i at once, the rebalance passes u on: the loop is cut at rebalance.i -> gyro.i
    links = [link("rebalance.i -> gyro.i"), link("gyro.u -> rebalance.u"), link("site.f -> gyro.f")]
    through = {"rebalance": {"i": {"u"}}, "gyro": {"u": set()}, "site": {"f": set()}}
    order = execution_order(["rebalance", "gyro", "site"], links, through)
    assert order.order == ("site", "gyro", "rebalance")
    assert [c.wire for c in order.cuts] == ["rebalance.i -> gyro.i"]
    assert order.as_dict(1e-3)["delays"] == {"rebalance.i -> gyro.i": 1e-3}


def test_declared_order_breaks_ties() -> None:
    through = {p: {"y": set()} for p in "abc"}
    assert execution_order(list("bca"), [], through).order == ("b", "c", "a")
    links = [link("a.y -> b.x"), link("b.y -> a.x")]  # both cuttable at the same price
    assert execution_order(["b", "a"], links, {"a": {"y": set()}, "b": {"y": set()}}).order == ("b", "a")


def test_algebraic_loop_is_named() -> None:
    links = [link("a.y -> b.x"), link("b.y -> c.x"), link("c.y -> a.x")]
    through = {p: {"y": {"x"}} for p in "abc"}
    with pytest.raises(AlgebraicLoopError) as caught:
        execution_order(list("abc"), links, through)
    assert "a.y -> b.x -> b.y -> c.x -> c.y -> a.x -> a.y" in str(caught.value)


def test_part_loop_without_algebraic_loop_runs() -> None:
    # a.p -> b.p -> b.q -> a.q -> a.r: one doStep for each part, so one wire must carry the last value
    links = [link("a.p -> b.p"), link("b.q -> a.q")]
    through = {"a": {"p": set(), "r": {"q"}}, "b": {"q": {"p"}}}
    order = execution_order(["a", "b"], links, through)
    assert len(order.cuts) == 1
    assert "not round the loop" in str(order.cuts[0])


def brute(parts: list[str], links: list[Link], through: dict[str, dict[str, set[str]]]) -> tuple[int, int]:
    best = (99, 99)
    for order in itertools.permutations(parts):
        cut = {x.wire: x for x in links if order.index(x.source[0]) >= order.index(x.target[0])}
        hard = sum(any(x.target[1] in s for s in through[x.target[0]].values()) for x in cut.values())
        best = min(best, (hard, len(cut)))
    return best


def has_algebraic_loop(links: list[Link], through: dict[str, dict[str, set[str]]]) -> bool:
    edges = {(x.source, x.target) for x in links}
    edges |= {((p, x), (p, y)) for p, ys in through.items() for y, xs in ys.items() for x in xs}
    nodes = {n for e in edges for n in e}
    while True:  # peel off nodes without predecessor; a rest means a cycle
        free = {n for n in nodes if not any(b == n and a in nodes for a, b in edges)}
        if not free:
            return bool(nodes)
        nodes -= free


@pytest.mark.parametrize("seed", range(400))
def test_against_brute_force(seed: int) -> None:
    rng = random.Random(seed)
    parts = [f"p{i}" for i in range(rng.randint(2, 6))]
    through = {p: {y: {x for x in ("a", "b") if rng.random() < 0.35} for y in ("y", "z")} for p in parts}
    links, taken = [], set()
    for _ in range(rng.randint(1, 10)):
        target = (rng.choice(parts), rng.choice("ab"))
        if target not in taken:
            taken.add(target)
            source = (rng.choice(parts), rng.choice("yz"))
            links.append(Link(source, target, f"{source} -> {target}"))
    if has_algebraic_loop(links, through):
        with pytest.raises(AlgebraicLoopError):
            execution_order(parts, links, through)
        return
    order = execution_order(parts, links, through)
    assert sorted(order.order) == sorted(parts)
    place = {p: i for i, p in enumerate(order.order)}
    wires = [x.wire for x in links if place[x.source[0]] >= place[x.target[0]]]
    assert [c.wire for c in order.cuts] == wires
    hard = sum("not round" in c.why for c in order.cuts)
    assert (hard, len(wires)) == brute(parts, links, through)
    assert execution_order(parts, links, through) == order
