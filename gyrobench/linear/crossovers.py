"""Gain crossover of the loops of a linear model against the requested one, before the run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.component import Component
from gyrobench.linear.linear_model import loops
from gyrobench.record.frequency_response import TOLERANCE, model_response
from gyrobench.record.run_document import LinearModel, LinearModels
from gyrobench.system.system import System
from gyrobench.system.wiring import Assembly

POINTS = 2000  # of a response in which crossovers are searched
SPAN = 100.0  # they are searched up to this factor from the requested crossover


def crossovers(model: LinearModel, wanted: float) -> list[tuple[float, float]]:
    """Return the gain crossovers of a loop: (Hz, phase margin in degrees), up to :data:`SPAN` from ``wanted`` Hz."""
    top = min(SPAN * wanted, 0.499 / model.step) if model.step else SPAN * wanted
    f = np.geomspace(wanted / SPAN, top, POINTS)
    response = model_response(model, f)[:, 0, 0]
    if not np.all(response):  # of a part that has no slope
        return []
    size, turn = np.log(np.abs(response)), np.degrees(np.unwrap(np.angle(response)))
    crossed = []
    for k in np.flatnonzero((size[:-1] > 0.0) & (size[1:] <= 0.0)):
        share = size[k] / (size[k] - size[k + 1])
        phase = turn[k] + share * (turn[k + 1] - turn[k])
        crossed.append((float(f[k] * (f[k + 1] / f[k]) ** share), float((phase + 360.0) % 360.0 - 180.0)))
    return crossed


def judged_loops(
    assembly: Assembly, system: System, parameters: Mapping[str, Any],
    part_of: Callable[[str], type[Component]], causes: Sequence[str],
) -> tuple[LinearModels, list[str]]:  # fmt: skip
    """Return the linear models that run.json keeps, and the warnings to give: of growing loops, of missed crossovers.

    causes: what was set or swapped, for the user to check.
    """
    models, warnings = loops(assembly, parameters, part_of, system.step)
    models.wanted = system.crossovers()
    if models.missing:
        asked = ", ".join(f"{loop} {f:.4g} Hz" for loop, f in models.wanted.items())
        unknown = f"; whether the loop crosses where it was asked to ({asked}) is not known before the run"
        return models, [w + (unknown if asked else "") for w in warnings]
    models.warnings = [*warnings, *_missed_crossovers(models, models.wanted, causes)]
    return models, models.warnings


def _missed_crossovers(models: LinearModels, wanted: Mapping[str, float], causes: Sequence[str]) -> list[str]:
    """Return a sentence for each loop whose crossover will not be the requested one.

    wanted: loop -> Hz.
    """
    because = f"; set or swapped: {', '.join(causes)}" if causes else ""
    sentences = []
    for name, f in wanted.items():
        model = models.loops[name].discrete if name in models.loops else None
        if model is None:
            continue
        candidates = crossovers(model, f)
        if not candidates:
            sentences.append(f"loop {name}: asked to cross at {f:.4g} Hz, its gain does not fall through 1{because}")
            continue
        at, margin = min(candidates, key=lambda c: abs(np.log(c[0] / f)))
        if abs(at / f - 1.0) > TOLERANCE:
            sentences.append(
                f"loop {name}: it will cross at {at:.3g} Hz with a phase margin of {margin:.0f}°, not at the "
                f"{f:.4g} Hz asked for{because}"
            )
    return sentences
