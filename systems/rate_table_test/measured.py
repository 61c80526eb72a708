"""A laboratory's record of a gyro on a rate table: one row for each reading."""

from __future__ import annotations

from functools import partial

from gyrobench.record.csv_reader import FLAGGED, READING_TIMES, CsvColumn
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData

TEMPLATE = """\
# Rate gyro on a rate table with a vertical axis: one row for each reading, in the order of time.
# latitude = 45.75deg
# instrument = type and number of the gyro
# operator = who took the record
#
# rate: of the table against the ground, about the input axis of the gyro and in its sense, positive and negative.
# mean: rate that the gyro indicates, averaged over the reading.  The input axis points up (else the Earth rate is of
#   the other sign and stands in the bias).
# cycle: optional, 1, 2 ...: each with both senses; their scale factors show the repeatability.
# temperature [degC], std, flagged (suspect samples): optional.  Units in brackets may be others of the same kind.
t_start [s],t_end [s],rate [deg/s],mean [deg/s]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("rate", "rad/s", "rate of the table"),
    CsvColumn("mean", "rad/s", "mean indicated rate"),
    CsvColumn("phase", "1", "number of the step, of time series", required=False, whole=True),
    CsvColumn("cycle", "1", "cycle, from 1", required=False, whole=True),
    CsvColumn("std", "rad/s", "standard deviation of the samples", required=False),
    FLAGGED,
)
MEASURED = MeasuredData(
    TEMPLATE, partial(read_record, needed={"latitude": "45.75deg"}, columns=COLUMNS, time="t_start")
)
