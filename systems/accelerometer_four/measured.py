"""A laboratory's record of four accelerometers read together in the positions of a head."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.record.csv_reader import WINDOW_COLUMNS, CsvColumn, DataError
from gyrobench.record.record import Record
from gyrobench.system.lab_record import of_positions, read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# Four accelerometers a quarter of a turn apart on one indexing head, read together: one row for each position.
# gravity = 9.8067m/s2
# points = 24
# D1c = 3.1arcsec
# D1s = -0.4arcsec
# u_D1 = 0.1arcsec
# instrument = types and numbers of the accelerometers
# operator = who took the record
#
# gravity, points (positions a turn, 16 to 24): needed, here or by --set.
# D1c, D1s, u_D1: first harmonic of the head's angle error, D1c cos(angle) + D1s sin(angle), from an autocollimator
#   in the same positions, with its standard uncertainty; or d1_unknown = true: three coefficients of each are biased.
# angle: nominal angle of the head; the input axis of sensor 1 is level at angle 0 and rises with the angle, those of
#   2, 3, 4 are 90, 180, 270 degrees ahead.  mean, mean_2, mean_3, mean_4: voltages of the sensors at the same time.
# Units in brackets may be others of the same kind (min, mV ...).
phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [V],mean_2 [V],mean_3 [V],mean_4 [V]
"""
COLUMNS = (
    *(c for c in WINDOW_COLUMNS if c.name not in ("mean", "std")),
    CsvColumn("mean", "V", "mean voltage of sensor 1"),
    *(CsvColumn(f"mean_{i}", "V", f"mean voltage of sensor {i}") for i in (2, 3, 4)),
    CsvColumn("std", "V", "standard deviation of the samples of sensor 1", required=False),
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record; D1c and D1s must be given, or said to be unknown."""
    record = read_record(system, data, values, needed={"gravity": "9.8067m/s2", "points": "24"}, columns=COLUMNS)
    if not system["d1_unknown"] and not {"D1c", "D1s"} <= set(system.given):
        raise DataError(data, [
            "D1c and D1s are not given: write '# D1c = 3.1arcsec' and '# D1s = -0.4arcsec' in the file, from an "
            "autocollimator or a polygon, or 'd1_unknown = true' (K_F, K_IO and K_II are biased by K_I D1 then)"
        ])  # fmt: skip
    return of_positions(record)


MEASURED = MeasuredData(TEMPLATE, read)
