"""The same quantity in several results: the combinations of coefficients that each test determines, and their values.

A test reports b = A theta with the combinations A of :attr:`Coefficient.combination`; another quantity a' theta can be
had from it when a lies in the row space of A: a = A' c, value c' b, u^2 = c' V c.  Where |f| is the same in all
attitudes D_OO is folded into the others (see gyrobench.reduction.estimation.linear_fit), so that tests at one site
compare as they are.

Not modelled: correlation of type A between tests.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench import drift, units
from gyrobench.arrays import Array
from gyrobench.reduction.suite.consistency import MethodValue
from gyrobench.result import Coefficient, DriftTestResult

MODEL = {n for names in (drift.NAMES, *drift.NAMES_2DOF.values()) for n in names}
SAME = 2e-5  # combinations closer than this are one: four seconds of arc in an attitude
CLOSE = 1e-9  # a quantity is seen when it is put together to this fraction


@dataclass(frozen=True)
class Measurand:
    """A quantity: printed name, unit and meaning, and the combination of coefficients that it is."""

    name: str
    unit: str
    meaning: str
    combination: Mapping[str, float]


def combination(c: Coefficient) -> dict[str, float]:
    """Return the combination of an estimate; one outside the drift models is its own symbol, with its unit."""
    given = c.combination or {c.name: 1.0}
    return {n if n in MODEL else f"{n} / {c.unit}": float(x) for n, x in given.items() if x != 0.0}


def _vector(made_of: Mapping[str, float], basis: Sequence[str]) -> Array:
    return np.array([made_of.get(n, 0.0) for n in basis])


def _same(a: Mapping[str, float], b: Mapping[str, float]) -> bool:
    """Return whether two combinations differ by a factor at most, to :data:`SAME`."""
    basis = sorted({*a, *b})
    x, y = _vector(a, basis), _vector(b, basis)
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return bool(min(np.max(np.abs(x - y)), np.max(np.abs(x + y))) < SAME)


def _shown(c: Coefficient) -> Measurand:
    """Return an estimate under the model's name where it is one coefficient: u_zx = -gamma Dy_y is compared as Dy_y."""
    made_of = combination(c)
    name = next(iter(made_of))
    if len(made_of) == 1 and name in MODEL:
        return Measurand(name, units.display(drift.surface_unit(name)), drift.meaning(name), {name: 1.0})
    return Measurand(c.name, c.unit, c.meaning, made_of)


def quantities(results: Mapping[str, DriftTestResult]) -> list[Measurand]:
    """Return all that the tests report, each once: in the order of the model's coefficients, then what mixes them."""
    reported: list[tuple[Measurand, str]] = []
    for label, result in results.items():
        for c in result.coefficients:
            new = _shown(c)
            if not any(_same(new.combination, q.combination) for q, _ in reported):
                reported.append((new, label))
    names = [q.name for q, _ in reported]
    named = [  # ω_d in one attitude, and in another
        q if names.count(q.name) == 1 else replace(q, name=f"{q.name}, {label}") for q, label in reported
    ]
    place = {n: k for k, n in enumerate((*drift.NAMES, *drift.NAMES_2DOF["x"], *drift.NAMES_2DOF["y"]))}

    def rank(q: Measurand) -> tuple[int, int]:
        plain = len(q.combination) == 1
        first = place.get(next(iter(q.combination)), len(place))
        return (0 if plain and first < len(place) else 1 if not plain else 2, first)

    return sorted(named, key=rank)


def weights(quantity: Measurand, result: DriftTestResult) -> Array | None:
    """Return c (q,) of quantity = c' estimates; None where the test does not determine it."""
    made_of = [combination(c) for c in result.coefficients]
    for j, own in enumerate(made_of):
        if _same(own, quantity.combination):  # as it was reported, whatever else could be put together
            name = max(own, key=lambda n: abs(own[n]))
            out = np.zeros(len(made_of))
            out[j] = quantity.combination[name] / own[name]
            return out
    basis = sorted({n for m in (*made_of, quantity.combination) for n in m})
    A = np.array([_vector(m, basis) for m in made_of])
    a = _vector(quantity.combination, basis)
    c, *_ = np.linalg.lstsq(A.T, a, rcond=None)
    if np.max(np.abs(A.T @ c - a)) > CLOSE * np.max(np.abs(a)):
        return None
    return np.asarray(np.where(np.abs(c) < CLOSE * np.max(np.abs(c)), 0.0, c), dtype=float)


def value(label: str, quantity: Measurand, result: DriftTestResult, shared: Collection[str]) -> MethodValue | None:
    """Return the quantity by a test, None where it does not determine it.  shared: sources of type B of all tests."""
    c = weights(quantity, result)
    if c is None:
        return None
    coefficients = result.coefficients
    used = np.flatnonzero(c)
    u_a = np.array([e.u if e.u_a is None else e.u_a for e in coefficients])
    known = len(result.correlation) == len(coefficients)
    rho = np.array(result.correlation, dtype=float) if known else np.eye(len(coefficients))
    v = c * u_a
    square, u_b, common = float(v @ rho @ v), 0.0, dict[str, Array]()
    for b in result.type_b:
        change = np.array(b.changes, dtype=float) @ c
        if b.id in shared:
            common[b.id] = np.append(common.get(b.id, np.zeros(0)), change)
        else:
            u_b = math.hypot(u_b, float(np.linalg.norm(change)))
    truths = [float(c[j]) * t for j in used if (t := coefficients[j].truth) is not None]
    truth = sum(truths) if len(truths) == used.size else None
    dof = min((coefficients[j].dof or math.inf for j in used), default=math.inf)
    name = coefficients[used[0]].name if used.size == 1 else ""
    estimate = float(c @ np.array([e.estimate for e in coefficients]))
    return MethodValue(label, estimate, math.sqrt(max(square, 0.0)), u_b, dof, common, truth, name)


def ideal(result: DriftTestResult) -> bool:
    """Return whether noise was off: residuals are rounding and u means nothing."""
    return all(c.truth is not None and c.z is None for c in result.coefficients) and bool(result.coefficients)
