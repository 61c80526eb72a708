"""Derivatives of the equations of a part along directions, by forward-mode differentiation (dual numbers)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

from gyrobench.component.composition import Derivatives, stored
from gyrobench.component.declarations import State
from gyrobench.component.math import Dual, lift
from gyrobench.component.numerics import OnUse
from gyrobench.component.vectors import Vector, copied

if TYPE_CHECKING:
    from gyrobench.component.component import Component

Tangent: TypeAlias = tuple[list[float], list[float]]  # derivatives of the state derivatives, of the outputs


def tangents(part: Component, directions: Iterable[dict[str, float]], outputs: bool) -> list[Tangent]:
    """Return the tangent of a part at its present point along each direction ``{FMI name: weight}``.

    outputs: False leaves those out.
    """
    twin, found = twin_of(part, dual), []
    shown = [s for s in part.layout if s.section == "output"] if outputs else []
    for seeds in directions:  # one twin for all: ``flow`` and ``outputs`` write ``der`` and outputs only
        seeded = [dig(getattr(twin, s.path[0]), s.path[1:]) for s in map(part._find, seeds)]
        for x, weight in zip(seeded, seeds.values(), strict=True):
            x.d = weight
        twin._equations("flow")
        if outputs:
            twin._equations("outputs")
        der = [lift(dig(getattr(twin.der, s.path[0]), s.path[1:])).d for s in part.states]
        found.append((der, [lift(dig(getattr(twin, s.path[0]), s.path[1:])).d for s in shown]))
        for x in seeded:
            x.d = 0.0
        for name in {s.decl.name for s in shown}:
            setattr(twin, name, dual(getattr(part, name)))
    return found


def twin_of(part: Component, of: Callable[[Any], Any] = copied) -> Component:
    """Return a copy of a part at its present point; its values, numbers and arrays, are what ``of`` makes of them."""
    twin = object.__new__(type(part))
    twin.__dict__.update(part.__dict__)
    twin.der = Derivatives()
    values = twin.__dict__
    for name, d in part.declarations.items():
        key = stored(name) if d.shape else name
        values[key] = of(values[key])
        if isinstance(d, State):
            setattr(twin.der, name, of(getattr(part.der, name)))
    twin.noise = SimpleNamespace(
        **{k: replace(v, part=twin) if isinstance(v, OnUse) else of(v) for k, v in vars(part.noise).items()}
    )
    return twin


def dig(x: Any, path: tuple[Any, ...]) -> Any:
    """Return the element of an array at a path of indices."""
    for i in path:
        x = x[i]
    return x


def dual(x: Any) -> Any:
    """Return a number, or an array, as dual numbers with derivatives 0."""
    return Vector([dual(e) for e in x]) if isinstance(x, list) else Dual(float(x))
