"""Simulated set-up errors: parameters that a user sets past the option that owns them, or past the method."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gyrobench import units
from gyrobench.record.run_document import SetupError
from gyrobench.system.parameters import resolve
from gyrobench.system.system import System
from gyrobench.system.values import flatten
from gyrobench.system.wiring import Assembly


def setup_errors(
    assembly: Assembly, system: System, seed: int, base: Mapping[str, Any], parameters: Mapping[str, Any]
) -> list[SetupError]:
    """Return where the parts of a run (``parameters``) are not what its plan and its reduction assume.

    Assumed is the value that the option in whose ``sets`` a parameter stands gives it, and for those in
    ``system.assumed`` what system or part give it.
    """
    owners = {name: key for key, option in system.options.items() for name in option.sets.split()}
    owners |= {name.rstrip("?"): "" for name in system.assumed if name not in owners}
    bases = {_base(name) for name in owners}
    past = [name for name in system.overrides if _base(name) in bases]
    if not past:
        return []
    told = system.with_values({})
    for name in past:
        del told.overrides[name]
    apart = replace(assembly, connections=list(assembly.connections))  # factors of wires stay those of the run
    assumed = resolve(apart, told, seed, base)[1]
    errors = []
    for name, option in owners.items():
        if _base(name) not in parameters:
            continue
        value, wanted = (_element(p[_base(name)], name) for p in (parameters, assumed))
        if not _equal(value, wanted):
            unit = _unit(assembly, name)
            errors.append(SetupError(parameter=name, value=value, assumed=wanted, unit=unit, option=option))
    return errors


def _base(name: str) -> str:
    return name.partition("[")[0]


def _element(value: Any, name: str) -> Any:
    """Return the value of "slot.parameter", or its element where the name has an index."""
    return flatten(_base(name), value)[name] if "[" in name else value


def _equal(a: Any, b: Any) -> bool:
    x, y = flatten("", a), flatten("", b)
    return x.keys() == y.keys() and all(
        math.isclose(x[k], y[k], rel_tol=1e-12) if isinstance(x[k], float) else x[k] == y[k] for k in x
    )


def _unit(assembly: Assembly, name: str) -> str:
    """Return the SI unit of a parameter."""
    slot, _, parameter = name.partition(".")
    known = assembly.bindings[slot].parameters
    bound = known.get(parameter) or next(b for n, b in known.items() if _base(n) == parameter)
    try:
        return units.unit(bound.unit or "1").dimension
    except units.UnitError:
        return bound.unit
