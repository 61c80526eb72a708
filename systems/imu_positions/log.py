"""A logger's file of an inertial measurement unit that was put into positions by hand: samples of six channels.

    time [s],gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]

CSV or Parquet; other names and units by a column map (gyrobench fit).  Without a unit, or [counts]: counts.  Positions
at rest are found (still.py), or numbered in a column ``position`` (0 or empty: moved).  Without gyros: accelerometers
alone.  Without a time and a sampling rate each row is the mean of a position.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import AnyArray, Array
from gyrobench.record import sampling
from gyrobench.record.circumstances import Keys, faults
from gyrobench.record.csv_reader import CsvColumn, DataError, Head
from gyrobench.record.drift_columns import named, open_table
from gyrobench.record.first_cells import COUNTS
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.system.lab_record import TEXTS, measured_run, set_options
from gyrobench.system.system import System

from . import lost, norms, still
from .channels import CHANNELS, ImuInstrument

UP_DOWN = "up_down"  # option attitudes

NUMBER = CsvColumn("position", "1", "number of the position, 0: moved", required=False)
SHOWN = {"rad/s": "deg/h", "m/s2": "mg"}  # unit of a channel -> in warnings
FEW = 20  # samples of a position, or of a piece of it
MOVED = 6.0  # times the usual scatter
PIECES = 20  # of a position up or down
MEANS = 500  # rows at most that are a position each


def read_log(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the record of a file: a row for each position, and the samples of the gyros.

    Raises DataError with all that is wrong, InvalidValueError for an option of ``values`` that does not fit.
    """
    table = open_table(data)
    for name in values:
        if name not in system.options and name not in TEXTS:
            system.set(name, values[name])  # says which options there are
    problems = faults(table.head.statements, Keys((*system.options, *TEXTS)))
    problems += set_options(system, table.head.statements, values)
    table.head.names[:] = [COUNTS.sub("1", name) if name.endswith("]") else name for name in table.head.names]
    up_down = system["attitudes"] == UP_DOWN
    mine, columns, unclear = _columns(table.head, up_down)
    gyros = any(c.gyro for c in mine)
    if "latitude" not in system.given and (gyros or "gravity" not in system.given):
        instead = "" if gyros else " (or gravity = 9.8067m/s2)"
        problems.append(
            f"'latitude' is not given: write '# latitude = 45.75deg' in the file or --set latitude=45.75deg{instead}"
        )
    problems += unclear
    if problems:
        raise DataError(data, problems)
    blocks = list(table.blocks(columns))
    samples = {c.name: np.concatenate([b[c.name] for b in blocks]) for c in columns}
    rows = samples[columns[-1].name].size
    means = "time" not in samples and not system["sampling"]
    if means and (up_down or rows > MEANS):
        raise DataError(
            data,
            [f"column 'time [s]' is missing, and no sampling rate is given: write '# sampling = 100Hz' in the file or "
             f"--set sampling=100Hz (without both each row is the mean of a position, of {MEANS} at most)"],
        )  # fmt: skip
    if "time" not in samples:
        samples["time"] = np.arange(float(rows)) / (system["sampling"] or 1.0)
    time, every, problems = _checked(samples, mine, norms.LEAST if means else 2 * still.SHORT)
    if problems:
        raise DataError(data, problems)
    notes, loud = list[str](), still.LOUD[0]
    if means:
        windows = _means(time, every, mine)
    else:
        least = 2 if up_down else norms.LEAST
        windows, problems, notes, loud = _windows(time, every, mine, samples, least, PIECES if up_down else 1)
    if problems:
        raise DataError(data, problems)
    said = {**table.head.comments, **values}
    run = measured_run(system, [], {n: said[n] for n in TEXTS if n in said})
    si = {c.name: c.unit for c in columns}
    run.window_units = {f"mean_{c.name}": si[c.name] for c in mine} | {"t_start": "s", "t_end": "s"}
    if means:
        return Record(windows, {}, run)
    channels = {"time": time, **{f"imu.rate[{k + 1}]": every[:, k] for k, c in enumerate(mine) if c.gyro}}
    run.units = {n: si["gx"] for n in channels if n != "time"}
    run.notes = notes
    run.doubts = _coarse(time, every, mine, windows, si)
    run.doubts += [_leaned(windows, loud)] if loud > still.LOUD[0] else []
    run.doubts += [] if up_down or not gyros else lost.doubts(time, every[:, :3])
    return Record(windows, channels if gyros else {}, run)


def _columns(head: Head, up_down: bool) -> tuple[list[ImuInstrument], list[CsvColumn], list[str]]:
    """Return the instruments that are there, the columns to read, in units of rate and force, or as counts, and what is
    wrong with them.
    """
    there, problems = named(head), list[str]()
    gyros = up_down or any(c.name in there for c in CHANNELS if c.gyro)
    mine = [c for c in CHANNELS if gyros or not c.gyro]
    if lost := [c.name for c in mine if c.name not in there]:
        problems.append(
            f"columns not found: {', '.join(lost)}; columns of the file: {', '.join(there)}. Other names are mapped: "
            "gyrobench fit FILE --system imu_positions --out map.toml, then --columns map.toml"
        )
    columns = [CsvColumn("time", "s", "time of the sample")] if "time" in there else []
    for kind, si in (("g", "rad/s"), ("a", "m/s2")):
        triad = [kind + a for a in "xyz" if kind + a in there]
        counted = [n for n in triad if (there[n] or "1") == "1"]
        if counted and len(counted) < len(triad):
            problems.append(f"columns {', '.join(triad)}: counts and another unit in one triad")
        columns += [CsvColumn(n, "1" if n in counted else si, "reading") for n in triad]
    return mine, columns + ([NUMBER] if "position" in there else []), problems


def _checked(samples: Mapping[str, Array], mine: Sequence[ImuInstrument], least: int) -> tuple[Array, Array, list[str]]:
    """Return time, the channels (n, k), and what is wrong with them; rows in which one is missing are left out."""
    time = samples["time"]
    every = np.column_stack([samples[c.name] for c in mine])
    there = np.isfinite(time) & np.all(np.isfinite(every), axis=1)
    time, every = time[there], every[there]
    problems = []
    if time.size < least:
        return time, every, [f"{time.size} complete rows: no record of positions"]
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        problems.append(f"time does not increase at t = {time[back[0] + 1]:.9g} s and in {back.size - 1} more rows")
    for k, c in enumerate(mine):
        if np.ptp(every[:, k]) == 0.0:
            problems.append(f"column {c.name}: all values are the same, the {c.words} was not read")
    alike = [
        (mine[i].name, mine[j].name) for i, j in combinations(range(len(mine)), 2)
        if mine[i].kind == mine[j].kind and np.array_equal(every[:, i], every[:, j]) and np.ptp(every[:, i]) > 0.0
    ]  # fmt: skip
    problems += [f"columns {a} and {b} are the same: one of them stands twice" for a, b in alike]
    return time, every, problems


def _means(time: Array, every: Array, mine: Sequence[ImuInstrument]) -> dict[str, AnyArray]:
    """Return a row for each mean of a position, one after the other in a second each."""
    out: dict[str, AnyArray] = {"phase": np.arange(1, time.size + 1), "t_start": time, "t_end": time + 1.0}
    return out | {f"mean_{c.name}": every[:, k] for k, c in enumerate(mine)}


def _windows(
    time: Array, every: Array, mine: Sequence[ImuInstrument], samples: Mapping[str, Array], least: int, pieces: int
) -> tuple[dict[str, AnyArray], list[str], list[str], float]:
    """Return a row for each of so many pieces of each position at rest, what is wrong with them, notes, and how many
    times the quietest scatter they may have.
    """
    notes, loud = list[str](), still.LOUD[0]
    if "position" in samples:
        found = [(a, b) for a, b in still.labelled(samples["position"]) if b - a >= FEW]
    else:
        found, loud = still.at_rest(time, every, least)
        scatter = np.array([every[a:b].std(axis=0) for a, b in found]).reshape(-1, len(mine))
        crept = np.any(scatter > MOVED * np.maximum(np.median(scatter, axis=0), 1e-300), axis=1) & (len(found) > 0)
        if crept.any():
            at = ", ".join(f"{time[a]:.6g} s" for (a, _), moved in zip(found, crept, strict=True) if moved)
            notes.append(
                f"Not taken for a position at rest, though each second is quiet: the stretches from t = {at} on, which "
                f"scatter {MOVED:g} times as much as the others and more."
            )
            found = [place for place, moved in zip(found, crept, strict=True) if not moved]
    if len(found) < least:
        how = "numbered" if "position" in samples else "found in the samples (at rest for two seconds or more)"
        why = "an axis up and down" if pieces > 1 else "three accelerometers in unknown attitudes"
        return (
            {},
            [f"{len(found)} positions at rest {how}; at least {least} in different directions are needed for {why}"],
            notes,
            loud,
        )
    cuts = [np.linspace(a, b - 1, min(pieces, (b - a) // FEW) + 1).astype(int) for a, b in found]
    rows = [(k, a, b) for k, c in enumerate(cuts, 1) for a, b in pairwise(c.tolist())]
    phase, start, end = (np.array(x) for x in zip(*rows, strict=True))
    out: dict[str, AnyArray] = {"phase": phase, "t_start": time[start], "t_end": time[end], "n": end - start}
    for k, c in enumerate(mine):
        out[f"mean_{c.name}"] = np.array([every[a:b, k].mean() for _, a, b in rows])
        out[f"std_{c.name}"] = np.array([every[a:b, k].std(ddof=1) for _, a, b in rows])
    rest = np.zeros(time.size, dtype=bool)
    for a, b in found:
        rest[a:b] = True
    return out, _moved(out, mine) + _clipped(time, every, mine, rest), notes, loud


def _leaned(windows: Mapping[str, AnyArray], loud: float) -> str:
    """Return that positions were held by a hand, whose leaning makes the mean force smaller: by half its variance over
    the square of the force.
    """
    square, variance = (sum(windows[f"{kind}_a{x}"] ** 2 for x in "xyz") for kind in ("mean", "std"))
    most = plain(1e6 * float(np.max(0.5 * variance / square)), 2)
    return (
        f"Positions at rest are the stretches that scatter up to {loud:g} times as much as the quietest tenth of the "
        "record, as if a hand held the case: of up to twice as much there are too few. Where it leans meanwhile the "
        f"mean force is smaller, in all positions alike: scale factors may be up to {most} ppm too small, and no "
        "residual shows it. Put the case down."
    )


def _coarse(
    time: Array, every: Array, mine: Sequence[ImuInstrument], windows: Mapping[str, AnyArray], si: Mapping[str, str]
) -> list[str]:
    """Return the channels whose words are larger than their noise at rest averages out."""
    cuts = [np.searchsorted(time, windows[n]).tolist() for n in ("t_start", "t_end")]
    notes = []
    for k, c in enumerate(mine):
        seen = sampling.Successive()
        for a, b in zip(*cuts, strict=True):
            seen.add(every[a:b, k])
        notes.append(sampling.coarse(c.name, SHOWN.get(si[c.name], "1"), seen))
    return [text for text in notes if text]


def _clipped(time: Array, every: Array, mine: Sequence[ImuInstrument], rest: NDArray[np.bool_]) -> list[str]:
    """Return the channels that stand at one end of their values: their readings there are no means of an input."""
    stretches = {(k, c): still.held(every[:, k], rest) for k, c in enumerate(mine)}
    return [
        f"column {c.name}: {b - a} samples from t = {time[a]:.6g} s on are all {every[a, k]:.6g}, the "
        f"largest or smallest that there is: the {c.words} is beyond its range. Take a larger range"
        + (", turn more slowly, or leave out the samples of the turns" if c.gyro else "")
        for (k, c), (a, b) in ((of, s) for of, s in stretches.items() if s)
    ]


def _moved(windows: Mapping[str, AnyArray], mine: Sequence[ImuInstrument]) -> list[str]:
    """Return the positions in which a channel scatters far more than it usually does."""
    problems = []
    for c in mine:
        scatter = windows[f"std_{c.name}"] / max(float(np.median(windows[f"std_{c.name}"])), 1e-300)
        problems += [
            f"position {windows['phase'][k]} (t = {windows['t_start'][k]:.6g} s): {c.name} scatters {scatter[k]:.3g} "
            "times as much as in the others: it was moved, or its number reaches into the motion"
            for k in np.flatnonzero(scatter > MOVED)
        ]
    return problems
