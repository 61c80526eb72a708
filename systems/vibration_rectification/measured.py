"""A laboratory's record of a vibration test: mean readings of gyro and accelerometer at levels."""

from __future__ import annotations

from functools import partial

from gyrobench.record.csv_reader import READING_TIMES, CsvColumn
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData

TEMPLATE = """\
# Gyro and accelerometer on a shaker with a vertical axis: one row for each reading, at rest and vibrated.
# latitude = 45.75deg
# axis = x
# instrument = type and number of the unit
# operator = who took the record
#
# axis: of the case, along the vibration.  up: 1 where it points up, -1 where it points down.
# level: rms of the vibration in the band of the instruments, without gravity; 0 at rest.
#   Where it is y or z, the axis x of the gyro points east, up and down alike: else the Earth rate is in b_g or G.
# rate: mean rate that the gyro about x reads.  force: mean that the accelerometer along the axis reads.  One of them
#   may be left out.  flagged (samples beyond the range), temperature [degC]: optional.
t_start [s],t_end [s],up,level [g],rate [deg/h],force [g]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("up", "1", "1 up, -1 down", whole=True),
    CsvColumn("level", "m/s2", "rms of the vibration"),
    CsvColumn("rate", "rad/s", "mean rate that the gyro reads", required=False),
    CsvColumn("force", "m/s2", "mean that the accelerometer reads", required=False),
    CsvColumn("flagged", "1", "samples beyond the range", required=False, whole=True),
)
MEASURED = MeasuredData(
    TEMPLATE, partial(read_record, needed={"latitude": "45.75deg"}, columns=COLUMNS, time="t_start")
)
