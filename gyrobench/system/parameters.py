"""Value of each parameter of each part in a run, and its way into the FMU."""

from __future__ import annotations

import contextlib
import difflib
import functools
import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench import units
from gyrobench.component.declarations import Scalar
from gyrobench.errors import GyrobenchError
from gyrobench.reading import shorten
from gyrobench.system.bare_numbers import question, usual_size
from gyrobench.system.binding import Binding, Bound
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError, flatten, nest, parse
from gyrobench.system.wiring import Assembly, follow_factors

Starts = dict[str, list[tuple[Bound, Any]]]  # by slot, in the FMU's own units
_KINDS: dict[str, type] = {"Real": float, "Integer": int, "Boolean": bool, "String": str}


def slot_seed(seed: int, slot: str) -> int:
    """A seed of its own for the noise of each slot: 31 bits of a hash of the run's seed and the slot's name."""
    digest = hashlib.blake2s(f"{seed}:{slot}".encode(), digest_size=4).digest()
    return int.from_bytes(digest, "big") & 0x7FFFFFFF


def defaults(assembly: Assembly) -> dict[str, Any]:
    """Return the start values of all parameters as the FMUs (or their mapping files) declare them.

    {"slot.name": SI value}, element by element.
    """
    found: dict[str, Any] = {}
    for slot, binding in assembly.bindings.items():
        for name, bound in binding.parameters.items():
            text = binding.variables[bound.variable].start
            if text is None:
                continue
            if bound.kind == "Real":
                found[f"{slot}.{name}"] = bound.si(float(text))
            elif bound.kind == "Integer":
                found[f"{slot}.{name}"] = int(text)
            elif bound.kind == "Boolean":
                found[f"{slot}.{name}"] = text in ("true", "1")
            else:
                found[f"{slot}.{name}"] = text
        found.update({f"{slot}.{name}": value for name, value in binding.constants.items()})
    return found


def _si(name: str, value: Any, bound: Bound) -> Any:
    """A given value as SI number of the parameter's type."""
    if type(value) is float and bound.kind == "Real" and math.isfinite(value):
        return value  # the thousands of numbers of a plan
    return parse(name, value, _si_unit(bound.unit), _KINDS[bound.kind])


@functools.cache
def _si_unit(name: str) -> str:
    """Return the SI unit of a unit's dimension: the unit itself where it is one, "1" where it is not known."""
    try:
        unit = units.unit(name or "1")
    except units.UnitError:
        return "1"
    return name if name and unit.factor == 1.0 and not unit.offset else unit.dimension


def _target(name: str, binding: Binding) -> Bound | None:
    return binding.parameters.get(name) or binding.inputs.get(name)


def _usual(slot: str, name: str, bound: Bound, binding: Binding, base: Mapping[str, Any]) -> float:
    """Return the usual size of a parameter: its default, else the largest default of the part in that unit."""
    own = [base.get(f"{slot}.{n}") for n in binding.parameters if n.partition("[")[0] == name.partition("[")[0]]
    like = [base.get(f"{slot}.{n}") for n, b in binding.parameters.items() if b.unit == bound.unit]
    return usual_size(own, like)


def _overrides(given: Mapping[str, Any], assembly: Assembly, base: Mapping[str, Any]) -> dict[str, Any]:
    """Elements and SI values of all "slot.parameter" that were given.  Raises InvalidValueError."""
    found: dict[str, Any] = {}
    for name, value in given.items():
        found |= _override(name, value, assembly.bindings[name.partition(".")[0]], base)
    return found


def followed(assembly: Assembly, system: System) -> set[str]:
    """Return the "slot.parameter" that the design of a system, or the factor of a wire, takes from the parts.

    As far as it comes: a design that refuses its values has not asked for all of them.
    """
    base = defaults(assembly)
    parts = PartValues(system, base)
    with contextlib.suppress(GyrobenchError, ArithmeticError):
        follow_factors(assembly, system, parts)
        system.flat_parameters(parts)
    return parts.read


def _override(name: str, value: Any, binding: Binding, base: Mapping[str, Any]) -> dict[str, Any]:
    """Elements and SI values of one "slot.parameter" as given by the user.  Raises InvalidValueError."""
    slot, found = name.partition(".")[0], {}
    for element, v in _elements(name, value).items():
        bound = _target(element, binding)
        if bound is None:
            raise _no_parameter(name, element, list(binding.parameters))
        given = found[f"{slot}.{element}"] = _si(f"{slot}.{element}", v, bound)
        if bound.kind == "Real" and bound.unit:
            usual = _usual(slot, element, bound, binding, base)
            question(f"{slot}.{element}", value, given, _si_unit(bound.unit), usual)
    return found


def _elements(name: str, value: Any) -> dict[str, Any]:
    """Return the elements of a value as it is given for "slot.parameter"; a list may be text."""
    given = parse(name, value) if isinstance(value, str) and value.strip().startswith("[") else value
    return flatten(name.partition(".")[2], given)


def _no_parameter(name: str, element: str, names: list[str]) -> InvalidValueError:
    slot, _, parameter = name.partition(".")
    if any(n.startswith(parameter + "[") for n in names) and element == parameter:
        return InvalidValueError(f"{name}: is an array; give all of it as [a, b, ...] or one element {parameter}[1]")
    near = difflib.get_close_matches(element, names, n=4, cutoff=0.3) or names[:12]
    return InvalidValueError(f"{name}: {slot} has no parameter '{element}'; nearest: {', '.join(near)}")


def refuse_value(name: str, value: Any, layout: Sequence[Scalar]) -> None:
    """Raise InvalidValueError for a "slot.parameter" that a part of this layout lacks, or a value out of its bounds."""
    known = {s.name: s.decl for s in layout if s.section in ("parameter", "input")}
    for element, v in _elements(name, value).items():
        if (decl := known.get(element)) is None:
            raise _no_parameter(name, element, [s.name for s in layout if s.section == "parameter"])
        given = parse(f"{name.partition('.')[0]}.{element}", v, _si_unit(decl.unit), decl.type)
        if bound := decl.bound_broken(given):
            unit = "" if decl.unit == "1" else f" {decl.unit}"
            raise InvalidValueError(f"{name} = {shorten(str(value))}: {element} must be {bound}{unit}")


def resolve(
    assembly: Assembly, system: System, seed: int, base: Mapping[str, Any]
) -> tuple[Starts, dict[str, Any], list[str]]:
    """Return what is set in each FMU, all parameters for run.json (SI, arrays nested), and notes.

    In rising order of rank: the FMU's start value, the seed of the slot, what the system derives, what the user set.
    Factors of wires that follow the parts are set in the assembly.
    base: :func:`defaults` of the assembly.  Raises InvalidValueError.
    """
    chosen: dict[str, Any] = {}
    notes = []
    for slot, binding in assembly.bindings.items():
        if "seed" in binding.parameters:
            chosen[f"{slot}.seed"] = slot_seed(seed, slot)
    variables = {
        slot: {b.variable: (e, b) for e, b in (*binding.inputs.items(), *binding.parameters.items())}
        for slot, binding in (assembly.bindings.items() if system.raw else ())
    }
    raw: dict[str, Any] = {}
    for name, value in system.raw.items():
        slot, _, variable = name.partition(".")
        if variable in variables[slot]:
            element, known = variables[slot][variable]
            raw[f"{slot}.{element}"] = known.si(value)
        else:
            notes.append(f"{name}: no parameter or input of that name; not set")
    chosen.update(raw)
    overrides = _overrides(system.overrides, assembly, base)
    nominal = overrides if system.nominal is None else _overrides(system.nominal, assembly, base)
    if unseen := [n for n, v in overrides.items() if system.nominal is not None and nominal.get(n, base.get(n)) != v]:
        notes.append(f"the design is held at nominal values: it does not follow {', '.join(unseen)}")
    parts = PartValues(system, base, {**raw, **nominal})
    follow_factors(assembly, system, parts)
    kept: dict[str, list[str]] = {}
    for name, value in system.flat_parameters(parts).items():
        where_known = name.endswith("?")
        name = name.rstrip("?")
        slot, _, parameter = name.partition(".")
        if slot not in assembly.bindings:
            raise InvalidValueError(f"{name}: {system.name} has no slot '{slot}'")
        bound = _target(parameter, assembly.bindings[slot])
        if slot in assembly.keeps and parameter in assembly.bindings[slot].parameters:
            kept.setdefault(slot, []).append(parameter)
        elif bound is not None:
            chosen[name] = _si(name, value, bound)
        elif not where_known:
            text = f"{slot} has no parameter '{parameter.partition('[')[0]}' (set by {system.name}); it stays as it is"
            notes += [] if text in notes else [text]
    notes += [f"{slot}: {', '.join(names)}: the values of its file, not those of the system's design"
              for slot, names in kept.items()]  # fmt: skip
    notes += parts.notes
    chosen.update(overrides)
    starts: Starts = {slot: [] for slot in assembly.bindings}
    for name, value in chosen.items():
        slot, _, parameter = name.partition(".")
        bound = _target(parameter, assembly.bindings[slot])
        assert bound is not None
        starts[slot].append((bound, bound.own(value)))
    for slot, binding in assembly.bindings.items():
        starts[slot] += [(bound, bound.own(value)) for held in binding.held.values() for bound, value in held]
    return starts, nest({**base, **chosen}), notes
