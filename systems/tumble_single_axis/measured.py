"""A laboratory's record of the single-axis tumble: which columns it has, and how it becomes a record."""

from gyrobench.system.families.tumble_test import attitudes
from gyrobench.system.lab_record import WITH_POLARITY, laboratory_rows

TEMPLATE = """\
# Single-axis tumble of a floated gyro in torque rebalance: one row for each averaging window, of a table that turns
# (continuous tumble) or rests at one angle after the other (intermittent tumble).
# latitude = 45.75deg
# k = 17.2deg/h/mA
# gravity = 9.8067m/s2
# instrument = type and number of the gyro
# operator = who took the record
# polarity = project
# phase 1 = static 3
# phase 2 = mount 1
# phase 3 = static 4
# phase 4 = mount 2
#
# latitude, k (torquer scale factor): needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# stops: of an intermittent tumble, a comment "stops = 24" with the number of angles in a turn at which the table rests;
# angle_start and angle_end are then equal, and a stop has one row or several.  Without it the table turns.
# polarity: project (k i = input rate - drift, positive current precesses positively) or book (the opposite sign).
# phase N: which attitude the rows with this number were taken in:
#   mount 1   table turning, or at its stops, output axis along +pole, input axis east at angle 0
#   mount 2   table turning, or at its stops, output axis along -pole, input axis east at angle 0
#   static 3  table at rest at angle 0, output axis up, input axis east
#   static 4  table at rest at angle 0, output axis down, input axis east
# angle: of the table, right-handed about the pole, counted on through the turns; against the Earth it decreases.
# mean: torquer current averaged over the window.  std, n (of the samples) and flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, arcsec, A ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA],std [mA],n,flagged
"""
NEEDED = {"k": "...", "latitude": "45.75deg"}
MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, attitudes=attitudes, texts=WITH_POLARITY)
