"""Mistakes in a sculling test: rows exchanged, signs, units; by what they do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gyrobench.frames import G0
from gyrobench.reduction.diagnosis.handling_candidates import exchanged_rows, other_times
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.diagnosis.stated_motion import SEVERITY, first_departure
from gyrobench.reduction.toolkit import Array, Reason, Record, plain

from .closed import reading

if TYPE_CHECKING:
    from .reduction import Motions, ScullingSetup

MORE = 1.3  # of the reading: more than with nothing taken back at all
PART = 0.02  # of the reading: the other sign
REST = 0.5  # m/s2 at rest: gravity is still there


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Readings or motions of two rows exchanged, times in another unit."""
    yield from exchanged_rows(record, ["acceleration"], "the readings of rows", far=0)
    yield from exchanged_rows(record, ["frequency", "angle", "vibration"], "the motions of rows", far=12)
    yield from other_times(record)


def other_chain(setup: ScullingSetup, motions: Motions, windows: Mapping[str, Array]) -> Iterator[Reason]:
    """Yield that the acceleration is not that of the stated chain, by more than the instruments explain."""
    expected = [(reading(m, setup.chain.gravity), setup.chain.rise(m)) for m in motions.motions]
    off = first_departure(np.asarray(windows["acceleration"], dtype=float), motions.number, expected)
    if off is None:
        return
    k, found, far = off
    read, stated = expected[k]
    text = (
        f"At {motions.motions[k].frequency:g} Hz the computed acceleration is {plain(found / read, 3)} of the reading, "
        f"the stated filters and algorithm make {plain(stated / read, 3)}. Are frequency (Hz, not rad/s), angle, "
        "vibration (amplitudes) and acceleration in the units that are given, and interval, filters, sculling, "
        "samples and size those of the unit?"
    )
    blocked, severity = SEVERITY[far]
    yield Reason("sculling.stated", text.replace(" -", " −"), blocked, severity=severity)


def implausible(setup: ScullingSetup, motions: Motions, windows: Mapping[str, Array]) -> Iterator[Reason]:
    """Yield why nothing may pass or fail: accelerations that no unit and no algorithm make of these motions."""
    blocked = ("pass", "fail")
    y = np.asarray(windows["acceleration"], dtype=float)
    rest = y[motions.number < 0]
    noise = 4.0 * float(np.std(rest, ddof=1))
    if abs(rest.mean()) > REST:
        text = (
            f"At rest the computed acceleration is {plain(rest.mean() / G0, 3)} g. Is gravity taken off, and the unit "
            "of the column the one that is given?"
        )
        yield Reason("sculling.implausible", text.replace(" -", " −"), blocked, severity="doubt")
        return
    for k, m in enumerate(motions.motions):
        read, stated = reading(m, setup.chain.gravity), setup.chain.rise(m)
        found = float(y[motions.number == k].mean() - rest.mean())
        if abs(found) > MORE * max(abs(read), abs(stated)) + noise:
            text = (
                f"At {m.frequency:g} Hz the computed acceleration is {plain(found / read, 3)} of what the "
                "accelerometer along the vertical reads of the motion, more than with nothing of it taken back. Are "
                "frequency (Hz), amplitudes (not peak to peak) and acceleration in the units that are given, and the "
                "lever arm (size)?"
            )
        elif abs(found) > PART * abs(read) + noise and found * stated < 0.0 and abs(stated) > PART * abs(read):
            text = (
                f"At {m.frequency:g} Hz the computed acceleration is {plain(found / read, 3)} of the reading, the "
                f"stated filters and algorithm make {plain(stated / read, 3)}. Is the vibration in antiphase "
                "(negative), or the acceleration positive downwards?"
            )
        else:
            continue
        yield Reason("sculling.implausible", text.replace(" -", " −"), blocked, severity="doubt")
        return
