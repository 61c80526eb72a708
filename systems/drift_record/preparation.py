"""Columns of a drift record made ready for its statistics: rates on a grid, other columns regressed, lines removed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.series.channel_units import FORCE, RATE, ChannelUnits, units_of
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.drift_model import DriftModel, describe
from gyrobench.reduction.series.lines import Lines
from gyrobench.reduction.series.motion import MOST, moved, turned
from gyrobench.reduction.series.row_pattern import RowPattern, every_second_row
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.toolkit import Array, Record, ReductionError, attitude_of, plain
from gyrobench.units import DPH

from .regressors import RegressionSlope, regress, with_rates_of_change

LEAST = 512  # samples of a record
OWN = {"phase", "t_start", "t_end", "angle_start", "angle_end", "mean", "std", "n", "flagged"}


@dataclass(frozen=True)
class Prepared:
    """A rate (rad/s) or force (m/s²) on the grid, NaN in gaps, and its noise model; step: s."""

    name: str
    units: ChannelUnits
    time: Array  # of the first sample on, s
    step: float
    rate: Array
    regressions: tuple[RegressionSlope, ...]
    noise: NoiseModel
    model: DriftModel  # of the stretch
    inseparable: list[str]
    explained: float | None  # share of the variance of the samples that the columns taken out explain

    @cached_property
    def clean(self) -> Array:
        """The rate without what columns, lines, steps explain, and without its wild samples."""
        return self.noise.cleaned

    @property
    def first(self) -> int:
        """Place of the stretch on the grid."""
        return self._longest[0]

    @property
    def stretch(self) -> Array:
        """The longest part of ``clean`` without a long gap, for spectra and time-series models; what was missing or
        wild in it is drawn from the noise around.
        """
        return self._longest[1]

    @cached_property
    def rows(self) -> RowPattern:
        """How even and odd samples differ."""
        return every_second_row(self.rate, self.clean)

    @cached_property
    def _longest(self) -> tuple[int, Array]:
        return self.noise.longest

    @property
    def cleaned(self) -> bool:
        """Whether anything was taken out."""
        t = self.noise.treatment
        return bool(any(r.kept for r in self.regressions) or t.lines or t.changes or t.wild.size)

    @property
    def lines(self) -> Lines:
        """The lines, taken out before the noise model or left in."""
        m, t = self.model.lines, self.noise.treatment
        return replace(m, lines=tuple(self.noise.lines), complete=t.complete_lines) if t.lines else m


@dataclass(frozen=True)
class Columns:
    """The rates of a record and its other columns, on one grid."""

    time: Array  # of the beginning of each sample, s; a gap of more than a million samples has a million
    rates: dict[str, Array]
    others: dict[str, Array]
    others_unit: dict[str, str]
    step: float
    conventions: list[str] = field(default_factory=list)
    units: dict[str, ChannelUnits] = field(default_factory=dict)  # of the channels that are no rate
    inseparable: list[str] = field(default_factory=list)  # rates of change that follow their columns
    moved: NDArray[np.bool_] | None = None  # samples in which the instrument was moved, left out; None: none
    restless: float = 0.0  # share of the record in which it was moved, where that is too much to leave out


def columns_of(record: Record) -> Columns:
    """Return rates and other columns of a record, simulated or measured.  Raises ReductionError."""
    w, run = record.windows, record.run
    if run.series is not None:
        step = float(run.series["acquisition"]["step"]) * int(run.series["factor"])
        others = {n: np.asarray(w[n], dtype=float) for n in run.series["others"]}
        rates = {n: np.asarray(w[n], dtype=float) for n in run.series["columns"]}
        start = np.asarray(w["t_start"], dtype=float)
        units = {n: units_of(run.window_units.get(n, "")) for n in rates}
        others, named, left = with_rates_of_change(others, run.window_units, step)
        found = moved(rates, step)
        if gyros := [v for n, v in rates.items() if units[n] is RATE]:
            found |= turned(gyros, step)
        restless = float(found.mean())
        if cut := 0.0 < restless <= MOST:
            rates = {n: np.where(found, np.nan, v) for n, v in rates.items()}
        return Columns(
            start - start[0], rates, others, named, step, units=units, inseparable=left,
            moved=found if cut else None, restless=0.0 if cut else restless,
        )  # fmt: skip
    if "mean" not in w or len(w["mean"]) < LEAST:
        raise ReductionError([f"{len(w.get('mean', ()))} windows: a drift record needs at least {LEAST}"])
    site = run_metadata.Location.of(run)
    step = float(np.mean(np.asarray(w["t_end"]) - np.asarray(w["t_start"])))
    others = {n: np.asarray(v, dtype=float) for n, v in w.items() if n not in OWN}
    grid = step * np.arange(float(len(w["mean"])))
    if run.options.get("reading") == "force":
        known = float(attitude_of(run)[0] @ frames.U) * site.gravity
        along = plain(known, 6)
        said = [f"Specific force of the axis x, mean of a window, less that of gravity along it, {along} m/s²."]
        bias = {"bias": np.asarray(w["mean"], dtype=float) - known}
        return Columns(grid, bias, others, run.window_units, step, said, {"bias": FORCE})
    k = run_metadata.rate_per_reading(run)
    input_rate = float(attitude_of(run)[0] @ frames.earth_rate_local(site.latitude, site.earth_rate))
    rate = input_rate - k * np.asarray(w["mean"], dtype=float)
    earth = f"Earth rate along the input axis {plain(input_rate / DPH, 6)} °/h."
    said = [
        f"Drift rate ω_IA less the mean rate of a window, axis x: the sign of a precession. {earth}"
        if run_metadata.reads_rate(run)
        else "Drift rate ω_d = ω_IA − k i in precession sign, k i the mean current of a window in rate; "
        f"k = {plain(k * 1e-3 / DPH, 6)} °/h/mA, {earth}"
    ]
    return Columns(grid, {"drift": rate}, others, run.window_units, step, said)


def prepare(
    name: str, columns: Columns, remove_lines: bool, means: bool = True, wild: bool = True, alike: float = 0.0
) -> Prepared:
    """Return a rate with its noise model and what other columns, lines and steps explain taken out.

    means: a sample is the mean over the step.  wild: samples are looked for that are none of the noise.  alike: share
    of the samples that are as they were read and equal the one before.
    Raises ReductionError for a record too short or without a stretch long enough.
    """
    rate = columns.rates[name]
    if np.count_nonzero(np.isfinite(rate)) < LEAST:
        raise ReductionError(
            [f"column '{name}': {np.count_nonzero(np.isfinite(rate))} samples; at least {LEAST} needed"]
        )
    regressions = regress(rate, columns.others, columns.others_unit)
    taken = np.zeros_like(rate)
    for r in regressions:
        if r.kept:
            x = columns.others[r.name]
            taken += r.slope * np.nan_to_num(x - np.nanmean(x))
    left = rate - taken
    there = np.isfinite(rate)
    share = float(np.var(taken[there]) / (np.var(rate[there]) or 1.0)) if regressions else None
    try:
        noise = fit_noise(left, columns.step, means, remove_lines, wild, rate, alike, columns.restless)
        model = describe(noise.longest[1], columns.step)
    except SeriesError as error:
        raise ReductionError([f"column '{name}': {error}"]) from None
    return Prepared(
        name, columns.units.get(name, RATE), columns.time, columns.step, rate, regressions, noise, model,
        columns.inseparable, share,
    )  # fmt: skip


#: noise coefficient -> parameter of the gyro that gives it
GIVEN = {"B": "flicker", "K": "walk", "R": "ramp", "Q": "quantization"}


#: the same of the axis x of a rate gyro
GIVEN_X = {"B": "flicker_x", "K": "walk_x"}
#: and of that of accelerometers
GIVEN_FORCE = {"N": "white", "B": "x_flicker", "K": "x_walk"}
FOLDS = 1.001  # of the density, from where on it is said to fold


def folded(parameters: Mapping[str, Any], slot: str) -> float:
    """Return the density of white noise in the samples of a part over that before its filter, a Butterworth one of
    second order: the root of the sum over k of 1/(1 + (k/(T f))4), T the time between two samples.
    """
    T, f = (float(parameters.get(f"{slot}.{n}", 0.0)) for n in ("period", "bandwidth"))
    if not T or not f:
        return 1.0
    return math.sqrt(1.0 + 2.0 * float(np.sum(1.0 / (1.0 + (np.arange(1, 1000) / (T * f)) ** 4))))


def truth_of(record: Record) -> dict[str, float]:
    """Return the noise coefficients that the gyro of a run was given, SI; {} for measured data.

    N of a rate gyro is the density that it shows, or its parameter; otherwise the noise of the current reading is part
    of N.  Samples of a filter above half their rate fold its noise down (:func:`folded`).  Pickoff noise is angle noise
    that the loop shapes: with it Q has no stated truth.  K is of a Gauss-Markov process too that is slower than a tenth
    of the record.
    """
    p: dict[str, Any] = dict(record.run.parameters)
    out = _given(record, p)
    for name in ("gyro.markov", "gyro.markov_x"):
        sigma, tau = p.get(name, 0.0), p.get(f"{name}_tau", p.get("gyro.markov_tau", 0.0))
        if sigma and "K" in out and tau > (record.windows["t_end"][-1] - record.windows["t_start"][0]) / 10.0:
            out["K"] = math.hypot(out["K"], sigma * math.sqrt(2.0 / tau))
    return out


def _given(record: Record, p: Mapping[str, Any]) -> dict[str, float]:
    """Return the coefficients as the parameters of a run have them."""
    run = record.run
    if run.options.get("reading") == "force":
        out = {term: float(p[n]) for term, name in GIVEN_FORCE.items() if (n := f"accelerometers.{name}") in p}
        out |= {n: folded(p, "accelerometers") * v for n, v in out.items() if n == "N"}
        return out or ({"N": float(p["accelerometers.white_x"])} if "accelerometers.white_x" in p else {})
    if run_metadata.reads_rate(run):
        out = {term: float(p[f"gyro.{name}"]) for term, name in GIVEN_X.items() if f"gyro.{name}" in p}
        if "gyro.density" in record.channels:
            out["N"] = float(record.channels["gyro.density"][0])
        elif "gyro.white_x" in p:
            out["N"] = float(p["gyro.white_x"])
        fold = folded(p, "gyro")
        if fold > FOLDS and "gyro.split" in p:  # the sense mode filters it, too
            out.pop("N", None)
        return out | {n: fold * v for n, v in out.items() if n == "N"}
    out = {term: float(p[f"gyro.{name}"]) for term, name in GIVEN.items() if f"gyro.{name}" in p}
    if p.get("gyro.pickoff") or not p.get("gyro.quantization"):
        out.pop("Q", None)
    if "gyro.white" in p:
        k, meter = float(run.options.get("k") or p.get("gyro.k", 0.0)), float(p.get("rebalance.meter", 0.0))
        out["N"] = math.hypot(float(p["gyro.white"]), k * meter)
    return out
