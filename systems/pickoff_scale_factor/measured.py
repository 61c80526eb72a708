"""A laboratory's record of the pickoff test: which columns it has, and how it becomes a record."""

from dataclasses import replace

from gyrobench.record.csv_reader import WINDOW_COLUMNS
from gyrobench.system.lab_record import laboratory_rows

TEMPLATE = """\
# Pickoff of a gyro, open loop, input axis along the table axis and at right angles to the pole: one row per reading.
# drift = 2deg/h
# gain = 1
# instrument = type and number of the gyro
# operator = who took the record
#
# drift: the largest to be expected of the gyro, bounds the error of a quick test.
# gain: angle of the float per angle of the case, H/C (1 for a gyro whose pickoff sees the case against the rotor).
# phase: 1, 2, 3 ... one for each angle in the order taken; back again over the same angles tells the drift.
# angle: of the table, right-handed about the input axis; start and end are equal.  At least 10 different angles.
# mean: pickoff voltage.  std, n, flagged (saturated samples): optional.
# Units in brackets may be others of the same kind (min, deg, V ...).
phase,t_start [s],t_end [s],angle_start [arcmin],angle_end [arcmin],mean [mV],std [mV],n,flagged
"""
COLUMNS = tuple(
    replace(c, unit="V", meaning="mean pickoff voltage")
    if c.name == "mean"
    else replace(c, unit="V")
    if c.name == "std"
    else c
    for c in WINDOW_COLUMNS
)
MEASURED = laboratory_rows(TEMPLATE, needed={"gain": "1", "drift": "2deg/h"}, columns=COLUMNS)
