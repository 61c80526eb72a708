"""A laboratory's record of a gyro's dynamics: a row for each frequency, or samples over time of steps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.record.csv_reader import CsvColumn, read_head
from gyrobench.record.record import Record
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# Dynamics of a floated gyro on a table with angular vibration, its loop open: one row for each frequency, at least
# eight.
# instrument = type and number of the gyro
# operator = who took the record
# axis = input
# K_sg = 10V/rad
# H = 0.2N.m.s
#
# axis: of the gyro along that of the table, input or output.  H: spin angular momentum; leave it out if it is not
#   known, then no stiffness is given.
# frequency: of the vibration.  table: amplitude of its angle.  pickoff: amplitude of the voltage.
# phase: of the pickoff against the angle of the table, negative where it lags (about the output axis near -90 deg).
# u: relative standard uncertainty of pickoff over table, as of its phase in rad; optional, then it follows from the
#   scatter about the fitted curve.
#
# Steps instead: columns `time [s],table [arcmin],pickoff [V]`, samples of the table's angle and the voltage while the
#   table turns quickly from one angle to another and rests at each, at least three times; the time constant alone.
frequency [Hz],table [arcmin],pickoff [V],phase [deg]
"""
SINES = (
    CsvColumn("frequency", "Hz", "frequency of the vibration"),
    CsvColumn("table", "rad", "amplitude of the table angle"),
    CsvColumn("pickoff", "V", "amplitude of the pickoff voltage"),
    CsvColumn("phase", "rad", "phase of the pickoff against the table"),
    CsvColumn("u", "1", "relative standard uncertainty of the ratio", required=False),
)
STEPS = (
    CsvColumn("time", "s", "time of the sample"),
    CsvColumn("table", "rad", "angle of the table"),
    CsvColumn("pickoff", "V", "pickoff voltage"),
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return a record of sines, or of steps where the file has a column of time."""
    names = {n.split("[")[0].strip() for n in read_head(data).names}
    steps = "time" in names
    return read_record(
        system, data, values, columns=STEPS if steps else SINES, time="time" if steps else None,
        needed={"K_sg": "10V/rad"},
    )  # fmt: skip


MEASURED = MeasuredData(TEMPLATE, read)
