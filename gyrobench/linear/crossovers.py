"""Gain crossover of the loops of a linear model against the requested one, before the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gyrobench.record.frequency_response import TOLERANCE, model_response
from gyrobench.record.run_document import LinearModel, LinearModels

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


def missed_crossovers(models: LinearModels, wanted: Mapping[str, float], causes: Sequence[str]) -> list[str]:
    """Return a sentence for each loop whose crossover will not be the requested one.

    wanted: loop -> Hz.  causes: what was set or swapped, for the user to check.
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
