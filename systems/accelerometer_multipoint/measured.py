"""A laboratory's record of the multi-position test: which columns it has, and how it becomes a record."""

from gyrobench.system.lab_record import laboratory_rows

from .geometry import FACES

TEMPLATE = """\
# Multi-position test of an accelerometer on a head with a horizontal axis: one row for each reading.
# gravity = 9.8067m/s2
# scale = 9806.65m/s2/A
# instrument = type and number of the accelerometer
# operator = who took the record
# phase 1 = a
# phase 2 = b
#
# gravity, scale (λ, specific force per current; 1 g/mA = 9806.65 m/s2/A): needed, here or by --set.
# phase N: the mount of the rows with this number; the input axis is level at angle 0 and rises with the angle:
#   a   output axis along the axis of the head, pendulum axis up at angle 0 (gives k5)
#   b   pendulum axis along the axis of the head, output axis down at angle 0 (gives k4)
# angle: of the head; start and end are equal, a reading belongs to one position.  4, or at least 7, positions.
# mean: rebalance current, negative with the input axis up (sign of Hu 1981).  std, n, flagged: optional.
# Units in brackets may be others of the same kind (min, arcsec, A ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA],std [mA],n,flagged
"""
NEEDED = {"gravity": "9.8067m/s2", "scale": "9806.65m/s2/A"}
MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, attitudes=lambda _: dict.fromkeys(FACES, "index"))
