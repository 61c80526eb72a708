"""A laboratory's record of the eight positions, or the list of runs that are its days."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import READING_TIMES, CsvColumn, DataError
from gyrobench.record.multi_day_record import read_runs
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

from . import positions

TEMPLATE = """\
# Eight-position test of a two-degree-of-freedom gyro with both rebalance loops closed: one row for each reading.
# latitude = 45.75deg
# gravity = 9.8067m/s2
# instrument = type and number of the gyro
# operator = who took the record
#
# latitude: needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# position (x: outer gimbal axis, y: inner gimbal axis, z: spin; E east, N north, U up):
#   1 x E y N z U   2 x N y -E z U   3 x -E y -N z U   4 x -N y E z U
#   5 x U y E z N   6 x -E y U z N   7 x -U y -E z N   8 x E y -U z N
# cycle: 1, 2 ... of the day.  day: optional; several days are reduced one by one and then together.
# mean_x, mean_y: currents of the torquers about x and y, positive where they precess positively.
# std, n, flagged (suspect samples; one column for each current): optional.
# Units in brackets may be others of the same kind (min, uA ...).
#
# Instead: one column `run` with the folders of runs, one a day: they are reduced together.
cycle,position,t_start [s],t_end [s],mean_x [mA],mean_y [mA]
"""
COLUMNS = (
    CsvColumn("cycle", "1", "cycle of the day, from 1", whole=True),
    CsvColumn("position", "1", "position, 1 to 8", whole=True),
    *READING_TIMES,
    CsvColumn("mean_x", "A", "mean current of the torquer about x"),
    CsvColumn("mean_y", "A", "mean current of the torquer about y"),
    CsvColumn("day", "1", "day, from 1", required=False, whole=True),
    CsvColumn("std_x", "A", "standard deviation of the samples of the x current", required=False),
    CsvColumn("std_y", "A", "standard deviation of the samples of the y current", required=False),
    CsvColumn("n", "1", "number of samples", required=False, whole=True),
    CsvColumn("flagged_x", "1", "suspect samples of the x current", required=False, whole=True),
    CsvColumn("flagged_y", "1", "suspect samples of the y current", required=False, whole=True),
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record, see :func:`gyrobench.system.lab_record.read_record`."""
    runs = read_runs(data, system.name, values)
    if runs is not None:
        return runs
    record = read_record(system, data, values, needed={"latitude": "45.75deg"}, columns=COLUMNS, time=None)
    rows = record.windows
    wrong = sorted(set(rows["position"].tolist()) - set(positions.ATTITUDES))
    if wrong:
        raise DataError(data, [f"position {', '.join(map(str, wrong))} unknown: positions are 1 to 8"])
    day = rows.pop("day", np.ones(len(rows["position"]), dtype=np.int64))
    several = np.unique(day).size > 1
    keys = list(zip(day.tolist(), rows.pop("cycle").tolist(), rows.pop("position").tolist(), strict=True))
    phases = {key: k for k, key in enumerate(dict.fromkeys(keys), 1)}
    plan = [
        PlanRow(
            phase=phase,
            label=f"cycle {c}, {positions.NAMES[p]}",
            mode="hold",
            face=positions.NAMES[p],
            cycle=c,
            day=str(d) if several else "",
        )
        for (d, c, p), phase in phases.items()
    ]
    windows = {"phase": np.array([phases[k] for k in keys], dtype=np.int64), **rows}
    return Record(windows, {}, record.run.replace(plan=plan))


MEASURED = MeasuredData(TEMPLATE, read)
