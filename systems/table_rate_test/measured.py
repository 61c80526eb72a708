"""A laboratory's record of a rate test: which columns it has, and how it becomes a record."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gyrobench import units
from gyrobench.record.csv_reader import CsvColumn, DataError
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

ERU = units.factor("ERU")
WRONG = 0.1  # relative: a reading that far from the rate commanded is another unit or another sense
TEMPLATE = """\
# Rate test of a table: one row for each of at least three windows at a rate, one after the other without a gap.
# quantum = 0.18arcsec
# instrument = type and number of the table
# operator = who took the record
#
# quantum (angle of one count of the reader): needed, here or by --set.
# phase: number of the rate, from 1; each rate in each sense is one.  rate: commanded, with its sign.
# angle: cumulative reading of the table at the ends of the window, counted on through the turns.
# error, error_std: mean of the tracking error (command less reading) over the window, and its standard deviation.
# u_angle1, u_angle2, u_cycle: amplitudes of the errors of the readings once and twice a turn and in a cycle of the
#   scale; they are in u with their defaults unless set.  u_reading: noise of a reading beyond its rounding.
# Units in brackets may be others of the same kind (deg/s, rad, min ...).
phase,t_start [s],t_end [s],rate [ERU],angle_start [deg],angle_end [deg],error [arcsec],error_std [arcsec]
"""
COLUMNS = (
    CsvColumn("phase", "1", "number of the rate, from 1", whole=True),
    CsvColumn("t_start", "s", "start of the window"),
    CsvColumn("t_end", "s", "end of the window"),
    CsvColumn("rate", "rad/s", "rate commanded"),
    CsvColumn("angle_start", "rad", "reading at the start, cumulative"),
    CsvColumn("angle_end", "rad", "reading at the end, cumulative"),
    CsvColumn("error", "rad", "mean tracking error"),
    CsvColumn("error_std", "rad", "standard deviation of the tracking error"),
)


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record.  Raises DataError."""
    record = read_record(system, data, values, columns=COLUMNS, needed={"quantum": "0.18arcsec"})
    w = record.windows
    w["mean"], w["std"] = w.pop("error"), w.pop("error_std")
    rate, problems = w.pop("rate"), []
    for p in np.unique(w["phase"]):
        of = np.flatnonzero(w["phase"] == p)
        first = float(rate[of[0]])
        if np.ptp(rate[of]) > 0.0 or first == 0.0:
            problems.append(f"phase {p}: one rate that is not 0 is expected in all its rows")
            continue
        if of.size < 3:
            problems.append(f"phase {p}: {of.size} windows; three at least are needed")
        read = (w["angle_end"][of] - w["angle_start"][of]) / (w["t_end"][of] - w["t_start"][of])
        off = of[np.abs(read / first - 1.0) > WRONG]
        if off.size:
            problems.append(
                f"phase {p}, {off.size} rows: the angles turn at {read[np.searchsorted(of, off[0])] / ERU:.6g} ERU and "
                f"not at {first / ERU:.6g} ERU; check units and sense"
            )
        label = f"{first / ERU:+.6g} ERU"
        record.run.plan.append(PlanRow(phase=int(p), label=label, mode="rate", face="table", target=first))
    if problems:
        raise DataError(data, problems)
    record.run.parameters["reader.quantum"] = float(system["quantum"])
    record.run.options["rates"] = " ".join(dict.fromkeys(f"{abs(row.target) / ERU:.6g}" for row in record.run.plan))
    return record


MEASURED = MeasuredData(TEMPLATE, read)
