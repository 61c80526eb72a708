"""Tests of a suite, and a plan of each, that reach wanted uncertainties soonest.

Each test that offers plans is designed for all that is wanted of it; of the sets of tests in which every wanted value
is reached by one test, the set that takes least time is chosen, the shortest test first.  Not used: that two tests that
determine a value are together better than either, and that a test may be shorter if another has part of its values.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from itertools import combinations
from pathlib import Path

from gyrobench.bench import UsageError
from gyrobench.design.designed_test import DesignedSuite, DesignedTest
from gyrobench.design.plan_runs import DesignError
from gyrobench.design.shortest_test import design_test
from gyrobench.errors import GyrobenchError
from gyrobench.system.suite import Suite


def design_suite(
    suite: Suite, wants: Mapping[str, str | float], *, criterion: str = "minimax",
    parts: Mapping[str, str] | None = None, maps: Mapping[str, Path] | None = None, seed: int = 1, count: int = 0,
) -> DesignedSuite:  # fmt: skip
    """Return the tests of a suite that reach ``wants`` soonest.  Raises DesignError, UsageError, InvalidValueError."""
    if not wants:
        raise UsageError(f"{suite.name}: state what is wanted, --want D_I=0.001deg/h/g; a suite has no plan of its own")
    members = suite.members()
    given = suite.given_to(members)
    swaps, mapped = suite.swaps(members, parts or {}), suite.swaps(members, maps or {})
    found: dict[str, DesignedTest] = {}
    left_out: dict[str, str] = {}
    for name, system in members.items():
        if not system.protocol:
            left_out[name] = "offers no plans"
            continue
        try:
            found[name] = design_test(
                system, wants, criterion=criterion, parts=swaps[name], maps=mapped[name], seed=seed, count=count,
                given={k: str(v) for k, v in given[name].items()}, only_known=True,
            )  # fmt: skip
        except GyrobenchError as error:
            left_out[name] = error.text
    reached = {n: {v.name for v in t.values.values() if v.wanted is not None} for n, t in found.items()}
    chosen = cheapest_cover({n: t.time for n, t in found.items()}, reached, frozenset(wants))
    if chosen is None:
        lost = sorted(set(wants) - set().union(*reached.values()))
        reasons = "; ".join(f"{n}: {why}" for n, why in left_out.items())
        raise DesignError(f"{', '.join(lost)}: no test of {suite.name} reaches it ({reasons})")
    order = sorted(chosen, key=lambda n: found[n].time)
    others = tuple(t for n, t in found.items() if n not in chosen)
    return DesignedSuite(suite.name, tuple(found[n] for n in order), others, left_out)


def cheapest_cover(
    times: Mapping[str, float], reached: Mapping[str, Collection[str]], wanted: Collection[str]
) -> tuple[str, ...] | None:
    """Return the tests of least total time that reach all that is wanted between them; None where they do not."""
    best: tuple[str, ...] | None = None
    least = math.inf
    for size in range(1, len(times) + 1):
        for names in combinations(times, size):
            total = sum(times[n] for n in names)
            if total < least and set(wanted) <= set().union(*(reached[n] for n in names)):
                best, least = names, total
    return best
