"""A laboratory's record of a position sensitivity test: which columns it has, and how it becomes a record."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import FLAGGED, READING_TIMES, CsvColumn
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# Position sensitivity of a gyro with two degrees of freedom, both torquers in rebalance: one row for each reading.
# latitude = 45.75deg
# attitude = E U -N
# k_x = 17.227deg/h/mA
# k_y = 17.180deg/h/mA
# K_sg_x = 10V/rad
# K_sg_y = 10V/rad
# instrument = type and number of the gyro
# operator = who took the record
#
# latitude, attitude (axes x, y, z: outer gimbal, inner gimbal, spin), k_x, k_y (scale factors of the torquers about x
# and y), K_sg_x, K_sg_y (gains of the pickoffs): needed, here or by --set.  gravity, height: optional.
# mean_x, mean_y: currents of the torquers about x (nulls the y pickoff) and about y (nulls the x pickoff), averaged,
#   positive where they precess positively (k i = input rate - drift).
# u_x, u_y: voltages of the pickoffs, averaged: angle of the case against the rotor, u = -K_sg psi.  Hold the rotor at
#   no less than three angles about each axis, by a voltage added to the pickoff, in an order that no trend copies.
# std_x, std_y, n (of the samples of the currents) and flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, uA ...).
t_start [s],t_end [s],mean_x [mA],mean_y [mA],u_x [mV],u_y [mV]
"""
COLUMNS: tuple[CsvColumn, ...] = (
    *READING_TIMES,
    CsvColumn("mean_x", "A", "mean current of the torquer about x"),
    CsvColumn("mean_y", "A", "mean current of the torquer about y"),
    CsvColumn("u_x", "V", "mean voltage of the x pickoff"),
    CsvColumn("u_y", "V", "mean voltage of the y pickoff"),
    CsvColumn("std_x", "A", "standard deviation of the samples of mean_x", required=False),
    CsvColumn("std_y", "A", "standard deviation of the samples of mean_y", required=False),
    CsvColumn("n", "1", "samples", required=False, whole=True),
    FLAGGED,
)
NEEDED = {
    "latitude": "45.75deg", "attitude": "E U -N", "k_x": "17.227deg/h/mA", "k_y": "17.180deg/h/mA",
    "K_sg_x": "10V/rad", "K_sg_y": "10V/rad",
}  # fmt: skip


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record, see :func:`gyrobench.system.lab_record.read_record`."""
    record = read_record(system, data, values, needed=NEEDED, columns=COLUMNS, time=None)
    rows = len(record.windows["t_start"])
    plan = [PlanRow(phase=1, label="readings", mode="hold", face="service attitude")]
    return Record({"phase": np.ones(rows, dtype=np.int64), **record.windows}, {}, record.run.replace(plan=plan))


MEASURED = MeasuredData(TEMPLATE, read)
