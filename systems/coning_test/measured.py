"""A laboratory's record of a coning test: the drift of the user's attitude, reading by reading."""

from gyrobench.record.csv_reader import READING_TIMES, CsvColumn
from gyrobench.system.lab_record import laboratory_rows

TEMPLATE = """\
# Coning of a strapdown unit: one row for each reading, of cones and of the rest between them.
# axis = z
# interval = 0.01s
# bandwidth = 200Hz
# coning = true
# samples = 1
# instrument = type and number of the unit
# operator = who took the record
#
# axis: of the case, along that of the cone.  interval: time between two outputs of the unit.  bandwidth: 3 dB of its
#   filter, 0: none.  coning: its increments are rotation vectors.  samples: increments of one update of the attitude.
# frequency: of the cone, negative where it goes round clockwise as seen against the axis; 0: at rest.
# half_angle: between the axis of the case and that of the cone.
# drift_x, drift_y, drift_z: change of the computed attitude over the reading by its length, along the axes of the case;
#   a reading takes whole cones.
# temperature [degC]: optional.
t_start [s],t_end [s],frequency [Hz],half_angle [deg],drift_x [deg/h],drift_y [deg/h],drift_z [deg/h]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("frequency", "Hz", "frequency of the cone"),
    CsvColumn("half_angle", "rad", "half-angle of the cone"),
    *(CsvColumn(f"drift_{a}", "rad/s", f"drift of the attitude along {a}") for a in "xyz"),
)
MEASURED = laboratory_rows(TEMPLATE, columns=COLUMNS, time="t_start")
