"""A laboratory's record of the two-channel tumble: which columns it has, and how it becomes a record."""

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.system.families.tumble_test import attitudes
from gyrobench.system.lab_record import WITH_POLARITY, laboratory_rows

TEMPLATE = """\
# Single-axis tumble of a two-degree-of-freedom gyro, both torquers in rebalance: one row for each averaging window.
# model = nine
# latitude = 45.75deg
# k_x = 17.227deg/h/mA
# k_y = 17.180deg/h/mA
# gravity = 9.8067m/s2
# instrument = type and number of the gyro
# operator = who took the record
# polarity = project
# phase 1 = static 3
# phase 2 = mount 1
# phase 3 = static 4
# phase 4 = mount 2
#
# latitude, k_x, k_y (scale factors of the torquers about x and y): needed, here or by --set.  gravity, height: optional
# (WGS84 normal gravity).  Axes x, y, z: outer gimbal, inner gimbal, spin.
# polarity: project (k i = input rate - drift, positive current precesses positively) or book (the opposite sign).
# phase N: which attitude the rows with this number were taken in.  Of model nine:
#   mount 1   table turning, spin axis along +pole, x axis west at angle 0
#   mount 2   table turning, spin axis along -pole, x axis west at angle 0
#   static 3  table at rest at angle 0, y axis up, x axis east
#   static 4  table at rest at angle 0, y axis down, x axis east
# Of model simple (no dwells):
#   mount 1   table turning, spin axis along +pole, y axis west at angle 0
#   mount 2   table turning, spin axis along -pole, y axis east at angle 0
# angle: of the table, right-handed about the pole, counted on through the turns; against the Earth it decreases.
# mean_x, mean_y: currents of the torquers about x (nulls the y pickoff) and about y (nulls the x pickoff), averaged.
# std_x, std_y, n (of the samples) and flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, arcsec, A ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean_x [mA],mean_y [mA],std_x [mA],std_y [mA],n,flagged
"""
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if c.name not in ("mean", "std")),
    CsvColumn("mean_x", "A", "mean current of the torquer about x"),
    CsvColumn("mean_y", "A", "mean current of the torquer about y"),
    CsvColumn("std_x", "A", "standard deviation of the samples of mean_x", required=False),
    CsvColumn("std_y", "A", "standard deviation of the samples of mean_y", required=False),
)
NEEDED = {"latitude": "45.75deg", "k_x": "17.227deg/h/mA", "k_y": "17.180deg/h/mA"}
MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, attitudes=attitudes, columns=COLUMNS, texts=WITH_POLARITY)
