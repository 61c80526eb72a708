"""A laboratory's readings of an open-loop test."""

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
# Open-loop drift test: the case is turned about the input axis of the gyro to the null of its pickoff; a row a reading.
# latitude = 45.75deg
# attitude = E U -N
# instrument = type and number of the gyro
# operator = who took the record
#
# latitude, attitude: needed, here or by --set.  gravity, height, float_gain (H/C, 1): optional.
# attitude: directions of the gyro axes I, O and S (S may be left out) at angle 0: E east, N north, U up, P pole of the
#   sky, Q = E x P, or minus these; or a matrix [[..],[..],[..]] with the axes I, O, S as rows in east, north, up.
# angle: of the case, right-handed about the input axis.  u: pickoff there, positive where the case is turned too far;
# without the column u every reading was taken at the null.  flagged: 1 where the pickoff was saturated; optional.
# Units in brackets may be others of the same kind (min, arcsec, V ...).
t_start [s],t_end [s],angle [deg],u [mV]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("angle", "rad", "case angle about the input axis"),
    CsvColumn("u", "V", "pickoff voltage", required=False),
    FLAGGED,
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record, see :func:`gyrobench.system.lab_record.read_record`."""
    needed = {"latitude": "45.75deg", "attitude": "E U -N"}
    record = read_record(system, data, values, needed=needed, columns=COLUMNS)
    windows = dict(record.windows)
    angle = windows.pop("angle")
    windows["mean"] = windows.pop("u", np.zeros(angle.size))
    windows |= {"angle_start": angle, "angle_end": angle, "phase": np.arange(1, angle.size + 1)}
    plan = [PlanRow(phase=n, label=f"reading {n}", mode="hold", face="input axis") for n in windows["phase"].tolist()]
    return Record(windows, {}, record.run.replace(plan=plan))


MEASURED = MeasuredData(TEMPLATE, read)
