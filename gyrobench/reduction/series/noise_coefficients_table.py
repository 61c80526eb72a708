"""Table of the noise coefficients N, B, K, R, Q of a long test, for its report.  [DRIFT-COEFFICIENTS]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.series.noise_coefficients import JUST, fit
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
SLOW = ("B", "K")  # what a fit takes a part of
RESIDUAL = (
    "From the residuals of the fit: drift that its terms take up, of the period of a turn and longer, is missing here: "
    "B and K may be larger and have no upper end, a ramp is not seen"
)


def noise_coefficients_table(result: DriftTestResult, record: Record, residual: bool = False) -> list[Table]:
    """Return the table, or none where a test has fewer than LEAST windows, or windows that do not stand end to end.

    Of the drift rate itself, or of its residuals.  Each series of the result is a stretch of its own; missing windows,
    and those of another length, are gaps.
    """
    start, end = (np.asarray(record.windows[n], dtype=float) for n in ("t_start", "t_end"))
    length = float(np.median(end - start)) if start.size else 0.0
    if sum(len(s.t) for s in result.series) < LEAST:
        return []
    stretches = [on_grid(np.array(s.t), np.array(s.residual if residual else s.y), length) for s in result.series]
    try:
        found = fit([DPH * x for x in stretches], length)
    except ValueError:
        return []  # constant, or a gap after each window
    rows: list[list[Any]] = []
    for name, (unit, si, meaning) in TERMS.items():
        if residual and name == "R":
            continue
        e = getattr(found, name)
        value = e.value / si if e.determined else None
        high = None if residual and name in SLOW else float(e.high) / si
        finding = "just determined" if e.just_determined else "" if e.determined else "not determined"
        rows.append([f"{name}, {meaning}", value, float(e.low) / si, high, unit, finding])
    count = sum(int(np.isfinite(x).sum()) for x in stretches)
    caption = (
        f"IEEE 952, from {count} means of {length:g} s by maximum likelihood; not determined: the interval holds 0. "
        "Gauss-Markov drift is not among the five terms: B and K take it up"
    )
    if just := [row[0].partition(",")[0] for row in rows if row[5] == "just determined"]:
        caption = f"{caption}. {', '.join(just)}: {JUST}"
    if found.check is not None and (departs := found.check.finding()):
        caption = f"{departs}. {caption}"
    columns = ["coefficient", "value", "95 % from", "95 % to", "unit", "finding"]
    title = "Noise coefficients"
    caption = f"{caption}. {RESIDUAL}" if residual else caption
    return [Table("noise_coefficients", title, caption, columns, rows)]


def on_grid(t: Array, x: Array, step: float) -> Array:
    """Return values in the order of their times, NaN where one is missing.

    A time that does not follow the one before by a step, within a hundredth of it, begins a gap.
    """
    order = np.argsort(t, kind="stable")
    t, x = t[order], x[order]
    follows = np.abs(np.diff(t) - step) < 0.01 * step
    places = np.concatenate([[0], np.cumsum(np.where(follows, 1, 2))])
    out = np.full(int(places[-1]) + 1, math.nan)
    out[places] = x
    return out
