"""A logger's file of an inertial measurement unit that was put into positions by hand: samples of six channels.

    time [s],gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]

CSV or Parquet; other names and units by a column map (gyrobench fit).  Without a unit, or [counts]: counts.  Positions
at rest are found (still.py), or numbered in a column ``position`` (0 or empty: moved).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import AnyArray, Array
from gyrobench.record import sampling
from gyrobench.record.circumstances import Keys, faults
from gyrobench.record.csv_reader import CsvColumn, DataError, Head
from gyrobench.record.drift_columns import named, open_table
from gyrobench.record.record import Record
from gyrobench.system.lab_record import TEXTS, measured_run, set_options
from gyrobench.system.system import System

from . import lost, norms, still
from .channels import CHANNELS

UP_DOWN = "up_down"  # option attitudes

COUNTS = re.compile(r" *\[(?:counts?|lsb|digits)\]", re.I)
NUMBER = CsvColumn("position", "1", "number of the position, 0: moved", required=False)
SHOWN = {"rad/s": "deg/h", "m/s2": "mg"}  # unit of a channel -> in warnings
FEW = 20  # samples of a position, or of a piece of it
MOVED = 6.0  # times the usual scatter
PIECES = 20  # of a position up or down


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
    if "latitude" not in system.given:
        problems.append("'latitude' is not given: write '# latitude = 45.75deg' in the file or --set latitude=45.75deg")
    table.head.names[:] = [COUNTS.sub(" [1]", name) for name in table.head.names]
    columns, unclear = _columns(table.head)
    problems += unclear
    if problems:
        raise DataError(data, problems)
    blocks = list(table.blocks(columns))
    samples = {c.name: np.concatenate([b[c.name] for b in blocks]) for c in columns}
    time, every, problems = _checked(samples)
    if problems:
        raise DataError(data, problems)
    up_down = system["attitudes"] == UP_DOWN
    windows, problems = _windows(time, every, samples, 2 if up_down else norms.LEAST, PIECES if up_down else 1)
    if problems:
        raise DataError(data, problems)
    said = {**table.head.comments, **values}
    run = measured_run(system, [], {n: said[n] for n in TEXTS if n in said})
    si = {c.name: c.unit for c in columns}
    run.window_units = {f"mean_{c.name}": si[c.name] for c in CHANNELS} | {"t_start": "s", "t_end": "s"}
    channels = {"time": time, **{f"imu.rate[{k + 1}]": every[:, k] for k in range(3)}}
    run.units = {n: si["gx"] for n in channels if n != "time"}
    run.doubts = _coarse(time, every, windows, si) + ([] if up_down else lost.doubts(time, every[:, :3]))
    return Record(windows, channels, run)


def _columns(head: Head) -> tuple[list[CsvColumn], list[str]]:
    """Return the columns to read, in units of rate and force, or as counts, and what is wrong with them."""
    there, problems = named(head), list[str]()
    lost = [c.name for c in CHANNELS if c.name not in there]
    if lost:
        problems.append(
            f"columns not found: {', '.join(lost)}; columns of the file: {', '.join(there)}. Other names are mapped: "
            "gyrobench fit FILE --system imu_positions --out map.toml, then --columns map.toml"
        )
    columns = [CsvColumn("time", "s", "time of the sample")]
    for kind, si in (("g", "rad/s"), ("a", "m/s2")):
        mine = [kind + a for a in "xyz" if kind + a in there]
        counted = [n for n in mine if (there[n] or "1") == "1"]
        if counted and len(counted) < len(mine):
            problems.append(f"columns {', '.join(mine)}: counts and another unit in one triad")
        columns += [CsvColumn(n, "1" if n in counted else si, "reading") for n in mine]
    return columns + ([NUMBER] if "position" in there else []), problems


def _checked(samples: Mapping[str, Array]) -> tuple[Array, Array, list[str]]:
    """Return time, the six channels (n, 6), and what is wrong with them; rows in which one is missing are left out."""
    time = samples["time"]
    every = np.column_stack([samples[c.name] for c in CHANNELS])
    there = np.isfinite(time) & np.all(np.isfinite(every), axis=1)
    time, every = time[there], every[there]
    problems = []
    if time.size < 2 * still.SHORT:
        return time, every, [f"{time.size} complete rows: no record of positions"]
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        problems.append(f"time does not increase at t = {time[back[0] + 1]:.9g} s and in {back.size - 1} more rows")
    for c in CHANNELS:
        column = every[:, CHANNELS.index(c)]
        if np.ptp(column) == 0.0:
            problems.append(f"column {c.name}: all values are the same, the {c.words} was not read")
    alike = [
        (a.name, b.name) for k, a in enumerate(CHANNELS) for b in CHANNELS[k + 1 :]
        if a.kind == b.kind and np.array_equal(every[:, CHANNELS.index(a)], every[:, CHANNELS.index(b)])
        and np.ptp(every[:, CHANNELS.index(a)]) > 0.0
    ]  # fmt: skip
    problems += [f"columns {a} and {b} are the same: one of them stands twice" for a, b in alike]
    return time, every, problems


def _windows(
    time: Array, every: Array, samples: Mapping[str, Array], least: int, pieces: int
) -> tuple[dict[str, AnyArray], list[str]]:
    """Return a row for each of so many pieces of each position at rest, and what is wrong with them."""
    if "position" in samples:
        found = [(a, b) for a, b in still.labelled(samples["position"]) if b - a >= FEW]
    else:
        found = still.at_rest(time, every)
    if len(found) < least:
        how = "numbered" if "position" in samples else "found in the samples (at rest for two seconds or more)"
        why = "an axis up and down" if pieces > 1 else "three accelerometers in unknown attitudes"
        return {}, [
            f"{len(found)} positions at rest {how}; at least {least} in different directions are needed for {why}"
        ]
    cuts = [np.linspace(a, b - 1, min(pieces, (b - a) // FEW) + 1).astype(int) for a, b in found]
    rows = [(k, a, b) for k, c in enumerate(cuts, 1) for a, b in pairwise(c.tolist())]
    phase, start, end = (np.array(x) for x in zip(*rows, strict=True))
    out: dict[str, AnyArray] = {"phase": phase, "t_start": time[start], "t_end": time[end], "n": end - start}
    for k, c in enumerate(CHANNELS):
        out[f"mean_{c.name}"] = np.array([every[a:b, k].mean() for _, a, b in rows])
        out[f"std_{c.name}"] = np.array([every[a:b, k].std(ddof=1) for _, a, b in rows])
    rest = np.zeros(time.size, dtype=bool)
    for a, b in found:
        rest[a:b] = True
    return out, _moved(out) + _clipped(time, every, rest)


def _coarse(time: Array, every: Array, windows: Mapping[str, AnyArray], si: Mapping[str, str]) -> list[str]:
    """Return the channels whose words are larger than their noise at rest averages out."""
    cuts = [np.searchsorted(time, windows[n]).tolist() for n in ("t_start", "t_end")]
    notes = []
    for k, c in enumerate(CHANNELS):
        seen = sampling.Successive()
        for a, b in zip(*cuts, strict=True):
            seen.add(every[a:b, k])
        notes.append(sampling.coarse(c.name, SHOWN.get(si[c.name], "1"), seen))
    return [text for text in notes if text]


def _clipped(time: Array, every: Array, rest: NDArray[np.bool_]) -> list[str]:
    """Return the channels that stand at one end of their values: their readings there are no means of an input."""
    stretches = {c: still.held(every[:, k], rest) for k, c in enumerate(CHANNELS)}
    return [
        f"column {c.name}: {b - a} samples from t = {time[a]:.6g} s on are all {every[a, CHANNELS.index(c)]:.6g}, the "
        f"largest or smallest that there is: the {c.words} is beyond its range. Take a larger range"
        + (", turn more slowly, or leave out the samples of the turns" if c.gyro else "")
        for c, (a, b) in ((c, s) for c, s in stretches.items() if s)
    ]


def _moved(windows: Mapping[str, AnyArray]) -> list[str]:
    """Return the positions in which a channel scatters far more than it usually does."""
    problems = []
    for c in CHANNELS:
        scatter = windows[f"std_{c.name}"] / max(float(np.median(windows[f"std_{c.name}"])), 1e-300)
        problems += [
            f"position {windows['phase'][k]} (t = {windows['t_start'][k]:.6g} s): {c.name} scatters {scatter[k]:.3g} "
            "times as much as in the others: it was moved, or its number reaches into the motion"
            for k in np.flatnonzero(scatter > MOVED)
        ]
    return problems
