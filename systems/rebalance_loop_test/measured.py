"""A laboratory's record of a rebalance loop: which columns it has, and how it becomes a record."""

from __future__ import annotations

from gyrobench.system.lab_record import laboratory_rows
from gyrobench.system.system import System

TEMPLATE = """\
# Test of a rebalance loop: one row for each reading of the current, at rest and at rates along the input axis.
# latitude = 45.75deg
# k = 17.2deg/h/mA
# range = 0.95deg/s
# gate = 1s
# phase 1 = rest
# phase 2 = turning
# phase 3 = turning
# phase 4 = rest
# instrument = type and number of the loop
# operator = who took the record
#
# latitude, k (torquer scale factor), range (largest rate; nonlinearities are given there), gate (length of a reading):
#   needed, here or by --set.
# phase N: rest, or turning at one rate; the input axis points up along the table axis.  Rates there and back keep a
#   trend in time out of the nonlinearities.  Rates felt below 2 % of range, in both senses, give the threshold.
# angle: of the table, right-handed about the upward axis, counted on through the turns.
# mean: current of the reading, from the counts I (n+ - n-)/(n+ + n-) of a loop that counts, positive where it precesses
#   positively.  std (of the samples), flagged (suspect samples): optional.
# Units in brackets may be others of the same kind (min, arcsec, uA ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA],std [mA],flagged
"""
NEEDED = {"latitude": "45.75deg", "k": "17.2deg/h/mA", "range": "0.95deg/s", "gate": "1s"}
REST, TURNING = "rest", "turning"


def attitudes(system: System) -> dict[str, str]:
    """Return what a phase may be called, with the mode of the table in it."""
    return {REST: "hold", TURNING: "rate"}


MEASURED = laboratory_rows(TEMPLATE, needed=NEEDED, attitudes=attitudes)
