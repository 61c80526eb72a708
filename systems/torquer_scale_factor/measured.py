"""A laboratory's table of the torquer test: one row for each current."""

from gyrobench.record.csv_reader import CsvColumn
from gyrobench.system.lab_record import laboratory_rows

TEMPLATE = """\
# Torquer of a gyro on a servo table: one row for each current, both senses over the same angle range.
# instrument = type and number of the gyro
# operator = who took the data
#
# current: magnitude.  rate_plus, rate_minus: magnitudes of the table rate with positive and negative current.
# range_plus, range_minus: angle ranges; optional, they weigh the rows.  Units may be others of the same kind.
current [mA],rate_plus [deg/h],rate_minus [deg/h],range_plus [deg],range_minus [deg]
"""
COLUMNS = (
    CsvColumn("current", "A", "magnitude of the torquer current"),
    CsvColumn("rate_plus", "rad/s", "table rate with positive current, magnitude"),
    CsvColumn("rate_minus", "rad/s", "table rate with negative current, magnitude"),
    CsvColumn("range_plus", "rad", "angle range with positive current", required=False),
    CsvColumn("range_minus", "rad", "angle range with negative current", required=False),
)
MEASURED = laboratory_rows(TEMPLATE, columns=COLUMNS, time=None)
