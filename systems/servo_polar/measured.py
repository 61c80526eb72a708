"""A laboratory's record of the polar servo test: which columns it has, and how it becomes a record."""

from gyrobench.attitudes import POLAR
from gyrobench.system.families.servo_test import laboratory_data

TEMPLATE = """\
# Polar servo test: the gyro holds a table with its axis along the pole; one row for each window between two readings.
# latitude = 45.75deg
# gravity = 9.8067m/s2
# route = dwells
# instrument = type and number of the gyro
# operator = who took the record
# phase 1 = x east, y up
# phase 2 = x east, y down
# phase 3 = polar S
# phase 4 = polar N
#
# latitude: needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# route: how R and K_zx are told apart: dwells (phases 1, 2), equal (K_zx = K_xz) or combination (neither).
# phase N: attitude of the rows with this number; x input, y output, z spin axis, x along the table axis:
#   polar S       x against the pole, y west at angle 0        x east, y up      x horizontal, y up at angle 0
#   polar N       x along the pole, y west at angle 0          x east, y down    x horizontal, y down at angle 0
# angle: of the table, right-handed about x, counted on through the turns; at the start and the end of the window.
# mean, std: pickoff voltage, n samples, flagged (suspect samples): optional.  Units may be others of the same kind.
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg]
"""
MEASURED = laboratory_data(TEMPLATE, ("x east, y up", "x east, y down", *POLAR))
