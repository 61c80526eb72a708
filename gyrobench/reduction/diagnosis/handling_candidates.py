"""Mistakes in taking or labelling a record, each undone: what gyrobench.reduction.diagnosis.handling_errors tries.

    def candidates(record):
        yield from exchanged_labels(record)
        yield from reversed_columns(record, ANGLES, "rotation")
        yield from scaled(record, ("mean",), CURRENT)

Each function returns records that are copies in what it changes.  A mistake and its undoing are the same, but for
factors, which are those of the undoing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate, with_options
from gyrobench.reduction.setup.run_metadata import reads_rate

ANGLES = ("angle_start", "angle_end")
TIMES = ("t_start", "t_end")
MOST_SCALED = 4  # attitudes up to which each may be in a unit of its own
MOST_PHASES = 16  # up to which they are exchanged by pairs
DEGREE = math.pi / 180.0
#: words of the mistake -> factor that undoes it
CURRENT = {
    "the current too small by 1000 (mA given as A, µA as mA)": 1e3,
    "the current too large by 1000 (A given as mA, mA as µA)": 1e-3,
    "the current half as large as it was": 2.0,
    "the current twice as large as it was": 0.5,
}
ANGLE = {
    "the angles in rad, not in degrees": 1.0 / DEGREE,
    "the angles in degrees, not in rad": DEGREE,
    "the angles too small by 60 (° given as ′, ′ as ″)": 60.0,
    "the angles too large by 60 (′ given as °, ″ as ′)": 1.0 / 60.0,
    "the angles too small by 3600 (° given as ″)": 3600.0,
    "the angles too large by 3600 (″ given as °)": 1.0 / 3600.0,
    "the angles half as large as they were": 2.0,
    "the angles twice as large as they were": 0.5,
}
TIME = {
    "the times too short by 60 (min given as s, h as min)": 60.0,
    "the times too long by 60 (s given as min, min as h)": 1.0 / 60.0,
    "the times too short by 3600 (h given as s)": 3600.0,
    "the times too long by 3600 (s given as h)": 1.0 / 3600.0,
    "the times half as long as they were": 2.0,
    "the times twice as long as they were": 0.5,
}


def changed(record: Record, **columns: NDArray[np.generic]) -> Record:
    """Return the record with other columns of its windows."""
    return Record({**record.windows, **columns}, {}, record.run)


def attitude_name(row: PlanRow) -> str:
    """Return what names the attitude of a phase: the face, in a servo phase the label."""
    return row.label if row.mode == "servo" else row.face


def _renamed(row: PlanRow, name: str) -> PlanRow:
    if not name:
        return row
    old = attitude_name(row)
    return row.model_copy(update={n: getattr(row, n).replace(old, name) for n in ("label", "face")})


def exchanged_labels(record: Record) -> Iterator[HandlingCandidate]:
    """Two attitudes of the plan exchanged, each pair of those with the same mode; where attitudes come back, two
    phases, too.
    """
    modes = {attitude_name(row): row.mode for row in record.run.plan if attitude_name(row)}
    for a, b in combinations(sorted(modes), 2):
        if modes[a] == modes[b]:
            names = {row.phase: {a: b, b: a}.get(attitude_name(row), "") for row in record.run.plan}
            yield HandlingCandidate(f"{a} and {b} exchanged", relabelled(record, names))
    rows = [row for row in record.run.plan if attitude_name(row)]
    if not len(modes) < len(rows) <= MOST_PHASES:
        return
    for x, y in combinations(rows, 2):
        a, b = attitude_name(x), attitude_name(y)
        if a != b and x.mode == y.mode:
            words = f"phases {x.phase} and {y.phase} ({a}, {b}) exchanged"
            yield HandlingCandidate(words, relabelled(record, {x.phase: b, y.phase: a}))


def relabelled(record: Record, names: Mapping[int, str]) -> Record:
    """Return the record with other attitudes of some phases; "": as it is."""
    plan = [_renamed(row, names.get(row.phase, "")) for row in record.run.plan]
    return Record(record.windows, {}, record.run.model_copy(update={"plan": plan}))


def exchanged_columns(record: Record, pairs: Sequence[tuple[str, str]], words: str) -> Iterator[HandlingCandidate]:
    """Columns exchanged, all pairs at once."""
    w = record.windows
    if all(n in w for pair in pairs for n in pair):
        columns = {**{a: w[b] for a, b in pairs}, **{b: w[a] for a, b in pairs}}
        yield HandlingCandidate(words, changed(record, **columns))


def reversed_columns(
    record: Record, columns: Sequence[str], words: str, phases: bool = True
) -> Iterator[HandlingCandidate]:
    """Columns of the opposite sign, throughout and (phases) in each attitude alone; where attitudes come back, in each
    phase, too.
    """
    w = record.windows

    def reversed_in(rows: NDArray[np.bool_]) -> Record:
        return changed(record, **{n: np.where(rows, -w[n], w[n]) for n in columns})

    yield HandlingCandidate(f"{words} reversed", changed(record, **{n: -w[n] for n in columns}))
    if not phases:
        return
    phase = np.asarray(w["phase"]).astype(int)
    places: dict[str, list[int]] = {}
    for row in record.run.plan:
        if attitude_name(row) and row.phase in phase:
            places.setdefault(attitude_name(row), []).append(row.phase)
    for name, numbers in places.items() if len(places) > 1 else ():
        yield HandlingCandidate(f"{words} reversed in {name}", reversed_in(np.isin(phase, numbers)))
    single = [(p, name) for name, numbers in places.items() for p in numbers if len(numbers) > 1]
    for p, name in single if len(single) <= MOST_PHASES else ():
        yield HandlingCandidate(f"{words} reversed in phase {p} ({name})", reversed_in(phase == p))


def scaled(
    record: Record, columns: Sequence[str], factors: Mapping[str, float], power: float = 1.0
) -> Iterator[HandlingCandidate]:
    """Columns in another unit.  power: of the factor in the data."""
    for words, f in factors.items():
        yield HandlingCandidate(words, changed(record, **{n: record.windows[n] * f for n in columns}), f**power)


def other_times(record: Record) -> Iterator[HandlingCandidate]:
    """Times in another unit, of data that do not hold them."""
    return scaled(record, TIMES, TIME, 0.0)


def scaled_in_attitudes(
    record: Record, columns: Sequence[str], factors: Mapping[str, float]
) -> Iterator[HandlingCandidate]:
    """Columns in another unit, or in another range of the meter, in one of a few attitudes."""
    names = list(dict.fromkeys(attitude_name(row) for row in record.run.plan if attitude_name(row)))
    phase = np.asarray(record.windows["phase"]).astype(int)
    for name in names if 1 < len(names) <= MOST_SCALED else ():
        here = np.isin(phase, [row.phase for row in record.run.plan if attitude_name(row) == name])
        for words, f in factors.items():
            columns_there = {n: np.where(here, record.windows[n] * f, record.windows[n]) for n in columns}
            yield HandlingCandidate(f"{words}, in {name}", changed(record, **columns_there))


def wrong_hemisphere(record: Record) -> Iterator[HandlingCandidate]:
    """The latitude with the wrong sign."""
    latitude = float(record.run.options["latitude"])
    yield HandlingCandidate("the latitude of the other sign", with_options(record, {"latitude": -latitude}))


def shifted(record: Record, columns: Sequence[str], words: str) -> Iterator[HandlingCandidate]:
    """Columns that belong to the row before or after; the row without one is left out."""
    w = record.windows
    n = len(w[columns[0]])
    for step, where in ((1, "the row before"), (-1, "the row after")):
        # columns of row k were read with row k - step
        keep = slice(0, n - 1) if step > 0 else slice(1, n)
        taken = slice(1, n) if step > 0 else slice(0, n - 1)
        rows = {c: np.asarray(v)[keep] for c, v in w.items()}
        rows |= {c: np.asarray(w[c])[taken] for c in columns}
        yield HandlingCandidate(f"{words} belonging to {where}", Record(rows, {}, record.run))


def exchanged_rows(record: Record, columns: Sequence[str], words: str, far: int = 0) -> Iterator[HandlingCandidate]:
    """Two groups of rows exchanged in ``columns``, whose equal values make a group: those that follow one another, of
    up to 80 groups; any two, of up to ``far``.
    """
    w = record.windows
    table = np.column_stack([np.asarray(w[c], dtype=float) for c in columns])
    new = np.concatenate([[True], np.any(np.abs(np.diff(table, axis=0)) > 1e-4 * np.ptp(table, axis=0), axis=1)])
    first = np.flatnonzero(new)
    if not 2 <= first.size <= 80:
        return
    group = np.cumsum(new) - 1
    for a, b in combinations(range(first.size), 2):
        if b - a > 1 and first.size > far:
            continue
        order = np.where(group == a, first[b], np.where(group == b, first[a], np.arange(group.size)))
        swapped = {c: np.asarray(w[c])[order] for c in columns}
        yield HandlingCandidate(f"{words} {a + 1} and {b + 1} exchanged", changed(record, **swapped))


def odd_rows(record: Record, column: str, words: str) -> Iterator[HandlingCandidate]:
    """Rows whose value is that of the others times -1 or a known factor: those that differ from the median."""
    v = np.asarray(record.windows[column], dtype=float)
    middle = float(np.median(v))
    if middle == 0.0:
        return
    for f, what in (
        (-1.0, "of the opposite sign"),
        *((f, f"times {f:g}") for f in (1e3, 1e-3, 60.0, 1.0 / 60.0, 2.0, 0.5)),
    ):
        rows = np.abs(v / middle - f) < 0.2 * abs(f)
        if 0 < np.count_nonzero(rows) < v.size / 2:
            first, last = np.flatnonzero(rows)[[0, -1]] + 1
            where = f"row {first}" if first == last else f"rows {first} to {last}"
            yield HandlingCandidate(f"{words} {what} in {where}", changed(record, **{column: np.where(rows, v / f, v)}))


def _late(record: Record, means: Sequence[str]) -> Iterator[HandlingCandidate]:
    """Currents that belong to the row before or after, all of them or one."""
    yield from shifted(record, means, "the current")
    for n in means if len(means) > 1 else ():
        yield from shifted(record, [n], f"the current {n}".replace("mean_", "about "))


# --------------------------------------------------------------------------------------------- families of tests
def tumble(record: Record) -> Iterator[HandlingCandidate]:
    """Rebalance currents (mean or mean_x, mean_y) over the angle of a turning table, and in dwells."""
    means = [n for n in ("mean", "mean_x", "mean_y") if n in record.windows]
    yield from exchanged_labels(record)
    yield from reversed_columns(record, ANGLES, "the rotation")
    yield from reversed_columns(record, means, "the current")
    yield from exchanged_columns(record, [("mean_x", "mean_y")], "the currents about x and y exchanged")
    yield from wrong_hemisphere(record)
    yield from scaled(record, ANGLES, ANGLE, 0.0)
    yield from scaled(record, means, CURRENT)
    yield from scaled_in_attitudes(record, means, CURRENT)
    yield from _late(record, means)


def positions(record: Record) -> Iterator[HandlingCandidate]:
    """Rebalance currents in positions that a plan names."""
    means = [n for n in ("mean", "mean_x", "mean_y") if n in record.windows]
    yield from exchanged_labels(record)
    yield from exchanged_columns(record, [("mean_x", "mean_y")], "the currents about x and y exchanged")
    for n in means:
        yield from reversed_columns(record, [n], f"the current {n}".replace("mean_", "about "), len(means) == 1)
    yield from wrong_hemisphere(record)
    yield from _late(record, means)


def readings(record: Record) -> Iterator[HandlingCandidate]:
    """Readings (mean) at angles that are set one after the other."""
    yield from reversed_columns(record, ANGLES, "the rotation")
    yield from reversed_columns(record, ["mean"], "the reading")
    yield from exchanged_rows(record, ANGLES, "angles")
    yield from scaled(record, ANGLES, ANGLE, 0.0)
    yield from shifted(record, ["mean"], "the reading")


def head(record: Record) -> Iterator[HandlingCandidate]:
    """Readings in the positions of a head, in mounts that a plan names."""
    yield from exchanged_labels(record)
    yield from readings(record)


def followed(record: Record) -> Iterator[HandlingCandidate]:
    """Case angles that follow the float, with pickoff voltages."""
    yield from reversed_columns(record, ANGLES, "the rotation")
    yield from reversed_columns(record, ["mean"], "the pickoff voltage")
    yield from shifted(record, ["mean"], "the pickoff voltage")
    yield from wrong_hemisphere(record)
    yield from scaled(record, ANGLES, ANGLE)
    yield from scaled(record, TIMES, TIME, -1.0)
    yield from exchanged_rows(record, [*ANGLES, "mean"], "readings")


def servo(record: Record) -> Iterator[HandlingCandidate]:
    """Angles of a table that its gyro holds."""
    yield from exchanged_labels(record)
    yield from reversed_columns(record, ANGLES, "the rotation")
    yield from wrong_hemisphere(record)
    yield from scaled(record, ANGLES, ANGLE)
    yield from scaled(record, TIMES, TIME, -1.0)


OUTER, INNER = ("outer_start", "outer_end"), ("inner_start", "inner_end")
BOTH = (*OUTER, *INNER)


def two_axes(record: Record) -> Iterator[HandlingCandidate]:
    """Angles of a table with two axes, and with them rebalance currents (mean) or nothing."""
    yield from exchanged_labels(record)
    yield from exchanged_columns(record, list(zip(OUTER, INNER, strict=True)), "outer and inner angle exchanged")
    for columns, words in ((OUTER, "the outer"), (INNER, "the inner"), (BOTH, "the outer and inner")):
        yield from reversed_columns(record, columns, f"{words} rotation", False)
    yield from wrong_hemisphere(record)
    if any(row.mode == "servo" for row in record.run.plan):
        yield from scaled(record, BOTH, ANGLE)
        yield from scaled(record, TIMES, TIME, -1.0)
        return
    yield from reversed_columns(record, ["mean"], "the current", False)
    yield from scaled(record, ["mean"], CURRENT)
    yield from scaled(record, BOTH, ANGLE, 0.0)
    yield from shifted(record, ["mean"], "the current")
    yield from exchanged_rows(record, BOTH, "positions")


def at_rest(record: Record) -> Iterator[HandlingCandidate]:
    """Currents, or rates, in one attitude: only rows that are unlike the others can be seen."""
    yield from odd_rows(record, "mean", "the rate" if reads_rate(record.run) else "the current")


def table_of_rates(record: Record) -> Iterator[HandlingCandidate]:
    """A row for each current: rates of both senses."""
    yield from exchanged_rows(record, ["current"], "the currents of rows", far=12)
    yield from exchanged_rows(record, ["rate_plus", "rate_minus"], "the rates of rows", far=12)
    yield from exchanged_rows(record, ["rate_plus"], "the positive rates of rows", far=12)
    yield from exchanged_rows(record, ["rate_minus"], "the negative rates of rows", far=12)
    w = record.windows
    for k in range(len(w["current"])):
        for f, words in ((1e3, "mA given as A"), (1e-3, "A given as mA"), (2.0, "half of it"), (0.5, "twice of it")):
            current = np.where(np.arange(len(w["current"])) == k, w["current"] * f, w["current"])
            yield HandlingCandidate(
                f"the current of row {k + 1} in another unit ({words})", changed(record, current=current)
            )
