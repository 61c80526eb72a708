"""A laboratory's record of vertical and level servo tests: which columns it has, and how it becomes a record."""

from gyrobench.attitudes import LEVEL, VERTICAL
from gyrobench.record.csv_reader import CsvColumn
from gyrobench.system.families.servo_test import laboratory_data

TEMPLATE = """\
# Vertical and level servo test: the gyro holds the table; one row for each window between two readings of its angle.
# latitude = 45.75deg
# gravity = 9.8067m/s2
# instrument = type and number of the gyro
# operator = who took the record
# phase 1 = x down
# phase 2 = x up
# phase 3 = x east, z down
#
# latitude: needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# phase N: attitude of the rows with this number; x input, y output, z spin axis, x along the table axis:
#   x down, x up                        input axis vertical, any table angle
#   x east, y up ... x south, z down    input axis level towards east, north, west or south, at angle 0 the named axis
#                                       up or down; only while the angle is within 1 degree
# angle: of the table, right-handed about x, at the start and the end of the window.
# current: of the torquer, where it compensated the Earth's rate; k (its scale factor) is then needed.
# mean, std: pickoff voltage, n samples, flagged (suspect samples): optional.  Units may be others of the same kind.
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg]
"""
CURRENT = CsvColumn("current", "A", "mean current of the torquer", required=False)
MEASURED = laboratory_data(TEMPLATE, (*VERTICAL, *LEVEL), CURRENT)
