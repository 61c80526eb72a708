"""Mistakes in taking a record on a rate table: those that residuals show, those that make a scale factor of no gyro."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis.handling_candidates import TIME, TIMES, changed, exchanged_rows, shifted
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.diagnosis.scale_mistakes import factor_sentence
from gyrobench.result import Coefficient, Reason

UNSIGNED = "are its readings of one sense given without their sign?"
FAR = 0.1  # scale factor error from which on something else than the gyro is meant


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Rates of steps exchanged, of one sense without their sign, of some steps of the opposite sense; readings of the
    row before or after; times in another unit.
    """
    w = record.windows
    if "rate" in w:
        yield from exchanged_rows(record, ["rate"], "the rates of steps", far=12)
        if np.all(np.asarray(w["rate"]) >= 0.0):
            signed = np.abs(w["rate"]) * np.where(np.asarray(w["mean"]) < 0.0, -1.0, 1.0)
            yield HandlingCandidate(
                "the rates of the negative sense given without their sign", changed(record, rate=signed)
            )
        yield from _reversed_steps(record)
    yield from shifted(record, ["mean"], "the reading")
    yield from exchanged_rows(record, ["mean"], "the readings of rows", far=0)
    for words, f in TIME.items():
        yield HandlingCandidate(words, changed(record, **{n: w[n] * f for n in TIMES}))


def _reversed_steps(record: Record) -> Iterator[HandlingCandidate]:
    rate, mean = (np.asarray(record.windows[n], dtype=float) for n in ("rate", "mean"))
    wrong = (np.sign(rate) * np.sign(mean) < 0.0) & (np.abs(rate) > 0.05 * np.max(np.abs(rate)))
    if 0 < np.count_nonzero(wrong) < rate.size / 2:
        first = np.flatnonzero(wrong)[0] + 1
        words = f"the sense of the rate reversed in {np.count_nonzero(wrong)} rows (first: row {first})"
        yield HandlingCandidate(words, changed(record, rate=np.where(wrong, -rate, rate)))


def implausible(e: Coefficient, a: Coefficient) -> list[Reason]:
    """Return why a scale factor error beyond 10 % is that of no gyro, with the mistake that makes such a factor.

    a: its asymmetry, which takes abs(w) as it is, so that no residual shows readings without their sign.
    """
    error = e.estimate * 1e-6
    if not math.isfinite(error) or abs(error) < FAR:
        return []
    text = factor_sentence(1.0 + error)
    if abs(1.0 + error) < FAR and abs(a.estimate * 1e-6) > 1.0:
        text = f"The gyro reads {1.0 + error:.2g} times the rate: {UNSIGNED}"
    return [Reason("rate.factor", text, ("pass", "fail"), severity="doubt")]
