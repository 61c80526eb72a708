"""A frequency response on a vibrating table: its points with their noise, sources of error, what these do to figures.

The sensitivity of a figure is taken by moving the points and taking the figures anew.  [TEST-BANDWIDTH]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import Gate, neighbour_noise, phasor, response
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.sources import Source
from gyrobench.result import BudgetLine, Table

READING_GAIN = Source("table.reading.gain", "gain of the reading of the table rate", "1", "u_gain", "reading too large")
READING_LAG = Source("table.reading.lag", "lag of the reading of the table rate", "s", "u_lag", "reading late")
COSINE = Source("mount.cosine", "cosine of the input axis against the table axis", "1", "u_mount", "second order")
ROUNDING = 1e-6  # least relative uncertainty of a point
LINES = 12  # numbers from which neighbour_noise estimates


def line_ratio(gate: Gate, x: str, y: str) -> tuple[complex, float]:
    """Return channel y over x at the frequency of a gate, and its relative uncertainty by the lines beside it."""
    t, a, b = gate.t, gate[x], gate[y]
    point = response(t, a, b, gate.f)
    noise = [neighbour_noise(t, signal, gate.f) for signal in (b, a)]
    if any(n is None for n in noise):
        return point.value, max(point.u or 0.0, ROUNDING)
    few = float(special.stdtrit(LINES, 0.975)) / NORMAL  # many points together: no allowance for few numbers
    sizes = [abs(phasor(t, signal, gate.f)) for signal in (b, a)]
    u = math.hypot(*(float(n or 0.0) / few / size for n, size in zip(noise, sizes, strict=True)))
    return point.value, max(u, ROUNDING)


@dataclass(frozen=True)
class Sensitivity:
    """A source, its standard uncertainty u, SI, and the change (n,) of the figures, SI, for one unit of it."""

    source: Source
    u: float
    change: Array

    def share(self, k: int) -> float:
        """Return what this source makes uncertain of figure k, with its sign, SI."""
        return float(np.nan_to_num(self.change[k])) * self.u

    def line(self, name: str, unit: str, scale: float, k: int) -> BudgetLine:
        """Return the line of the budget of figure k, called ``name``; scale: SI per printed unit."""
        s = self.source
        per = unit if s.unit == "1" else f"{unit}/{s.unit}"
        slope = float(np.nan_to_num(self.change[k])) / scale
        return BudgetLine(s.id, s.name, self.u, s.unit, slope, per, abs(self.share(k)) / scale, unit, name, s.note)


def predicted_shifts(
    run: RunDocument, by: Sequence[Sensitivity], figures: Sequence[tuple[int, str, str, float, float]]
) -> Table | None:
    """Return by how much each figure is off by the simulated errors of the set-up; None without one.

    figures: place among the sensitivities, name, printed unit, SI per unit, standard uncertainty in SI.
    """
    errors = simulated_errors(run)
    known = [(s, float(e)) for s in by if isinstance(e := errors.get(s.source.id), float) and e]
    if not known:
        return None
    rows = []
    for k, name, unit, scale, u in figures:
        each = [error * float(s.change[k]) / scale for s, error in known]
        rows.append([name, *each, sum(each), u / scale, unit])
    said = [f"({n}) {s.source.name}, {units.format_quantity(e, s.source.unit)}" for n, (s, e) in enumerate(known, 1)]
    caption = (
        "Change of each estimate against a set-up without these errors, sensitivity of the budget times error: "
        f"{'; '.join(said)}."
    )
    head = ["coefficient", *(f"({n + 1})" for n in range(len(known))), "sum", "u", "unit"]
    return Table(PREDICTED, "Predicted shifts by simulated errors", caption, head, rows)
