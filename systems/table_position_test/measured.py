"""A laboratory's record of a position test: which columns it has, and how it becomes a record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench.record.csv_reader import READING_TIMES, CsvColumn, DataError
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

FAR = {"deviation": 0.01, "second": 0.1}  # rad: no autocollimator reads that, no head is that far from its place
TEMPLATE = """\
# Position test of a table: one row for each visit of a position, in the order of the visits.
# positions = 12
# head = 180deg
# quantum = 0.18arcsec
# orders = 3
# u_scale = 0
# instrument = type and number of the table
# operator = who took the record
#
# positions (faces of the polygon), head (angle between the two reading heads), quantum (angle of one count): needed,
#   here or by --set.  orders: harmonics of the position error.  u_scale: relative
#   standard uncertainty of the scale of the autocollimator, by its certificate; no residual shows it.
# mount: azimuth of polygon and level on the table, whole faces.  position: commanded, counted on through the turns, so
#   that 360 deg and 0 deg are the same place and the way to it shows.
# deviation: reading of the autocollimator, positive where the table has turned too far.  tracking: mean error of the
#   counts (command less reading) meanwhile.  second: reading of the second head.  level_x, level_y: of the level.
# Units in brackets may be others of the same kind (rad, deg ...).
""" + (
    "t_start [s],t_end [s],mount [deg],position [deg],deviation [arcsec],tracking [arcsec],second [deg],"
    "level_x [arcsec],level_y [arcsec]\n"
)
COLUMNS = (
    *READING_TIMES,
    CsvColumn("mount", "rad", "azimuth of polygon and level on the table"),
    CsvColumn("position", "rad", "position commanded, cumulative"),
    CsvColumn("deviation", "rad", "reading of the autocollimator"),
    CsvColumn("tracking", "rad", "mean error of the counts"),
    CsvColumn("second", "rad", "reading of the second head"),
    CsvColumn("level_x", "rad", "reading of the level, x"),
    CsvColumn("level_y", "rad", "reading of the level, y"),
)
NEEDED = {"positions": "12", "head": "180deg", "quantum": "0.18arcsec"}


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record.  Raises DataError."""
    record = read_record(system, data, values, columns=COLUMNS, needed=NEEDED)
    w = record.windows
    mount, position = w.pop("mount"), w.pop("position")
    w["mean"] = w.pop("deviation")
    w["phase"] = np.arange(1, position.size + 1)
    w["angle_start"] = w["angle_end"] = position
    pitch = 2.0 * math.pi / int(system["positions"])
    problems = []
    for name, x in (("mount", mount), ("position", position)):
        off = np.flatnonzero(np.abs(x / pitch - np.round(x / pitch)) > 1e-6)
        if off.size:
            problems.append(
                f"{name}: {math.degrees(x[off[0]]):g} deg in row {off[0] + 1} of {off.size} is not a whole face of "
                f"{math.degrees(pitch):g} deg; check positions = {system['positions']} and the unit"
            )
    apart = w["second"] - position
    for name, x in (("deviation", w["mean"]), ("second", apart - 2 * math.pi * np.round(apart / (2 * math.pi)))):
        far = np.flatnonzero(np.abs(x) > FAR[name])
        if far.size:
            problems.append(
                f"{name}: {far.size} readings are more than {math.degrees(FAR[name]):.2g} deg from the position "
                f"(first: row {far[0] + 1}); check the unit, and that 'second' reads the position without the angle of "
                "the head"
            )
    if 2 * int(system["orders"]) >= int(system["positions"]):
        problems.append(f"orders = {system['orders']}: at most {(int(system['positions']) - 1) // 2} follow")
    if problems:
        raise DataError(data, problems)
    degrees = np.round(np.degrees(mount), 6)
    record.run.plan = [
        PlanRow(phase=k, label=f"{math.degrees(x):g}°", mode="index", face=f"mount {b:g}°", target=float(x))
        for k, (x, b) in enumerate(zip(position, degrees, strict=True), 1)
    ]
    record.run.options["mounts"] = " ".join(dict.fromkeys(f"{b:g}" for b in degrees))
    record.run.parameters |= {f"{n}.quantum": float(system["quantum"]) for n in ("reader", "reader_2")}
    return record


MEASURED = MeasuredData(TEMPLATE, read)
