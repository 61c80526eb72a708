"""Columns of a drift record made ready for its statistics: rates on a grid, other columns regressed, lines removed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.drift_model import DriftModel, describe
from gyrobench.reduction.series.lines import SpectralLine
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import attitude_of
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.units import DPH

from .regressors import Regression, block_means_of, regress

WHOLE = 0.5  # part of the samples that a stretch without a gap must hold
LEAST = 512  # samples of it
OWN = {"phase", "t_start", "t_end", "angle_start", "angle_end", "mean", "std", "n", "flagged"}


@dataclass(frozen=True)
class Prepared:
    """A rate on the grid, rad/s, NaN in gaps; clean: without what regression and lines take out.

    stretch: the longest one of ``clean`` without a gap, for spectra and models; of means over ``averaged`` samples
    where gaps are many.  step, stretch_step: s.
    """

    name: str
    time: Array  # of the first sample on, s
    step: float
    rate: Array
    clean: Array
    regressions: tuple[Regression, ...]
    model: DriftModel  # of the stretch
    stretch: Array
    stretch_step: float
    averaged: int
    first: int  # place of the stretch on the grid

    @property
    def cleaned(self) -> bool:
        """Whether anything was taken out."""
        return self.clean is not self.rate


@dataclass(frozen=True)
class Columns:
    """The rates of a record and its other columns, on one grid."""

    time: Array  # of the beginning of each sample, s; a gap of more than a million samples has a million
    rates: dict[str, Array]
    others: dict[str, Array]
    others_unit: dict[str, str]
    step: float
    conventions: list[str] = field(default_factory=list)


def columns_of(record: Record) -> Columns:
    """Return rates and other columns of a record, simulated or measured.  Raises ReductionError."""
    w, run = record.windows, record.run
    if run.series is not None:
        step = float(run.series["acquisition"]["step"]) * int(run.series["factor"])
        others = {n: np.asarray(w[n], dtype=float) for n in run.series["others"]}
        rates = {n: np.asarray(w[n], dtype=float) for n in run.series["columns"]}
        start = np.asarray(w["t_start"], dtype=float)
        return Columns(start - start[0], rates, others, run.window_units, step)
    if "mean" not in w or len(w["mean"]) < LEAST:
        raise ReductionError([f"{len(w.get('mean', ()))} windows: a drift record needs at least {LEAST}"])
    k = run_metadata.number(run, "k", "gyro.k", "torquer scale factor")
    site = run_metadata.Site.of(run)
    input_rate = float(attitude_of(run)[0] @ frames.earth_rate_local(site.latitude, site.earth_rate))
    rate = input_rate - k * np.asarray(w["mean"], dtype=float)
    step = float(np.mean(np.asarray(w["t_end"]) - np.asarray(w["t_start"])))
    others = {n: np.asarray(v, dtype=float) for n, v in w.items() if n not in OWN}
    said = [
        "Drift rate ω_d = ω_IA − k i in precession sign, k i the mean current of a window in rate; "
        f"k = {k * 1e-3 / DPH:.6g} °/h/mA, Earth rate along the input axis {input_rate / DPH:.6g} °/h.",
    ]
    return Columns(step * np.arange(float(rate.size)), {"drift": rate}, others, run.window_units, step, said)


def prepare(name: str, columns: Columns, remove_lines: bool) -> Prepared:
    """Return a rate with what other columns and lines explain taken out.

    Raises ReductionError for a record too short or without a stretch long enough.
    """
    rate = columns.rates[name]
    if np.count_nonzero(np.isfinite(rate)) < LEAST:
        raise ReductionError(
            [f"column '{name}': {np.count_nonzero(np.isfinite(rate))} samples; at least {LEAST} needed"]
        )
    time = columns.time
    regressions = regress(rate, columns.others, columns.others_unit)
    clean = rate
    for r in regressions:
        if r.kept:
            x = columns.others[r.name]
            clean = clean - r.slope * np.nan_to_num(x - np.nanmean(x))
    stretch, first, averaged = longest_stretch(clean)
    step = columns.step * averaged
    try:
        model = describe(stretch, step)
    except SeriesError as error:
        raise ReductionError([f"column '{name}': {error}"]) from None
    if remove_lines and model.lines.lines:
        begin = time[first] + 0.5 * columns.step * (averaged - 1)
        clean = clean - sum_of(model.lines.lines, time - begin, columns.step, averaged)
        stretch = model.lines.residual
    return Prepared(name, time, columns.step, rate, clean, regressions, model, stretch, step, averaged, first)


def sum_of(lines: Sequence[SpectralLine], t: Array, step: float, averaged: int) -> Array:
    """Return the lines at times t, s; what the mean over ``averaged`` samples had weakened is restored."""
    out = np.zeros_like(t)
    for line in lines:
        x = math.pi * line.frequency * step
        weaker = math.sin(averaged * x) / (averaged * math.sin(x)) if averaged > 1 else 1.0
        out += line.amplitude / weaker * np.sin(2.0 * math.pi * line.frequency * t + line.phase)
    return out


def longest_stretch(x: Array) -> tuple[Array, int, int]:
    """Return the longest stretch without a gap, its first index on the grid, and of how many samples it has the means.

    Means, over those samples of each that are there (half of them or more), where single gaps cut the record short.
    Raises ReductionError where there is none of LEAST values.
    """
    best: tuple[Array, int, int] | None = None
    averaged, y = 1, x
    total = np.count_nonzero(np.isfinite(x))
    while y.size >= LEAST:
        a, b = _longest(y)
        if best is None or (b - a) * averaged > 1.5 * best[0].size * best[2]:
            best = y[a:b], a * averaged, averaged
        if (b - a) * averaged >= WHOLE * total:
            break
        averaged *= 2
        y = block_means_of(x, averaged)
    if best is None or best[0].size < LEAST:
        raise ReductionError([f"no stretch of {LEAST} samples without a gap: the gaps leave no spectrum"])
    return best


def _longest(x: Array) -> tuple[int, int]:
    edges = np.flatnonzero(np.diff(np.isfinite(x).astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    a, b = edges[int(np.argmax(edges[:, 1] - edges[:, 0]))].tolist() if edges.size else (0, 0)
    return int(a), int(b)


#: noise coefficient -> parameter of the gyro that gives it
GIVEN = {"B": "flicker", "K": "walk", "R": "ramp", "Q": "quantization"}


def truth_of(run: RunDocument) -> dict[str, float]:
    """Return the noise coefficients that the gyro of a run was given, SI; {} for measured data.

    The noise of the current reading is part of N.  Pickoff noise is angle noise that the loop shapes: with it Q has no
    stated truth.
    """
    p: dict[str, Any] = dict(run.parameters)
    out = {term: float(p[f"gyro.{name}"]) for term, name in GIVEN.items() if f"gyro.{name}" in p}
    if p.get("gyro.pickoff") or not p.get("gyro.quantization"):
        out.pop("Q", None)
    if "gyro.white" in p:
        k, meter = float(run.options.get("k") or p.get("gyro.k", 0.0)), float(p.get("rebalance.meter", 0.0))
        out["N"] = math.hypot(float(p["gyro.white"]), k * meter)
    return out
