"""Table of the noise coefficients N, B, K, R, Q of a long test, for its report.  [DRIFT-NOISE-MODEL]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.treatment import LONG, Treated
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.noise_coefficients import Estimate
from gyrobench.result import DriftTestResult, Table
from gyrobench.units import DPH

LEAST = 400  # windows of a long test
#: coefficient -> unit of the report, SI of one of it, meaning
TERMS: Mapping[str, tuple[str, float, str]] = {
    "N": ("°/√h", math.radians(1.0) / 60.0, "angle random walk"),
    "B": ("°/h", DPH, "bias instability: flicker floor 0.664 B"),
    "K": ("°/h/√h", DPH / 60.0, "rate random walk"),
    "R": ("°/h²", DPH / 3600.0, "rate ramp"),
    "Q": ("″", units.factor("arcsec"), "angle noise of a reading"),
}
ENDS = LONG + 1  # steps without a value that end a stretch of the noise model
RESIDUAL = (
    "From the residuals of the fit: drift that its terms take up, of the period of a turn and longer, is missing here: "
    "slow noise may be larger and has no upper end, a ramp is not seen"
)


def noise_coefficients_table(result: DriftTestResult, record: Record, residual: bool = False) -> list[Table]:
    """Return the table, or none where a test has fewer than LEAST windows, or windows that do not stand end to end.

    By the noise model of the drift rate itself, or of its residuals.  Each series of the result is a stretch of its
    own; missing windows, and those of another length, are gaps.
    """
    start, end = (np.asarray(record.windows[n], dtype=float) for n in ("t_start", "t_end"))
    length = float(np.median(end - start)) if start.size else 0.0
    if sum(len(s.t) for s in result.series) < LEAST:
        return []
    stretches = [on_grid(np.array(s.t), np.array(s.residual if residual else s.y), length) for s in result.series]
    rate = DPH * np.concatenate([x for s in stretches for x in (s, np.full(ENDS, math.nan))])
    try:
        noise = fit_noise(rate, length)
    except SeriesError:
        return []  # constant, or a gap after each window
    rows = [
        _row(f"{name}, {meaning}", noise[name], si, unit, noise.agrees, residual and name in ("B", "K"))
        for name, (unit, si, meaning) in TERMS.items()
        if name != "R" or not residual
    ]
    for g in noise.processes if noise.agrees else ():
        rows.append(_row("σ, Gauss-Markov drift", g.sigma, DPH, "°/h", True, residual))
        rows.append(_row("τ, Gauss-Markov drift", g.tau, 1.0, "s", True, residual))
    caption = f"IEEE 952, from {int(np.isfinite(rate).sum())} means of {length:g} s by their noise model"
    if not noise.agrees:
        caption = f"The noise model does not describe the record, so that no coefficient is stated. {caption}"
    elif taken := _taken(noise.treatment):
        caption = f"{caption}; taken out before: {taken}"
    if noise.treatment.jumps:
        caption = f"{caption}; the level jumps as part of the noise"
    caption = f"{caption}. {RESIDUAL}" if residual else caption
    columns = ["coefficient", "value", "95 % from", "95 % to", "unit", "finding"]
    return [Table("noise_coefficients", "Noise coefficients", caption, columns, rows)]


def _taken(t: Treated) -> str:
    """Return what was taken out before the model, in words."""
    level = len(t.changes) - len(t.pulses)
    counts = (
        (len(t.lines), "line"),
        (level, "step or slow change"),
        (len(t.pulses), "pulse"),
        (t.wild.size, "wild value"),
    )
    several = {"step or slow change": "steps or slow changes"}
    return ", ".join(f"{n} {word if n == 1 else several.get(word, f'{word}s')}" for n, word in counts if n)


def _row(name: str, e: Estimate, si: float, unit: str, stated: bool, no_end: bool) -> list[Any]:
    """Return a row of an estimate; no_end: it may be larger."""
    if not stated:
        return [name, None, None, None, unit, "not determined"]
    value, high = e.value / si if e.determined else None, None if no_end else e.high / si
    return [name, value, e.low / si, high, unit, "" if e.determined else "not determined"]


def on_grid(t: Array, x: Array, step: float) -> Array:
    """Return values in the order of their times on a grid of steps, NaN where one is missing.

    A time that is no multiple of the step after the one before, within a hundredth of it, ends a stretch of the noise
    model, as a long gap does.
    """
    order = np.argsort(t, kind="stable")
    t, x = t[order], x[order]
    steps = np.diff(t) / step
    whole = np.rint(steps)
    on = (np.abs(steps - whole) < 0.01) & (whole > 0.0)
    places = np.cumsum(np.append(0.0, np.where(on, np.minimum(whole, ENDS), ENDS))).astype(int)
    out = np.full(int(places[-1]) + 1, math.nan)
    out[places] = x
    return out
