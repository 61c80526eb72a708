"""What the record itself says of its figures: their temperature, what was left out, what was not stated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.settling import unsettled
from gyrobench.result import Coefficient, Reason, Result

R = TypeVar("R", bound=Result)
#: what the columns of readings begin with
READINGS = ("mean", "drift_", "acceleration", "force")
SHAKEN = ("rate", "level")  # the rate that a gyro reads where a shaker has a level; else that of a table
LEAST, MOST = 3, 3000  # rows of a block that was copied, of a record in which one is looked for
CHANCE = 5.0  # decades by which rows that are equal are no chance
TYPE_B_UNSTATED = "type_b.unstated"
#: estimates that belong to the mean temperature of the record -> their change per kelvin in the gyro, and its sign
WARMED = {
    "D_F": ("D_T", 1.0),
    "ω_d": ("D_T", 1.0),
    "Dx_0": ("Dx_T", 1.0),
    "Dy_0": ("Dy_T", 1.0),
    "R_x": ("Dy_T", 1.0),
    "R_y": ("Dx_T", -1.0),
}


def readings(windows: Mapping[str, Array]) -> list[str]:
    """Return the columns of a record that an instrument has read."""
    rate, level = SHAKEN
    return [n for n in windows if n.startswith(READINGS) or (n == rate and level in windows)]


def applied(result: R, record: Record) -> R:
    """Return the result at the mean temperature of its record: constant drift belongs to it, and so does its truth.

    The temperatures in a record are weighed as deviations from their mean (gyrobench.reduction.estimation.nuisances).
    """
    read = [np.asarray(v, dtype=float) for n, v in record.windows.items() if n.startswith("temperature")]
    if not read:
        return result
    mean, parameters = float(np.mean(read)), record.run.parameters
    simulated = any(name.startswith("surroundings.") for name in parameters)
    shown = f"{plain(mean, 3)} K above that of the gyro's coefficients" if simulated else f"{mean - 273.15:.2f} °C"
    sentence = f"Constant drift belongs to the mean temperature of the record, {shown}."
    coefficients = [_warmed(c, parameters, mean) if simulated else c for c in result.coefficients]
    return replace(result, conventions=[*result.conventions, sentence], coefficients=coefficients)


def _warmed(c: Coefficient, parameters: Mapping[str, Any], mean: float) -> Coefficient:
    """Return a coefficient with its simulated truth at a temperature ``mean``, K."""
    name, sign = WARMED.get(c.name, ("", 0.0))
    per_kelvin = float(parameters.get(f"gyro.{name}", 0.0)) * sign
    truth = c.truth
    if truth is not None and per_kelvin:
        truth += per_kelvin * mean / units.factor(c.unit)
    elif c.name == "temperature" and "gyro.D_T" in parameters:
        truth = float(parameters["gyro.D_T"]) / units.factor(c.unit)
    else:
        return c
    return replace(c, truth=truth, z=(c.estimate - truth) / c.u if c.u > 0.0 else None)


def reasons(record: Record) -> list[Reason]:
    """Return what a reader must know of the record: a plan that was not finished, rows left out, type B not stated.

    Measured data without a statement of type B pass nothing: u is of type A alone.
    """
    run = record.run
    found = [Reason("part.external", text) for text in run.external]
    if run.measured:
        found += [Reason("record.note", text) for text in run.notes]
        found += [Reason("record.samples", text, ("pass", "fail"), severity="doubt") for text in run.doubts]
        found += identical_phases(record) or identical_rows(record) or unsettled(record, readings(record.windows))
        found += at_the_end(record)
    if run.measured and not run.type_b_stated:
        text = (
            "Type B is not stated, u is of type A only: give the uncertainties u_... that apply, or declare "
            "type_b = none."
        )
        found.append(Reason(TYPE_B_UNSTATED, text, blocks=("pass",), severity="doubt"))
    if not run.complete:
        text = f"The run stopped at {plain(run.stopped_at or 0.0, 6)} s, before the end of its plan."
        found.append(Reason("record.incomplete", text, blocks=("pass", "fail"), severity="error"))
    return found


def identical_phases(record: Record) -> list[Reason]:
    """Return which phases hold the same numbers, bit for bit: data of one that were copied into another.

    Of the readings (columns mean...), and of the angles that a held table turns by.  n rows are equal by chance in 1 of
    D^n, D of two readings of the phase; a counter at rest, with D = 2, needs 17 rows.  Where no two readings of the
    other phases are alike, none is a counter's.
    """
    w = record.windows
    if "phase" not in w:
        return []
    phase = np.asarray(w["phase"]).astype(int)
    data = {n: np.asarray(v, dtype=float) for n, v in w.items() if n.startswith("mean")}
    servo = [row.phase for row in record.run.plan if row.mode == "servo"]
    if not data and servo:
        data = {a: np.asarray(w[f"{a}_end"]) - np.asarray(w[f"{a}_start"])
                for a in ("angle", "outer", "inner") if f"{a}_start" in w}  # fmt: skip
    seen: dict[tuple[str, bytes], int] = {}
    same: list[str] = []
    for p in dict.fromkeys(phase.tolist()):
        for name, values in data.items():
            own = values[phase == p]
            if own.size * math.log10(max(_rarity(own), _rarity(values[phase != p], 0))) < CHANCE:
                continue
            first = seen.setdefault((name, own.tobytes()), p)
            if first != p and f"{first} and {p}" not in same:
                same.append(f"{first} and {p}")
    if not same:
        return []
    text = (
        f"Phases {', '.join(same)} hold the same readings, bit for bit: the data of one were copied into the other. "
        "The coefficients are wrong until the record is corrected."
    )
    return [Reason("record.identical_phases", text, blocks=("pass", "fail"), severity="error")]


def identical_rows(record: Record) -> list[Reason]:
    """Return which rows hold the readings of others before them, bit for bit, where these are all different.

    A block of n rows that are all different is found again by chance at one of N^2 places with 1 in D^n; D as of
    :func:`identical_phases`.
    """
    for name in readings(record.windows):
        y = np.asarray(record.windows[name], dtype=float)
        length, first, second = _longest_copy(y) if LEAST <= y.size <= MOST else (0, 0, 0)
        own = y[second : second + length]
        if length < LEAST or np.unique(own).size < length:
            continue
        rest = np.concatenate([y[:second], y[second + length :]])
        if length * math.log10(max(_rarity(own), _rarity(rest, 0))) < CHANCE + 2.0 * math.log10(y.size):
            continue
        text = (
            f"Rows {second + 1} to {second + length} hold the readings of rows {first + 1} to {first + length} again, "
            "bit for bit: the data of one were copied over the other. The coefficients are wrong until the record is "
            "corrected."
        )
        return [Reason("record.identical_rows", text, blocks=("pass", "fail"), severity="error")]
    return []


def at_the_end(record: Record) -> list[Reason]:
    """Return which readings are the largest or the smallest of their column, alike to the last digit, where hardly two
    others are: a range was reached, and nothing beyond it read.  A channel that was not read says so elsewhere.
    """
    found = []
    for name in readings(record.windows):
        y = np.asarray(record.windows[name], dtype=float)
        for end, word in ((np.max(y), "largest"), (np.min(y), "smallest")):
            here = y == end
            n, rest = int(np.count_nonzero(here)), y[~here]
            if n < LEAST or n > y.size // 2 or n * math.log10(max(_rarity(rest, 0), 1.0)) < CHANCE:
                continue
            first = int(np.argmax(here)) + 1
            text = (
                f"{n} readings of {name}, the first in row {first}, are its {word} value to the last digit, and no two "
                "others are alike: a range was reached. What was beyond it is not in the estimates."
            )
            found.append(Reason("record.range", text, blocks=("pass", "fail"), severity="doubt"))
    return found


def _longest_copy(y: Array) -> tuple[int, int, int]:
    """Return length and first rows of the longest block that is found again, without overlap, further below."""
    best = (0, 0, 0)
    for lag in range(1, y.size):
        same = np.concatenate([[False], y[:-lag] == y[lag:], [False]])
        edges = np.flatnonzero(same[1:] != same[:-1])
        lengths = np.minimum(edges[1::2] - edges[0::2], lag)
        if lengths.size and int(lengths.max()) > best[0]:
            k = int(np.argmax(lengths))
            best = (int(lengths[k]), int(edges[2 * k]), int(edges[2 * k]) + lag)
    return best


def _rarity(values: Array, most: int | None = None) -> float:
    """Return in how many pairs of values one is equal, at least; 1 where more than ``most`` are."""
    n, counts = values.size, np.unique(values, return_counts=True)[1]
    equal = float(np.sum(counts * (counts - 1.0))) / 2.0
    if n < 2 or (most is not None and equal > most):
        return 1.0
    return n * (n - 1) / 2.0 / max(equal, 1.0)
