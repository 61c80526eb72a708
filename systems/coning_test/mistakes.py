"""Mistakes in a coning test: columns exchanged, senses reversed, full for half angles, units; by what they do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from gyrobench.reduction.diagnosis.handling_candidates import exchanged_columns, exchanged_rows, other_times
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.diagnosis.stated_motion import SEVERITY, first_departure
from gyrobench.reduction.toolkit import Array, Reason, Record, plain

from .closed import AXES, cone_rate

if TYPE_CHECKING:
    from .reduction import Cones, ConingSetup

MORE = 1.3  # of the rate of the cone: more drift than no coning terms at all make
ACROSS = 3.0  # times the drift along the axis of the cone: another axis, where it is a good part of the cone's rate
PART = 0.02


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Columns of two axes exchanged, readings or cones of two rows exchanged, times in another unit."""
    columns = [f"drift_{a}" for a in AXES]
    pairs = [(columns[0], columns[1]), (columns[1], columns[2]), (columns[0], columns[2])]
    for pair in pairs:
        words = f"the drifts along {pair[0][-1]} and {pair[1][-1]} exchanged"
        yield from exchanged_columns(record, [pair], words)
    yield from exchanged_rows(record, columns, "the readings of rows", far=0)
    yield from exchanged_rows(record, ["frequency", "half_angle"], "the cones of rows", far=12)
    yield from other_times(record)


def other_chain(setup: ConingSetup, cones: Cones, windows: Mapping[str, Array]) -> Iterator[Reason]:
    """Yield that the drift along the axis of the cone is not that of the stated chain, by more than gyros explain."""
    own = AXES.index(setup.axis)
    motions = [(cone_rate(f, theta), float(setup.chain.drift(f, theta, own)[own])) for f, theta in cones.cones]
    y = np.asarray(windows[f"drift_{setup.axis}"], dtype=float)
    if (off := first_departure(y, cones.number, motions)) is None:
        return
    k, drift, far = off
    rate, stated = motions[k]
    text = (
        f"At {cones.cones[k][0]:g} Hz the attitude drifts by {plain(drift / rate, 3)} of ω (1 − cos θ), the stated "
        f"filter, output rate and algorithm make {plain(stated / rate, 3)}. Are frequency (Hz, not rad/s), half-angle "
        "(not the full angle) and drift in the units that are given, and interval, bandwidth, coning and samples "
        "those of the unit?"
    )
    blocked, severity = SEVERITY[far]
    yield Reason("coning.stated", text.replace(" -", " −"), blocked, severity=severity)


def implausible(setup: ConingSetup, cones: Cones, windows: Mapping[str, Array]) -> Iterator[Reason]:
    """Yield why nothing may pass or fail: drifts that no gyro and no algorithm make of these cones."""
    blocked = ("pass", "fail")
    means = np.column_stack([np.asarray(windows[f"drift_{a}"], dtype=float) for a in AXES])
    rest = means[cones.number < 0]
    noise = 4.0 * float(np.max(np.std(rest, axis=0, ddof=1)))
    own = AXES.index(setup.axis)
    for k, (f, theta) in enumerate(cones.cones):
        rate = cone_rate(f, theta)
        drift = means[cones.number == k].mean(axis=0) - rest.mean(axis=0)
        stated = float(setup.chain.drift(f, theta, own)[own]) / rate
        if abs(drift[own]) > MORE * abs(rate) + noise:
            text = (
                f"At {f:g} Hz the attitude drifts by {plain(drift[own] / rate, 3)} of ω (1 − cos θ), more than without "
                "any coning terms. Are frequency (Hz, not rad/s or per minute), half-angle (not the full angle) and "
                "drift in the units that are given?"
            )
        elif drift[own] / rate > PART and abs(drift[own]) > 2.0 * noise:
            if stated > -PART:
                continue
            text = (
                f"At {f:g} Hz the attitude drifts with the cone, by {plain(drift[own] / rate, 3)} of ω (1 − cos θ); "
                "coning that is not computed makes it drift against it. Is the sense of the cones, or of the drift, "
                "reversed?"
            )
        elif np.max(np.abs(np.delete(drift, own))) > max(
            ACROSS * abs(drift[own]), PART * abs(rate), 2.0 * noise
        ):  # fmt: skip
            most = AXES[int(np.argmax(np.abs(drift)))]
            text = (
                f"At {f:g} Hz the attitude drifts about {most}, not about {setup.axis}, the axis of the cone. Are the "
                "columns of the axes exchanged, or is the axis another one?"
            )
        else:
            continue
        yield Reason("coning.implausible", text.replace(" -", " −"), blocked, severity="doubt")
        return
