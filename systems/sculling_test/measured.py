"""A laboratory's record of a sculling test: the mean acceleration that the user computes, reading by reading."""

from gyrobench.record.csv_reader import READING_TIMES, CsvColumn
from gyrobench.system.lab_record import laboratory_rows

TEMPLATE = """\
# Sculling of a strapdown unit: one row for each reading, in motion and at rest between.
# interval = 0.01s
# bandwidth = 200Hz
# acc_bandwidth = 200Hz
# sculling = true
# samples = 1
# size = 0mm
# instrument = type and number of the unit
# operator = who took the record
#
# interval: time between two outputs of the unit.  bandwidth, acc_bandwidth: 3 dB of its filters, 0: none.  sculling:
#   its velocity increments have it.  samples: increments of one update of the velocity.  size: height of the
#   accelerometer along the vibration above that of the vertical.
# frequency: of angle and vibration, 0 at rest.  angle: amplitude, about one horizontal axis.  vibration: amplitude of
#   the acceleration along the other, in phase; negative in antiphase.
# acceleration: change of the computed velocity along the vertical over the reading by its length, positive upwards,
#   gravity taken off; a reading takes whole periods.
# temperature [degC]: optional.
t_start [s],t_end [s],frequency [Hz],angle [deg],vibration [m/s2],acceleration [ug]
"""
COLUMNS = (
    *READING_TIMES,
    CsvColumn("frequency", "Hz", "frequency of the motion"),
    CsvColumn("angle", "rad", "amplitude of the angle"),
    CsvColumn("vibration", "m/s2", "amplitude of the vibration"),
    CsvColumn("acceleration", "m/s2", "mean acceleration that the user computes"),
)
MEASURED = laboratory_rows(TEMPLATE, columns=COLUMNS, time="t_start")
