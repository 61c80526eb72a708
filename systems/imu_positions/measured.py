"""A laboratory's record of the multi-position and rate test: windows, or time series that are averaged into them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.record.drift_columns import open_table
from gyrobench.record.record import Record
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

from .channels import CHANNELS
from .geometry import ANGLES
from .hand import UNKNOWN
from .log import UP_DOWN, read_log

TEMPLATE = """\
# Positions and turns of an inertial measurement unit on a table with two axes: a row for each average, several a phase.
# latitude = 45.75deg
# gravity = 9.8067m/s2
# instrument = type and number of the unit
# operator = who took the record
#
# latitude: needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# phase: number of the position or of the turns.  outer, inner: table angles at the start and the end of the average,
#   right-handed, counted on through the turns.  The outer axis is level and points east, the inner axis at outer angle
#   0 north; at 0, 0 the plate lies level and the axes x, y, z of the case point east, north and up.
# mean_gx, mean_gy, mean_gz: rates that the gyros read; mean_ax, mean_ay, mean_az: specific force, +1 g with the axis up.
# Rows in which the table turns determine scale factors and misalignments of the gyros; the turns about three axes are
#   needed for all of them.  Without turns the gyros have bias and g-sensitivity alone.
# Units in brackets may be others of the same kind (deg/h, g, mg, arcsec ...).
#
# '# attitudes = unknown' and latitude in place of all this: a logger's samples, CSV or Parquet, of a unit put by hand
#   into 10 positions or more, spread over all directions, in which it stands still for some seconds; 24 are better.
#   Columns time [s], gx, gy, gz [deg/s], ax, ay, az [g], or [counts] where the scale factors are not known
#   (in a column map unit = "1").  Positions are found, or numbered in a column 'position' (0 or empty: moved).
#   gx, gy, gz may be missing.  Without time: '# sampling = 100Hz', or each row is the mean of a position.
#   '# attitudes = up_down': one axis up and down.
phase,t_start [s],t_end [s],outer_start [deg],outer_end [deg],inner_start [deg],inner_end [deg],mean_gx [deg/s],mean_gy [deg/s],mean_gz [deg/s],mean_ax [m/s2],mean_ay [m/s2],mean_az [m/s2]
"""  # noqa: E501
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if c.name in ("phase", "t_start", "t_end", "n", "flagged")),
    *(CsvColumn(a, "rad", f"{a.split('_')[0]} table angle at the {a.split('_')[1]}, cumulative") for a in ANGLES),
    *(CsvColumn(f"mean_{c.name}", "rad/s" if c.gyro else "m/s2", f"mean reading of the {c.words}") for c in CHANNELS),
)
NEEDED = {"latitude": "45.75deg"}


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the record of a file: of positions that a table read, or of a logger where attitudes are unknown.

    Raises DataError and InvalidValueError.
    """
    stated = open_table(data).head.comments if data.is_file() else {}
    if values.get("attitudes", stated.get("attitudes", "table")) in (UNKNOWN, UP_DOWN):
        return read_log(system, data, values)
    return read_record(system, data, values, needed=NEEDED, columns=COLUMNS)


#: header of a logger's file, for the proposal of a column map
SAMPLES = "time [s],gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]"
MEASURED = MeasuredData(TEMPLATE, read, samples=SAMPLES)
