"""A frequency response on a vibrating table: its points with their noise, sources of error, what these do to figures.

The sensitivity of a figure is taken by moving the points and taking the figures anew.  [TEST-BANDWIDTH]
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis.unshown import ARRANGEMENT
from gyrobench.reduction.estimation.effects import shifts_table
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import Gate, neighbour_noise, phasor
from gyrobench.reduction.setup.conditions import TYPE_B_UNSTATED
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.sources import READING_GAIN, READING_LAG, RELATIVE, TIME_BASE, Source
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import BudgetLine, Reason, Table

ROUNDING = 1e-6  # least relative uncertainty of a point
LINES = 12  # numbers from which neighbour_noise estimates
GAIN_SLOPE = Source("reading.gain.slope", "gain of table or reading at the highest frequency", RELATIVE, "")
#: what no residual shows: words, and how far it is off
WRONG = {
    READING_GAIN.id: ("a gain of table or reading wrong by 2 %", 0.02),
    TIME_BASE.id: ("a time base wrong by 2 %", 0.02),
    READING_LAG.id: ("a reading late by 1 ms (a sample too much)", 1e-3),
    GAIN_SLOPE.id: ("an amplitude wrong by 2 % at the highest frequency", 0.02),
}
#: of the instrument alone are the figures that these move only where something is stated of it
LEFT_OUT = {
    READING_GAIN.id: "Nothing is stated of the gain of the table reading (u_gain), and no residual shows it: of {} the "
    "value and its interval are those of instrument and reading together.",
    READING_LAG.id: "Nothing is stated of a lag of the table reading (u_lag), and no residual shows it: of {} the "
    "value and its interval are those of instrument and reading together.",
}
TOGETHER = ", of instrument and table reading together"
Figures = Sequence[tuple[int, str, str, float, float]]
UNKNOWN = 1e-3  # u of points that state none: any, the scatter about the curve takes its place
BEND = 3  # degree in ln f of the logarithm of the noise, which is smooth
ROOT_POWER = math.exp(0.5 * (math.log(LINES / 2.0) - float(special.psi(LINES / 2.0))))  # 1 over exp(mean ln s)


@dataclass(frozen=True)
class LineRatios:
    """Frequencies (n,), Hz; ratios of two channels, complex; their relative standard uncertainties; amplitudes of x."""

    f: Array
    value: NDArray[Any]
    u: Array
    x: Array


def line_ratios(gates: Sequence[Gate], x: str, y: str, of_y: Sequence[Gate] | None = None) -> LineRatios:
    """Return channel y over channel x at the frequencies of gates, with the noise beside their lines.

    of_y: the same phases with the times at which y was taken, where these are not those of x.
    The noise of a channel over frequency is smooth: a polynomial through the logarithms of what each gate shows of it,
    of 12 numbers, has many more.  Weights from 12 numbers each would make u a fifth too small.
    Raises ReductionError for samples of x too coarse for a frequency, and for an x without its sine.
    """
    f = np.array([g.f for g in gates])
    time = np.array([g.t[-1] - g.t[0] for g in gates])
    pairs = [((g, x), (other, y)) for g, other in zip(gates, of_y or gates, strict=True)]
    lines = np.array([[phasor(g.t, g[c], g.f) for g, c in pair] for pair in pairs])
    sizes = np.abs(lines)
    for g, size in zip(gates, sizes[:, 0], strict=True):
        _seen(g, x, size)
    noise = np.array([[_noise(g, c) for g, c in pair] for pair in pairs])
    few = float(special.stdtrit(LINES, 0.975)) / NORMAL  # many points together: no allowance for few numbers
    shown = np.maximum(noise / few, 1e-3 * ROUNDING * sizes) * np.sqrt(time)[:, None]
    at = np.log(f / f.mean())
    degree = min(BEND, max(0, f.size // 3 - 1))
    smooth = np.column_stack([np.exp(np.polyval(np.polyfit(at, c, degree), at)) for c in np.log(shown).T])
    u = np.linalg.norm(ROOT_POWER * smooth / np.sqrt(time)[:, None] / sizes, axis=1)
    return LineRatios(f, lines[:, 1] / lines[:, 0], np.maximum(u, ROUNDING), sizes[:, 0])


def _seen(gate: Gate, x: str, size: float) -> None:
    step = float(gate.t[1] - gate.t[0])
    if gate.f * step > 0.25:
        raise ReductionError(f"{gate.f:g} Hz: a sample every {step:g} s is too coarse; record at least 4 a period")
    if not size > 1e-12 * float(np.max(np.abs(gate[x])) or 1.0):
        raise ReductionError(f"{gate.f:g} Hz: the reference signal has no component at this frequency")


def _noise(gate: Gate, channel: str) -> float:
    found = neighbour_noise(gate.t, gate[channel], gate.f)
    if found is None:
        raise ReductionError(f"{gate.f:g} Hz: too few periods to see the noise beside the line")
    return found


def stated_u(w: Mapping[str, Array]) -> tuple[bool, Array]:
    """Return whether the rows of a measured response state u, and u (n,); ReductionError for one that cannot be."""
    if "u" not in w or not np.all(np.isfinite(w["u"])):
        return False, np.full(w["table"].size, UNKNOWN)
    if np.any(w["u"] <= 0.0):
        raise ReductionError("u: a relative standard uncertainty above 0 is expected")
    return True, w["u"]


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


def predicted_shifts(run: RunDocument, by: Sequence[Sensitivity], figures: Figures) -> Table | None:
    """Return by how much each figure is off by the simulated errors of the set-up; None without one.

    figures: place among the sensitivities, name, printed unit, SI per unit, standard uncertainty in SI.
    """
    errors = simulated_errors(run)
    known = [(s, float(e)) for s in by if isinstance(e := errors.get(s.source.id), float) and e]
    if not known:
        return None
    shifts = [(name, [error * float(s.change[k]) / scale for s, error in known], u / scale, unit)
              for k, name, unit, scale, u in figures]  # fmt: skip
    return shifts_table([(s.source.name, e, s.source.unit) for s, e in known], shifts)


def unstated(run: RunDocument, by: Sequence[Sensitivity], figures: Figures) -> dict[str, dict[str, float]]:
    """Return what is not stated though no residual shows it: source -> figure -> its change over u by an error as in
    WRONG.  Of a run, those of which it has an error.  figures: as of :func:`predicted_shifts`.
    """
    errors = {} if run.measured else simulated_errors(run)
    return {
        s.source.id: {
            name: WRONG[s.source.id][1] * abs(float(np.nan_to_num(s.change[k]))) / u
            for k, name, _, _, u in figures
            if u > 0.0
        }
        for s in by
        if s.source.id in WRONG and s.u == 0.0 and (run.measured or errors.get(s.source.id))
    }


def together(run: RunDocument, by: Sequence[Sensitivity], figures: Figures) -> dict[str, tuple[str, ...]]:
    """Return the figures that are of instrument and table reading together, by the source of which nothing is stated.

    A record that declares type_b = none states that the reading has no error.
    """
    unknown = {} if run.measured and run.type_b == "none" else unstated(run, by, figures)
    return {id: tuple(n for n, v in unknown[id].items() if v > 1.0) for id in LEFT_OUT if id in unknown}


def not_stated(run: RunDocument, by: Sequence[Sensitivity], figures: Figures) -> Iterator[Reason]:
    """Yield what a measured record does not state though no residual shows it: gain and lag of the reading, of each
    figure that they move, and that units and scales were checked (see gyrobench.reduction.diagnosis.unshown).

    figures: as of :func:`predicted_shifts`; none where the record has no sines.
    """
    if not run.measured:
        return
    for id, names in together(run, by, figures).items():
        if names:
            text = LEFT_OUT[id].format(", ".join(names))
            yield Reason(TYPE_B_UNSTATED, text, ("pass", "fail"), names, severity="doubt")
    if run.arrangement == "checked":
        return
    said = ["frequencies in rad/s given as Hz (6.28 times)"] if figures else [WRONG[TIME_BASE.id][0]]
    for id, moved in unstated(run, by, figures).items():
        far = sorted((n for n, v in moved.items() if v > 1.0), key=lambda n: -moved[n])[:3]
        if far:
            said.append(f"{WRONG[id][0]} ({', '.join(f'{n} by {plain(moved[n])} u' for n in far)})")
    text = (
        f"No residual of this record would show: {'; '.join(said)}. State that units and scales were checked "
        "(arrangement = checked)."
    )
    yield Reason(ARRANGEMENT, text, ("pass",), severity="doubt")


def left_out(reasons: Sequence[Reason]) -> list[str]:
    """Return of what the figures are where nothing is stated, as sentences of the summary."""
    return [r.text for r in reasons if r.id == TYPE_B_UNSTATED]
