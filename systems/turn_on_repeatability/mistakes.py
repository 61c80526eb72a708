"""Mistakes in a record of turn-ons: rows exchanged, times in another unit, a turn-on that was none."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis.handling_candidates import TIME, changed, exchanged_rows, other_times, scaled
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate

MOST = 20  # turn-ons up to which each is tried


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Readings of two rows exchanged; times, or times since the turn-on, in another unit; a gyro that had stayed on."""
    yield from exchanged_rows(record, ["mean"], "the readings of rows", far=0)
    yield from other_times(record)
    yield from scaled(record, ["since"], {f"{words} (since)": f for words, f in TIME.items()}, 0.0)
    yield from _stayed_on(record)


def _stayed_on(record: Record) -> Iterator[HandlingCandidate]:
    """Yield each turn-on as none: the time since is that since the one before."""
    w = record.windows
    turn, start, since = (np.asarray(w[n], dtype=float) for n in ("turn_on", "t_start", "since"))
    numbers = list(dict.fromkeys(turn.tolist()))
    if len(numbers) == turn.size or len(numbers) > MOST:
        return
    on = {k: float((start - since)[turn == k][0]) for k in numbers}
    for before, k in pairwise(numbers):
        late = on[k] - on[before]
        if late > 0.0:
            words = f"turn-on {k:g} was none (the gyro had stayed on)"
            yield HandlingCandidate(words, changed(record, since=np.where(turn == k, since + late, since)))
