"""For the tests of loops: systems with other plans or flights; gimballed platforms without noise and drift."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.engine.session import Session
from gyrobench.result import Result, Table
from gyrobench.system.flight_plan import Leg
from gyrobench.system.system import load_system

DEG = math.pi / 180.0
TERMS = ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")
STILL = {f"gyro_{g}.{n}_{c}": 0.0 for g in "ab" for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"} | {
    f"gyro_{g}.D{c}_{k}": 0.0 for g in "ab" for c in "xy" for k in TERMS
}


def session(name: str, legs: list[Leg] | None = None, parts: dict[str, str] | None = None, **methods: Any) -> Session:
    """The system with these legs where there are some, and with other methods."""
    system = load_system(name)
    if legs is not None:
        methods["legs"] = lambda self: legs
    base = type(system)
    other = type(base.__name__, (base,), {**methods, "__module__": base.__module__})()
    other.name, other.folder = system.name, system.folder
    return Session(other, parts or {})


def only(name: str, *labels: str, parts: dict[str, str] | None = None) -> Session:
    """The loop test with the phases alone whose labels start so."""
    base: Any = type(load_system(name))
    return session(name, parts=parts, phases=lambda self: [p for p in base.phases(self) if p.label.startswith(labels)])


def measures(result: Result) -> dict[str, float]:
    return {c.name: c.estimate for c in result.coefficients}


def table(result: Result, kind: str) -> Table:
    return next(t for t in result.tables if t.kind == kind)
