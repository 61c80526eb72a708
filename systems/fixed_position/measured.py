"""A laboratory's record of a gyro in one attitude, or the list of runs that are its days."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import FLAGGED, READING_TIMES, CsvColumn, read_head
from gyrobench.record.multi_day_record import read_runs
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# Fixed-position test of a gyro in torque rebalance: one row for each reading.
# latitude = 45.75deg
# k = 17.2deg/h/mA
# attitude = E U -N
# instrument = type and number of the gyro
# operator = who took the record
#
# latitude, k (torquer scale factor), attitude: needed, here or by --set.  gravity, height: optional.
# attitude: directions of the gyro axes I, O and S (S may be left out): E east, N north, U up, P pole of the sky,
#   Q along E x P, or minus these; or a matrix [[..],[..],[..]] with the axes I, O, S as rows in east, north, up.
# mean: torquer current averaged over the reading, positive where it precesses positively (k i = input rate - drift).
# reading = rate: of a rate gyro; mean and std are then its rate along the input axis [deg/h], and k is not needed.
# day: optional; several days are reduced one by one and then together.  std, flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, uA ...).
#
# Instead: one column `run` with the folders of runs, one a day: they are reduced together.
t_start [s],t_end [s],mean [mA]
"""
ATTITUDE = "service attitude"
COLUMNS: tuple[CsvColumn, ...] = (
    *READING_TIMES,
    CsvColumn("mean", "A", "mean torquer current"),
    CsvColumn("day", "1", "day, from 1", required=False, whole=True),
    CsvColumn("std", "A", "standard deviation of the samples", required=False),
    FLAGGED,
)
#: those that are others of a rate gyro
RATES = {
    "mean": CsvColumn("mean", "rad/s", "mean rate"),
    "std": CsvColumn("std", "rad/s", "standard deviation of the samples", required=False),
}


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record, see :func:`gyrobench.system.lab_record.read_record`."""
    runs = read_runs(data, system.name, values)
    if runs is not None:
        return runs
    needed, columns = {"latitude": "45.75deg", "k": "17.2deg/h/mA", "attitude": "E U -N"}, COLUMNS
    if {**read_head(data).comments, **values}.get("reading", "") == "rate":
        del needed["k"]
        columns = tuple(RATES.get(c.name, c) for c in COLUMNS)
    record = read_record(system, data, values, needed=needed, columns=columns, time=None)
    windows = dict(record.windows)
    day = windows.pop("day", np.ones(len(windows["mean"]), dtype=np.int64))
    days = np.unique(day)
    several = days.size > 1
    plan = [
        PlanRow(phase=int(d), label=ATTITUDE, mode="hold", face=ATTITUDE, day=str(d) if several else "") for d in days
    ]
    return Record({"phase": day, **windows}, {}, record.run.replace(plan=plan))


MEASURED = MeasuredData(TEMPLATE, read)
