"""A laboratory's record of the two-axis tumble."""

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.system.lab_record import WITH_POLARITY, laboratory_rows

from .geometry import ANGLES

TEMPLATE = """\
# Two-axis tumble of a floated gyro in torque rebalance: one row for each average at rest, several rows a position.
# latitude = 45.75deg
# k = 17.2deg/h/mA
# m = 5
# n = 1
# gravity = 9.8067m/s2
# instrument = type and number of the gyro
# operator = who took the record
# polarity = project
#
# latitude, k (torquer scale factor): needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# m, n: ratio of outer and inner angle, used by the closed formulas and the plot.
# polarity: project (k i = input rate - drift, positive current precesses positively) or book (the opposite sign).
# phase: number of the position.  outer, inner: table angles at the start and the end of the average, right-handed,
#   counted on through the turns; outer axis along the pole.  At 0, 0: output axis along the pole, spin axis west,
#   inner axis and input axis along (0, -sin latitude, cos latitude) in east, north, up.
# mean: torquer current averaged at rest.  std [mA], n (of the samples) and flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, arcsec, A ...).
phase,t_start [s],t_end [s],outer_start [deg],outer_end [deg],inner_start [deg],inner_end [deg],mean [mA],n,flagged
"""
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if not c.name.startswith("angle")),
    *(CsvColumn(a, "rad", f"{a.split('_')[0]} table angle, cumulative") for a in ANGLES),
)
NEEDED = {"latitude": "45.75deg", "k": "17.2deg/h/mA"}
MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, columns=COLUMNS, texts=WITH_POLARITY)
