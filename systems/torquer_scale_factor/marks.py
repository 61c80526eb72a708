"""From the record of a servo run to one row for each current: both senses timed over the same angle marks.

The table angle at the ends of the windows is a curve over time; the marks are the ends of the range that both senses
cover, and the times at which the table passes them are interpolated between neighbouring readings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.record.run_document import PlanRow
from gyrobench.reduction.toolkit import Array, ReductionError, plain, window_problems

SHARED = 0.5  # of the range turned, least part that both senses must cover


def rows(windows: Mapping[str, Array], plan: Sequence[PlanRow]) -> dict[str, Array]:
    """Return current (A), rate_plus, rate_minus (rad/s, magnitudes), range_plus, range_minus (rad), by rising current.

    plan: rows of run.json; the target of a servo phase is its current.  Raises ReductionError for flagged windows, a
    current with one sense only, and senses that do not share their angles.
    """
    if unusable := window_problems(windows):
        raise ReductionError(unusable)
    phase = np.asarray(windows["phase"]).astype(int)
    pairs = _pairs(plan)
    problems: list[str] = []
    found: list[tuple[float, ...]] = []
    for size in sorted(pairs):
        missing = [s for s in (1, -1) if s not in pairs[size] or not np.any(phase == pairs[size][s])]
        if missing:
            sense = " and ".join("positive" if s > 0 else "negative" for s in missing)
            problems.append(f"{size * 1e3:g} mA: no record of the {sense} current; both senses are needed")
            continue
        curves = {s: _curve(windows, phase == pairs[size][s]) for s in (1, -1)}
        low = max(float(a.min()) for _, a, _ in curves.values())
        high = min(float(a.max()) for _, a, _ in curves.values())
        least = min(float(np.ptp(a)) for _, a, _ in curves.values())
        if not high - low > SHARED * least or any(np.any(s * np.diff(a) <= 0.0) for s, (_, a, _) in curves.items()):
            problems.append(
                f"{size * 1e3:g} mA: the two senses do not turn the table back over the same angles (shared "
                f"{plain(math.degrees(high - low), 3)}°): drift larger than the precession, crossed wires or lost lock"
            )
            continue
        rate = {s: _rate(t, s * a, s * low, s * high) for s, (t, a, _) in curves.items()}
        current = float(np.mean([abs(i) for _, _, i in curves.values()]))
        found.append((current, rate[1], rate[-1], high - low, high - low))
    if problems:
        raise ReductionError(problems)
    names = ("current", "rate_plus", "rate_minus", "range_plus", "range_minus")
    return dict(zip(names, np.array(found, dtype=float).reshape(-1, 5).T, strict=True))


def _pairs(plan: Sequence[PlanRow]) -> dict[float, dict[int, int]]:
    """Return the magnitude of a current -> sense -> phase."""
    pairs: dict[float, dict[int, int]] = {}
    for row in plan:
        if row.mode == "servo" and row.target:
            pairs.setdefault(abs(row.target), {})[int(math.copysign(1, row.target))] = row.phase
    return pairs


def senses(plan: Sequence[PlanRow]) -> dict[int, int]:
    """Return phase -> number of its current, by rising current."""
    pairs = _pairs(plan)
    return {phase: k for k, size in enumerate(sorted(pairs)) for phase in pairs[size].values()}


def _curve(windows: Mapping[str, Array], mine: NDArray[np.bool_]) -> tuple[Array, Array, float]:
    """Return the times and angles at the ends of the windows, mean current."""
    t0, t1, a0, a1, i = (
        np.asarray(windows[c], dtype=float)[mine] for c in ("t_start", "t_end", "angle_start", "angle_end", "mean")
    )
    return np.append(t0[:1], t1), np.append(a0[:1], a1), float(np.average(i, weights=t1 - t0))


def _rate(t: Array, rising: Array, low: float, high: float) -> float:
    first, last = np.interp([min(low, high), max(low, high)], rising, t)
    return abs(high - low) / float(last - first)
