"""A laboratory's record of the two-axis servo test: which columns it has, and how it becomes a record."""

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn
from gyrobench.system.lab_record import laboratory_rows

from .geometry import MOUNTS
from .windows import ANGLES

TEMPLATE = """\
# Two-axis servo test: the gyro holds a table with two axes; one row for each window between two readings of its angles.
# latitude = 45.75deg
# gravity = 9.8067m/s2
# terms = 9
# instrument = type and number of the gyro
# operator = who took the record
# phase 1 = mount 2
# phase 2 = mount 4
#
# latitude: needed, here or by --set.  gravity, height: optional (WGS84 normal gravity).
# terms: 8 (Hu 1981) or 9 terms a channel.
# phase N: mount of the rows with this number.  Outer axis X and inner axis Y at angles 0 point (E east, N north, U up,
#   p pole of the sky, I = E x p = (0, -sin latitude, cos latitude)):
#   mount 1  E, N    mount 4  N, U    mount 7  U, N    mount 10  p, I
#   mount 2  E, U    mount 5  E, p    mount 8  U, E    mount 11  I, E
#   mount 3  N, E    mount 6  E, I    mount 9  p, E    mount 12  I, p
# outer, inner: angles of the two axes at the start and the end of the window, right-handed about X and Y, counted on
#   through the turns.  At 0, 0 the gyro's x axis (outer gimbal) lies along X, its y axis (inner gimbal) along Y.
#   Rows of a mount follow one another; a row begins where the one before it ended.
# current_x, current_y: where the torquers keep both angles at 0 ("levelled = true", k_x and k_y their scale factors):
#   current that precesses the rotor about x (of the torquer about y, k_y), and about y (k_x).
# mean_x, std_x, mean_y, std_y: pickoff voltages, n samples, flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (rad, arcsec, min, h ...).
phase,t_start [s],t_end [s],outer_start [deg],outer_end [deg],inner_start [deg],inner_end [deg]
"""
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if not c.name.startswith("angle") and c.name not in ("mean", "std")),
    *(CsvColumn(a, "rad", f"{a.split('_')[0]} table angle, cumulative") for a in ANGLES),
    *(CsvColumn(f"current_{a}", "A", f"torquer current that precesses about {a}", required=False) for a in "xy"),
    *(CsvColumn(f"{c}_{a}", "V", f"{a} pickoff voltage", required=False) for a in "xy" for c in ("mean", "std")),
)
NEEDED = {"latitude": "45.75deg"}
ATTITUDES = {f"mount {m}": "servo" for m in MOUNTS}
MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, attitudes=lambda _: ATTITUDES, columns=COLUMNS)
