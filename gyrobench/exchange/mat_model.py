"""The state space of a part, or of a system with its loops, as a MATLAB file (version 5): for Simulink and for control.

    m = load('stabilizer.mat');  c = m.closed.continuous;
    sys = ss(c.A, c.B, c.C, c.D, c.Ts, 'InputName', c.inputs, 'OutputName', c.outputs, 'StateName', c.states);

A file holds ``name``, ``about``, the point that the model is made at (``operating_point``: names, values, units), and
the models, each with A, B, C, D, Ts (s, 0 for a continuous one), inputs, outputs, states, and their units.

Of a system: ``closed.continuous``, ``closed.discrete`` from the excitations to the channels, and ``loops.NAME`` of each
loop that it names, opened at ``loops.NAME.break_at``: see gyrobench.linear.linear_model.  Of a part: ``continuous``
from all inputs to all outputs, and ``discrete``, its own internal step with the inputs held; one that works in samples
and keeps something has the discrete one only.

Not modelled: limits, and what else is not smooth: the derivatives are those of the branch taken at the point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component import Component, ComponentError
from gyrobench.exchange.ssp_export import ExportError, prepare
from gyrobench.files import write_whole
from gyrobench.linear.linear_model import known_parts, loops, operating_point
from gyrobench.record.run_document import LinearModel, LinearPair
from gyrobench.system.bare_numbers import question, usual_size
from gyrobench.system.system import System
from gyrobench.system.values import InvalidValueError, flatten, parse

BEFORE = " (step before)"  # ends the name of a state that is the value of a wire


def export_mat(
    system: System,
    path: Path,
    parts: Mapping[str, Path | str] | None = None,
    maps: Mapping[str, Path] | None = None,
    seed: int = 1,
    bench: Path | None = None,
) -> list[str]:
    """Write the linear models of a system; return notes.  Raises ExportError where there are none."""
    assembly, starts, notes = prepare(system, parts, maps, None, seed, bench)
    names = {slot: str((parts or {}).get(slot, declared.part)) for slot, declared in system.slots.items()}
    parameters = {f"{slot}.{bound.variable}": x for slot, given in starts.items() for bound, x in given}
    part_of = known_parts({slot: name for slot, name in names.items() if not name.endswith(".fmu")}, bench)
    models, warnings = loops(assembly, parameters, part_of, system.step)
    if models.missing:
        raise ExportError(f"mat: {system.name} has no linear model: {models.missing}")
    found = operating_point(assembly, parameters, part_of)
    units = {f"{slot}.{s.name}": s.decl.unit for slot, p in found.items() for s in p.layout}
    inside = {
        name: {"break_at": pair.break_at, **_pair(pair, units | {"L": "1"})} for name, pair in models.loops.items()
    }
    content = {"closed": _pair(models.closed, units), "loops": inside, "operating_point": _point(found)}
    _write(path, system.name, system.title, content)
    return [*notes, *warnings]


def export_part_mat(cls: type[Component], name: str, path: Path, values: Mapping[str, str]) -> None:
    """Write the linear model of a part; values: texts with units, of parameters and inputs, by name.

    Raises ExportError, and InvalidValueError for a value.
    """
    part = cls(name)
    for key, text in values.items():
        own = [s for s in part.layout if s.section in ("parameter", "input") and key in (s.name, s.decl.name)]
        if not own:
            raise InvalidValueError(f"{key}: no parameter or input of {name}")
        value = parse(key, text, own[0].decl.unit, own[0].decl.type)
        question(key, text, value, own[0].decl.unit, usual_size([s.start for s in own]))
        for element, x in flatten(key, value).items():
            if element not in {s.name for s in own}:
                raise InvalidValueError(f"{key}: {len(own)} values are expected")
            part.set(element, x)
    step = min(float(part.get("step")) if "step" in cls.declarations else 1e-3, 1.0)
    try:
        part.initialize()
        found = _part_models(part, step)
    except (ComponentError, ValueError) as error:
        raise ExportError(f"mat: {name} has no linear model: {error}") from error
    models = _pair(LinearPair(**found), {s.name: s.decl.unit for s in part.layout})
    about = (cls.__doc__ or name).strip().splitlines()[0]
    _write(path, name, about, models | {"operating_point": _point({"": part})})


def _part_models(part: Component, step: float) -> dict[str, LinearModel]:
    """Return the models of a part at its point.  Raises ComponentError, and ValueError where its steps differ."""
    from gyrobench.linear.block import block_of, step_of, undelayed_of

    part.h = step
    inputs, outputs = ([s.name for s in part.layout if s.section == of] for of in ("input", "output"))
    block = block_of(part, inputs, outputs, step)
    sampled = step_of(part, inputs, outputs, step)

    def model(a: Array, b: Array, c: Array, d: Array, states: Sequence[str], h: float) -> LinearModel:
        matrices = {"A": a.tolist(), "B": b.tolist(), "C": c.tolist(), "D": d.tolist()}
        return LinearModel(**matrices, inputs=inputs, outputs=outputs, states=[*states], step=h)

    if sampled is None:
        return {
            "continuous": model(block.a, block.b, block.c, block.d, block.states, 0.0),
            "discrete": model(*block.held(step), block.c, block.d, block.states, step),
        }
    found = {"discrete": model(sampled.a, sampled.b, sampled.c, sampled.d, sampled.names, step)}
    if not sampled.within and (plain := undelayed_of(part, inputs, outputs, step)) is not None:
        found["continuous"] = model(*plain, block.states, 0.0)
    return found


def _pair(pair: LinearPair, units: Mapping[str, str]) -> dict[str, Any]:
    models = {"continuous": pair.continuous, "discrete": pair.discrete}
    return {kind: _model(m, units) for kind, m in models.items() if m is not None}


def _model(m: LinearModel, units: Mapping[str, str]) -> dict[str, Any]:
    n, p, q = len(m.states), len(m.inputs), len(m.outputs)
    matrices = {"A": (m.A, (n, n)), "B": (m.B, (n, p)), "C": (m.C, (q, n)), "D": (m.D, (q, p))}
    named = {"inputs": m.inputs, "outputs": m.outputs, "states": m.states}
    return {
        **{k: np.array(x, dtype=float).reshape(shape) for k, (x, shape) in matrices.items()},
        "Ts": m.step,
        **{k: _texts(names) for k, names in named.items()},
        **{f"{k[:-1]}_units": _texts([units[x.removesuffix(BEFORE)] for x in names]) for k, names in named.items()},
    }


def _point(parts: Mapping[str, Component]) -> dict[str, Any]:
    """Return names, values and units of all inputs, outputs and states at the operating point."""
    ports = ("input", "output", "state")
    rows = [(f"{slot}.{s.name}".lstrip("."), part.get(s.name), s.decl.unit)
            for slot, part in parts.items() for s in part.layout if s.section in ports]  # fmt: skip
    return {"names": _texts([r[0] for r in rows]), "values": np.array([r[1] for r in rows])[:, None],
            "units": _texts([r[2] for r in rows])}  # fmt: skip


def _texts(texts: Sequence[str]) -> Any:
    """Return a cell array of texts, a column."""
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells


def _write(path: Path, name: str, about: str, content: Mapping[str, Any]) -> None:
    from scipy.io import savemat

    whole = {"name": name, "about": about, **content}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda temporary: savemat(str(temporary), whole, appendmat=False, long_field_names=True))
