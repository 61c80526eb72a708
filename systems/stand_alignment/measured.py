"""A laboratory's sights of Polaris or a north finder, of a mirror on the stand, and of its axis by an inclinometer."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import CsvColumn
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

TEMPLATE = """\
# Alignment of a test stand: a row for each sight, in both faces of the theodolite.
# latitude = 45.7501deg
# longitude = 126.6300deg
# start = 2026-11-28T12:00
# ut1_utc = 0.05s
# pressure = 1013hPa
# air = 283K
# instrument = types and numbers of theodolite, mirror and inclinometer
# operator = who took the sights
#
# latitude, longitude (east positive), start (UTC from which the times count): needed, here or by --set.
# target: 1 Polaris, 2 the mirror by autocollimation, 3 the axis by the inclinometer, 4 (in place of 1) the mirror on a
#   north finder's head, of the azimuth "heading"; negative: face right, and the inclinometer turned round.  As many of
#   each sign, two at least.
# mean: horizontal circle, from north to east, face right less 180 deg; of target 3 the inclinometer, the elevation of
#   the axis.  level: plate level across the line of sight, positive where the right of the instrument is low; 0 with 3.
# Units in brackets may be others of the same kind (min, rad, arcsec ...).
phase,t_start [s],t_end [s],target,mean [deg],level [arcsec]
"""
COLUMNS = (
    CsvColumn("phase", "1", "number of the sight"),
    CsvColumn("t_start", "s", "begin of the sight"),
    CsvColumn("t_end", "s", "end of the sight"),
    CsvColumn("target", "1", "1 star, 2 mirror, 3 axis, 4 head; negative: face right"),
    CsvColumn("mean", "rad", "horizontal circle, or inclinometer"),
    CsvColumn("level", "rad", "plate level across the line of sight"),
)
NAMES = {1: "star", 2: "mirror", 3: "axis", 4: "head"}


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record."""
    needed = {"latitude": "45.75deg", "longitude": "126.63deg", "start": "2026-11-28T12:00"}
    record = read_record(system, data, values, needed=needed, columns=COLUMNS)
    windows = dict(record.windows)
    target = np.asarray(windows.pop("target"), dtype=float)
    windows |= {"angle_start": target, "angle_end": target}
    numbers = np.asarray(windows["phase"]).astype(int).tolist()
    plan = [
        PlanRow(
            phase=p,
            label=f"{NAMES.get(abs(int(c)), 'sight')}, {'left' if c > 0 else 'right'}",
            mode="hold",
            face="stand",
        )
        for p, c in dict(zip(numbers, target.tolist(), strict=True)).items()
    ]
    return Record(windows, {}, record.run.replace(plan=plan))


MEASURED = MeasuredData(TEMPLATE, read)
