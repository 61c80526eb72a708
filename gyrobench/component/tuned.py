"""Parameters of a part that are set between steps, and the bounds of its values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gyrobench.component.composition import TIMES, ComponentError
from gyrobench.component.declarations import Scalar

if TYPE_CHECKING:
    from gyrobench.component.component import Component


def check_bounds(part: Component, *sections: str) -> None:
    """Raise ComponentError where a value of these sections breaks its bound."""
    for s in part.layout:
        if s.section in sections:
            x = part._at(s)
            bound = s.decl.bound_broken(x)
            if bound:
                raise ComponentError(f"{part.instance}: {s.section} {s.name} = {x:g} {s.decl.unit} must be {bound}")


def tune(part: Component, given: Sequence[tuple[Scalar, float]]) -> None:
    """Make anew what follows from parameters that are about to be set between steps.

    A part of the same class is started with them, and gives what the start makes of parameters alone.  Raises
    ComponentError, with nothing changed, where one is fixed or the part refuses.
    """
    tuned = [(s, x) for s, x in given if s.section == "parameter"]
    for s, _ in tuned:
        if s.reference not in part._tunable:
            raise ComponentError(
                f"{part.instance}: parameter {s.name} is fixed once initialization has ended: reset first"
            )
    if all(part._at(s) == x for s, x in tuned):
        return
    trial = type(part)(part.instance)
    for s in part.layout:
        if s.section in ("parameter", "input"):
            trial._put(s, part._at(s))
    for s, x in given:
        trial._put(s, x)
    for n in TIMES:
        setattr(trial, n, getattr(part, n))
    check_bounds(trial, "parameter")
    trial.start()
    for s in map(part.layout.__getitem__, part._derived):
        part._put(s, trial._at(s))
    part._phi_h = 0.0
