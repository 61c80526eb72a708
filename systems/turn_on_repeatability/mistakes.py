"""Mistakes in a record of turn-ons: rows exchanged, times in another unit."""

from __future__ import annotations

from collections.abc import Iterator

from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis.handling_candidates import TIME, TIMES, changed, exchanged_rows
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Readings of two rows exchanged; times, or times since the turn-on, in another unit."""
    if not record.run.measured:
        return
    w = record.windows
    yield from exchanged_rows(record, ["mean"], "the readings of rows", far=0)
    for words, f in TIME.items():
        yield HandlingCandidate(words, changed(record, **{n: w[n] * f for n in TIMES}))
        yield HandlingCandidate(f"{words} (since)", changed(record, since=w["since"] * f))
