"""A laboratory's record of turn-ons: readings from the switching on onwards, or one of each turn-on."""

from __future__ import annotations

from functools import partial

from gyrobench.record.csv_reader import FLAGGED, READING_TIMES, CsvColumn
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData

TEMPLATE = """\
# Turn-ons of a rate gyro: one row for each reading.
# limit = 1deg/h
# instrument = type and number of the gyro
# operator = who took the record
#
# turn_on: number of the turn-on, from 1.  day: 1, 2 ..., of the turn-on; may be left out.
# since: time from the switching on to the middle of the reading.  mean: rate that the gyro reads, in one attitude.
# rate: of the table, where it turns; may be left out.  temperature [degC] of the gyro when it was warm: optional.
# limit: the gyro is warm when its bias is within it of that in the end.
t_start [s],t_end [s],turn_on,day,since [s],mean [deg/h]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("turn_on", "1", "number of the turn-on, from 1", whole=True),
    CsvColumn("day", "1", "day", required=False, whole=True),
    CsvColumn("since", "s", "time from the switching on to the middle of the reading"),
    CsvColumn("mean", "rad/s", "mean indicated rate"),
    CsvColumn("rate", "rad/s", "rate of the table", required=False),
    FLAGGED,
)
MEASURED = MeasuredData(TEMPLATE, partial(read_record, columns=COLUMNS, time="t_start"))
