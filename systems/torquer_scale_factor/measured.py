"""A laboratory's table of the torquer test: one row for each current."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.record.csv_reader import Column, read_measured
from gyrobench.record.record import Record
from gyrobench.record.run_document import ABOUT
from gyrobench.system.lab_record import measured_run
from gyrobench.system.system import System

TEMPLATE = """\
# Torquer of a gyro on a servo table: one row for each current, both senses over the same angle range.
# instrument = type and number of the gyro
# operator = who took the data
#
# current: magnitude.  rate_plus, rate_minus: magnitudes of the table rate with positive and negative current.
# range_plus, range_minus: angle ranges; optional, they weigh the rows.  Units may be others of the same kind.
current [mA],rate_plus [deg/h],rate_minus [deg/h],range_plus [deg],range_minus [deg]
"""
COLUMNS = (
    Column("current", "A", "magnitude of the torquer current"),
    Column("rate_plus", "rad/s", "table rate with positive current, magnitude"),
    Column("rate_minus", "rad/s", "table rate with negative current, magnitude"),
    Column("range_plus", "rad", "angle range with positive current", required=False),
    Column("range_minus", "rad", "angle range with negative current", required=False),
)
TEXTS = ("title", "source", "made", "note", "instrument", "operator", *ABOUT, "date", "report")


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record.  Raises DataError, and InvalidValueError for an option that does not fit."""
    rows, comments = read_measured(data, COLUMNS, time=None)
    for name, value in {**{k: v for k, v in comments.items() if k in system.options}, **values}.items():
        if name not in TEXTS:
            system.set(name, value)
    texts = {**comments, **values}
    return Record(rows, {}, measured_run(system, [], {n: texts[n] for n in TEXTS if n in texts}))
