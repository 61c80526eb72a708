"""The live estimate of the drift over the angle, and the hours that it would have saved.  [EST-KF-COEFF]"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.attitudes import POLAR
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult, Table
from gyrobench.system.system import OnRequest, Slot
from gyrobench.units import DPH

SLOT = "coefficients"
LEFT = "Live estimate: coefficients, had the test been left then"
NAMES = ("A0", "A1", "B1", "A2", "B2")  # mean, cos, sin, cos 2, sin 2
VALUES, DEVIATIONS = ([f"live_{kind}_{n}" for n in NAMES] for kind in ("value", "sd"))
MAY_STOP, NIS, CONSISTENT = "live_may_stop", "live_mean_nis", "live_consistent"

#: the slot, what it takes of the windows, and what the record keeps of it
ON_REQUEST = OnRequest(
    {SLOT: Slot("CoefficientEstimator", "estimator_coefficients")},
    f"""
    sampler -> {SLOT}: count window_phase angle_start angle_end t_start t_end
    stand.omega[1] -> {SLOT}.omega_E
    """,
    {
        **{column: f"{SLOT}.A[{k}]" for k, column in enumerate(VALUES, 1)},
        **{column: f"{SLOT}.sd[{k}]" for k, column in enumerate(DEVIATIONS, 1)},
        MAY_STOP: f"{SLOT}.may_stop",
        NIS: f"{SLOT}.mean_nis",
        CONSISTENT: f"{SLOT}.consistent",
    },
)


def tables(windows: Mapping[str, Array], labels: Mapping[int, str], wanted: Sequence[float]) -> list[Table]:
    """Return the tables of the live estimate; none for a record without it.

    windows: columns of the record.  labels: phase -> attitude.  wanted: standard deviations, rad/s; 0: not stated.
    """
    if MAY_STOP not in windows:
        return []
    stops, values = [], []
    for p, label in labels.items():
        rows = np.flatnonzero(np.asarray(windows["phase"]) == p)
        if label not in POLAR or rows.size == 0:
            continue
        end, stop = rows[-1], stopped(windows, rows)
        begun = float(windows["t_start"][rows[0]])
        whole = (float(windows["t_end"][end]) - begun) / 3600.0
        until = None if stop is None else (float(windows["t_end"][stop]) - begun) / 3600.0
        known = "yes" if windows[CONSISTENT][end] > 0.5 else "no"
        saved = None if until is None else whole - until
        stops.append([label, rows.size, whole, until, saved, float(windows[NIS][end]), known])
        for name, column, deviation in zip(NAMES, VALUES, DEVIATIONS, strict=True):
            then, last = (
                [None, None] if k is None else [float(windows[c][k]) / DPH for c in (column, deviation)]
                for k in (stop, end)
            )
            values.append([label, name, *then, *last])
    sizes = ", ".join(dict.fromkeys(plain(x / DPH, 3) for x in wanted if x > 0.0)) or "none stated"
    asked = (
        f"Standard deviation wanted of mean and harmonics: {sizes} °/h. Type A only, for the noise that the estimator "
        "is told; NIS is 1 on average where that is right."
    )
    over = (
        "Drift rate = A0 + A1 cos θ + B1 sin θ + A2 cos 2θ + B2 sin 2θ; when the wanted u was reached, and at the end "
        "(generalized least squares over all windows)"
    )
    head = ["mount", "windows", "plan / h", "reached after / h", "saved / h", "mean NIS", "consistent"]
    terms = ["mount", "term", "then / (°/h)", "u then / (°/h)", "end / (°/h)", "u end / (°/h)"]
    return [
        Table("live.time", "Live estimate: time to the wanted uncertainty", asked, head, stops),
        Table("live.drift", "Live estimate: drift over the angle", over, terms, values),
    ]


def had_it_stopped(record: Record, result: DriftTestResult, reduce: Callable[[Record], DriftTestResult]) -> list[Table]:
    """Return the coefficients of the test beside those of the same record with each mount left when it might have been.

    [] for a record without the live estimate, or where no mount could have been left.
    """
    windows, labels = record.windows, {row.phase: row.label for row in record.run.plan if row.mode == "servo"}
    if MAY_STOP not in windows:
        return []
    keep = np.ones(len(windows["phase"]), dtype=bool)
    for p, label in labels.items():
        rows = np.flatnonzero(np.asarray(windows["phase"]) == p)
        stop = stopped(windows, rows) if label in POLAR else None
        if stop is not None:
            keep[rows[rows > stop]] = False
    if keep.all():
        return []
    shorter = Record({n: np.asarray(x)[keep] for n, x in windows.items()}, {}, record.run)
    try:
        then = {c.name: c for c in reduce(shorter).coefficients}
    except ReductionError as error:
        why = "; ".join(error.problems)
        return [Table("live.left", LEFT, "Not estimable from these windows", ["reason"], [[why]])]
    both = [
        [c.name, c.unit, c.estimate, c.u, then[c.name].estimate, then[c.name].u]
        for c in result.coefficients
        if c.name in then
    ]
    caption = (
        "Reduction of this report over all windows, and over those until each mount could have been left; here the "
        "noise is estimated from the windows used, there it is told"
    )
    head = ["coefficient", "unit", "whole plan", "u", "left then", "u then"]
    return [Table("live.left", LEFT, caption, head, both)]


def stopped(windows: Mapping[str, Array], rows: NDArray[np.int_]) -> int | None:
    """Return the row of the first window after which the mount could have been left; None where there is none."""
    ready = rows[np.asarray(windows[MAY_STOP])[rows] > 0.5]
    return int(ready[0]) if ready.size else None


def sentence(tables: Sequence[Table]) -> list[str]:
    """Return what the summary says of it: hours saved of those planned, or that the uncertainty was not reached."""
    if not tables:
        return []
    rows = tables[0].rows
    late = [row[0] for row in rows if row[4] is None]
    saved, planned = sum(row[4] or 0.0 for row in rows), sum(row[2] for row in rows)
    words = f"The live estimate would have saved {saved:.1f} h of {planned:.1f} h"
    return [f"{words}; the wanted uncertainty was not reached in {', '.join(late)}." if late else f"{words}."]
