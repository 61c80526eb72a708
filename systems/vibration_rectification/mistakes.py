"""Mistakes in a vibration test: positions reversed, units, rows exchanged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import special

from gyrobench.reduction.diagnosis.handling_candidates import changed, exchanged_rows, other_times
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.diagnosis.scale_mistakes import FORCES, factor_sentence
from gyrobench.reduction.toolkit import Array, Coefficient, Findings, Reason, Record, plain

NOTHING = 0.1  # of gravity, up less down: not that axis, or not turned over; a unit of a thousandth is below it, too
CHANGED, DRIFTS = 1e-6, 0.05  # probabilities by chance: constants of the positions, slopes within them
FREE = 6  # least degrees of freedom for both
FAR = 1e5  # ppm, scale factor error from which on something else than the accelerometer is meant


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Levels or readings of two rows exchanged, up and down reversed, times in another unit."""
    w = record.windows
    yield from exchanged_rows(record, ["level"], "the levels of rows", far=12)
    yield from exchanged_rows(record, [n for n in ("rate", "force") if n in w], "the readings of rows", far=0)
    if np.unique(w["up"]).size == 2:
        yield from exchanged_rows(record, ["up"], "the positions of rows", far=12)
        yield HandlingCandidate("up and down exchanged", changed(record, up=-np.asarray(w["up"])))
    yield from other_times(record)


def same_both_ways(found: Sequence[Coefficient], vertical: float) -> Iterator[Reason]:
    """Yield that a gyro reads the same up and down where the vertical Earth rate alone, deg/h, would show."""
    for c in found:
        if c.name == "G" and abs(c.estimate + vertical) < 3.0 * c.u < 0.05 * abs(vertical):
            text = (
                f"The gyro reads the same up and down, where the vertical Earth rate is {plain(abs(vertical), 4)} °/h: "
                "was it not turned over, or does another axis stand up?"
            )
            yield Reason("gyro.same", text, ("pass", "fail"), severity="doubt")


def jumped(found: Findings, up: Array) -> list[Reason]:
    """Return that the bias changed when the axis was turned over: equal positions differ, and none of them drifts.

    Of slow noise, which such a record passes for, the readings within a position would show as much.
    """
    turns = np.flatnonzero(np.diff(up)) + 1
    if turns.size < 2 or found.ideal:
        return []
    place = np.searchsorted(turns, np.arange(up.size), side="right")
    each = np.eye(turns.size + 1)[place]
    since = found.t_start - (each @ (each.T @ found.t_start / each.sum(axis=0)))
    designs = [found.X, np.hstack([found.X, each]), np.hstack([found.X, each, each * since[:, None]])]
    fits = [np.linalg.lstsq(X / np.linalg.norm(X, axis=0), found.y, rcond=None) for X in designs]
    squares, ranks = [float(np.sum((found.y - X / np.linalg.norm(X, axis=0) @ b) ** 2)) for X, (b, *_) in
                      zip(designs, fits, strict=True)], [int(f[2]) for f in fits]  # fmt: skip

    def p(k: int) -> float:
        more, free = ranks[k + 1] - ranks[k], up.size - ranks[k + 1]
        return float(special.fdtrc(more, free, (squares[k] - squares[k + 1]) / more / (squares[k + 1] / free)))

    if up.size - ranks[2] < FREE or p(0) > CHANGED or p(1) < DRIFTS:
        return []
    left = found.y - found.X @ np.linalg.lstsq(found.X, found.y, rcond=None)[0]
    means = each.T @ left / each.sum(axis=0)
    text = (
        f"Equal positions differ by {plain(np.ptp(means) / found.y_scale, 3)} {found.y_unit}, and within none of them "
        "the readings drift: the bias changed when the axis was turned over (it is touched, heated, switched). Which "
        "time it was no residual shows: the bias and what goes with gravity may be off by half of that. Take the "
        "positions again."
    )
    return [Reason("turned.jump", text, ("pass", "fail"), severity="doubt")]


def heated(found: Findings, channel: str) -> list[Reason]:
    """Return that a temperature goes by the level, or the way, so that no fit separates what it does."""
    for h in found.hidden:
        if h.candidate.name.startswith("temperature") and h.aliases:
            text = (
                f"The temperature goes by the levels and ways alone ({h.reason}): what it does to the {channel} is in "
                "these coefficients. Take levels again at another temperature, or wait until it is the same at all."
            )
            return [Reason("temperature.aliased", text, ("pass", "fail"), severity="doubt")]
    return []


def implausible(found: Sequence[Coefficient]) -> Iterator[Reason]:
    """Yield why a scale factor error beyond 10 % is that of no accelerometer."""
    for c in found:
        if c.name == "S" and abs(c.estimate) > FAR:
            factor = 1.0 + c.estimate * 1e-6
            text = factor_sentence(factor, FORCES)
            if abs(factor) < NOTHING:
                text = (
                    f"The accelerometer reads {plain(factor)} times gravity, up less down: was it not turned over, or "
                    "does another axis stand up?"
                ).replace("-", "−")
            yield Reason("force.factor", text, ("pass", "fail"), severity="doubt")
