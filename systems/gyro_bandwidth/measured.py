"""A laboratory's record of a frequency response: one row for each frequency."""

from __future__ import annotations

from functools import partial

from gyrobench.record.csv_reader import CsvColumn
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData

TEMPLATE = """\
# Frequency response of a rate gyro on a table with angular vibration: one row for each frequency, at least eight.
# instrument = type and number of the gyro
# operator = who took the record
#
# frequency: of the vibration.  table: amplitude of the rate of the table, about the input axis of the gyro.
# gyro: amplitude of the rate that the gyro indicates.  phase: of the gyro against the table, negative where it lags.
# u: relative standard uncertainty of gyro over table, as of its phase in rad; optional, then it follows from the
#   scatter about the fitted curve.
frequency [Hz],table [deg/s],gyro [deg/s],phase [deg]
"""
COLUMNS = (
    CsvColumn("frequency", "Hz", "frequency of the vibration"),
    CsvColumn("table", "rad/s", "amplitude of the table rate"),
    CsvColumn("gyro", "rad/s", "amplitude of the indicated rate"),
    CsvColumn("phase", "rad", "phase of the gyro against the table"),
    CsvColumn("u", "1", "relative standard uncertainty of the ratio", required=False),
)
MEASURED = MeasuredData(TEMPLATE, partial(read_record, columns=COLUMNS, time=None))
