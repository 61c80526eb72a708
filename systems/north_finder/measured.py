"""A laboratory's or a vehicle's record of a north finder: rates, specific force and angles of the head."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.record.record import Record
from gyrobench.system.lab_record import of_positions, read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# North finding by gyro: one row for each averaging window.
# latitude = 45.75deg
# method = four
# instrument = type and number of the gyro
# operator = who took the record
#
# latitude, method (two, null, four, several, continuous, tilt, strapdown, strapdown two): needed, here or by --set.
# rough: rough heading, needed by two and null, whose sign it gives; sigma_rough: its standard uncertainty, without
#   which these two pass nothing: no residual shows a rough heading on the wrong side.  gravity, height: optional.
# drift_order: power of time up to which a drift of the bias is estimated with the heading; optional.
# Head axes: x right, y forward (the heading wanted is that of y at angle 0), z up.
# phase: number of the position, or of the turning.  angle: of the head, anticlockwise seen from above; positions
#   clockwise from above have negative angles.
# mean: rate along y, averaged over the window.  mean_x: along x, needed by the strapdown methods.
# f_x, f_y: specific force along x and y, needed by tilt (f_y) and strapdown (both); at rest level both are 0, nose up
#   makes f_y positive.
# Units in brackets may be others of the same kind (rad/s, mg ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [deg/h],mean_x [deg/h],f_x [mg],f_y [mg]
"""
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if c.name not in ("mean", "std")),
    CsvColumn("mean", "rad/s", "mean rate along y"),
    CsvColumn("mean_x", "rad/s", "mean rate along x", required=False),
    CsvColumn("f_x", "m/s2", "mean specific force along x", required=False),
    CsvColumn("f_y", "m/s2", "mean specific force along y", required=False),
    CsvColumn("std", "rad/s", "standard deviation of the samples", required=False),
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record, see :func:`gyrobench.system.lab_record.read_record`."""
    needed = {"latitude": "45.75deg", "method": "four"}
    return of_positions(read_record(system, data, values, needed=needed, columns=COLUMNS))


MEASURED = MeasuredData(TEMPLATE, read)
