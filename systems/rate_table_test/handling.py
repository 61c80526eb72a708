"""Mistakes in taking a record on a rate table: those that residuals show, those that make a scale factor of no gyro."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from gyrobench.reduction.diagnosis.handling_candidates import changed, exchanged_rows, other_times, shifted
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.diagnosis.scale_mistakes import factor_sentence
from gyrobench.reduction.toolkit import Array, Coefficient, Reason, Record, plain
from gyrobench.units import DEG

from .steps import direction, levels

UNSIGNED = "are its readings of one sense given without their sign?"
Rows = np.ndarray[Any, np.dtype[np.intp]]
LATEST = 1.05  # of a step that a mean holds of another rate; more is no transition
FAR = 0.1  # scale factor error from which on something else than the gyro is meant


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Rates of steps exchanged, of one sense without their sign, of some steps of the opposite sense; readings of the
    row before or after, of one row or of all that begin or end a rate in part; times in another unit.
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
        yield from _transitions(record)
    yield from shifted(record, ["mean"], "the reading")
    yield from exchanged_rows(record, ["mean"], "the readings of rows", far=0)
    yield from other_times(record)


def _reversed_steps(record: Record) -> Iterator[HandlingCandidate]:
    rate, mean = (np.asarray(record.windows[n], dtype=float) for n in ("rate", "mean"))
    wrong = (np.sign(rate) * np.sign(mean) < 0.0) & (np.abs(rate) > 0.05 * np.max(np.abs(rate)))
    if 0 < np.count_nonzero(wrong) < rate.size / 2:
        first = np.flatnonzero(wrong)[0] + 1
        words = f"the sense of the rate reversed in {np.count_nonzero(wrong)} rows (first: row {first})"
        yield HandlingCandidate(words, changed(record, rate=np.where(wrong, -rate, rate)))


def _transitions(record: Record) -> Iterator[HandlingCandidate]:
    """Means that hold a part of the rate before or after, or all of it: of the row and of the rate that the others
    contradict most, which are left out; of all rows that begin a rate, or end one, whose rate becomes the mixture.
    """
    w = record.windows
    rate, mean = (np.asarray(w[n], dtype=float) for n in ("rate", "mean"))
    level, full = levels(rate), float(np.max(np.abs(rate)))
    if level[-1] < 2 or not full > 0.0:
        return
    first = np.searchsorted(level, np.arange(level[-1] + 1))
    each = rate[first]
    step = {
        "before": np.where(level > 0, each[np.maximum(level - 1, 0)], rate) - rate,
        "after": np.where(level < level[-1], each[np.minimum(level + 1, level[-1])], rate) - rate,
    }
    x, d = rate / full, direction(rate)
    X = np.column_stack([np.ones_like(x), x, np.abs(x), x**3, d])
    yield _left_out(record, X, mean, step, [np.array([k]) for k in range(rate.size)])
    several = [rows for k in range(level[-1] + 1) if (rows := np.flatnonzero(level == k)).size > 1]
    if several:
        yield _left_out(record, X, mean, step, several)
    edge = {"before": np.concatenate([[True], np.diff(level) > 0]), "after": np.append(np.diff(level) > 0, True)}
    basis = np.linalg.qr(X)[0]
    for where, at in edge.items():
        held = np.where(at, step[where], 0.0)
        own = held - basis @ (basis.T @ held)
        if not np.linalg.norm(own) > 0.1 * np.linalg.norm(held):  # one reading a rate: it is a hysteresis
            continue
        part = float(own @ mean / (own @ own))
        before = f"a part of {plain(part)} of the rate before in each reading that begins a rate (settle longer)"
        after = f"a part of {plain(part)} of the rate after in each reading that ends a rate (settle longer)"
        if 0.0 < part <= LATEST:
            words = before if where == "before" else after
            yield HandlingCandidate(words, changed(record, rate=rate + part * held))


def _left_out(record: Record, X: Array, mean: Array, step: dict[str, Array], groups: list[Rows]) -> HandlingCandidate:
    """Return the record without the group of rows that is furthest from a fit of the others, by how far it lies towards
    the rate before or after.
    """
    basis, s, _ = np.linalg.svd(X, full_matrices=False)
    basis = basis[:, s > 1e-9 * s[0]]
    left = mean - basis @ (basis.T @ mean)

    def off(rows: Rows) -> Array:
        H = basis[rows]
        out: Array = np.linalg.lstsq(np.eye(rows.size) - H @ H.T, left[rows], rcond=1e-6)[0]
        return out

    rows = max(groups, key=lambda g: float(left[g] @ off(g)))
    far = float(np.mean(off(rows)))
    parts = {where: far / float(d[rows[0]]) for where, d in step.items() if d[rows[0]]}
    found = [f"{plain(p)} of the rate {where}" for where, p in parts.items() if 0.0 < p <= LATEST]
    what = f"held is {' or '.join(found)}" if found else f"off by {plain(far / DEG, 3)} °/s".replace("-", "−")
    first, last = rows[[0, -1]] + 1
    where = f"row {first}" if first == last else f"rows {first} to {last}"
    kept = {n: np.delete(np.asarray(v), rows) for n, v in record.windows.items()}
    return HandlingCandidate(f"{where} left out ({what})", Record(kept, {}, record.run))


def implausible(e: Coefficient, a: Coefficient) -> list[Reason]:
    """Return why a scale factor error beyond 10 % is that of no gyro, with the mistake that makes such a factor.

    a: its asymmetry, which takes abs(w) as it is, so that no residual shows readings without their sign.
    """
    error = e.estimate * 1e-6
    if not math.isfinite(error) or abs(error) < FAR:
        return []
    text = factor_sentence(1.0 + error)
    if abs(1.0 + error) < FAR and abs(a.estimate * 1e-6) > 1.0:
        text = f"The gyro reads {plain(1.0 + error)} times the rate: {UNSIGNED}"
    return [Reason("rate.factor", text, ("pass", "fail"), severity="doubt")]
