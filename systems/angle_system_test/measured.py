"""A laboratory's record of an angle system test: which columns it has, and how it becomes a record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.csv_reader import READING_TIMES, CsvColumn, DataError
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow
from gyrobench.system.lab_record import read_record
from gyrobench.system.system import MeasuredData, System

from .readings import in_turn, middle

ERU = units.factor("ERU")
METHODS = ("two_heads", "reversal")
FAR = 0.1  # rad: a reading does not follow the position
OTHER = 0.05  # of a rate: the reference turns at another one
TEMPLATE = """\
# Angle reading system: one row for each position of the table, then one for each reading at each rate.
# method = two_heads
# head = 50.1deg
# quantum = 0.18arcsec
# reference_quantum = 0.18arcsec
# instrument = type and number of the reader
# operator = who took the record
#
# method: two_heads, or reversal (the scale turned on its shaft by the angle head; then reading_2 is left out).
# head (angle between the two readings of the scale), quantum (angle of one count): needed, here or by --set.
#   reference_quantum: of the reference, if it differs.
# phase: number of the position or rate, from 1.  rate: 0 at a position.  position: of the table, at least 30 all
#   around, at irregular angles, in an irregular order (else a drift of the heads looks like an error once a turn); 0 at
#   a rate.  turned: 1 at positions after the scale was turned, else 0.
# reading, reading_2: of the scale.  reference: of the reference encoder.  t_reading, t_reference: when they were taken,
#   if not at t_end.
# gate_..., inverse_...: readouts of the rate by gates of time or by the time of a degree: number of the reading, rate,
#   start, end; optional, four columns each.
# Units in brackets may be others of the same kind (deg/s, rad ...).
phase,t_start [s],t_end [s],rate [ERU],position [deg],turned,reading [deg],reading_2 [deg],reference [deg]
"""
READOUTS = tuple(
    CsvColumn(f"{of}_{name}", unit, f"{name} of a reading of the {meaning}", required=False)
    for of, meaning in (("gate", "gate"), ("inverse", "inverse rate"))
    for name, unit in (("number", "1"), ("rate", "rad/s"), ("start", "s"), ("end", "s"))
)
COLUMNS = (
    CsvColumn("phase", "1", "number of the position or rate, from 1", whole=True),
    *READING_TIMES,
    CsvColumn("rate", "rad/s", "rate of the table, 0 at a position"),
    CsvColumn("position", "rad", "position of the table"),
    CsvColumn("turned", "1", "1 after the scale was turned on its shaft", required=False, whole=True),
    CsvColumn("reading", "rad", "reading of the scale"),
    CsvColumn("reading_2", "rad", "reading of the scale by the second head", required=False),
    CsvColumn("reference", "rad", "reading of the reference"),
    CsvColumn("t_reading", "s", "instant of the reading", required=False),
    CsvColumn("t_reference", "s", "instant of the reference", required=False),
    *READOUTS,
)
NEEDED = {"head": "50.1deg", "quantum": "0.18arcsec"}


def read(system: System, data: Path, values: Mapping[str, str]) -> Record:
    """Return the CSV as a record.  Raises DataError."""
    record = read_record(system, data, values, columns=COLUMNS, needed=NEEDED)
    w, problems = record.windows, []
    rate, position = w.pop("rate"), w.pop("position")
    turned = w.pop("turned", np.zeros(rate.size)) != 0
    for readout in ("gate", "inverse"):
        names = [c.name for c in READOUTS if c.name.startswith(readout)]
        there = [n for n in names if n in w]
        if there and len(there) < len(names):
            problems.append(
                f"{', '.join(sorted({*names} - {*there}))}: missing; a readout has all of {', '.join(names)}"
            )
        w |= {n: np.zeros(rate.size) for n in names if n not in w}
    for instant in ("t_reading", "t_reference"):
        w.setdefault(instant, w["t_end"])
    reversal = system["method"] == "reversal"
    if system["method"] not in METHODS:
        problems.append(f"method = {system['method']}: {' or '.join(METHODS)}")
    if reversal and not (np.any(turned) and np.any(~turned & (rate == 0.0))):
        problems.append("method = reversal: positions with turned = 0 and with turned = 1 are expected")
    elif reversal:
        w["reading_2"] = _second(w["reading"], w["reference"], turned, ~turned & (rate == 0.0))
    elif "reading_2" not in w:
        problems.append("column 'reading_2 [rad]' is missing: the second head; or write '# method = reversal'")
    for p in np.unique(w["phase"]):
        of = np.flatnonzero(w["phase"] == p)
        if np.ptp(rate[of]) > 0.0 or np.ptp(position[of]) > 0.0:
            problems.append(f"phase {p}: its rows have several rates or positions; give each a number of its own")
        at, w_p = float(position[of[0]]), float(rate[of[0]])
        label = f"{w_p / ERU:g} ERU" if w_p else ("turned " if turned[of[0]] else "") + f"{math.degrees(at):.2f}°"
        mode = "rate" if w_p else "index"
        record.run.plan.append(PlanRow(phase=int(p), label=label, mode=mode, face="table", target=w_p or at))
    problems += _unlike(w, position, (rate == 0.0) & ~turned)
    problems += _turning_otherwise(w, rate)
    if problems:
        raise DataError(data, problems)
    quantum = float(system["quantum"])
    record.run.parameters |= {
        "reader.quantum": quantum,
        "reference.quantum": float(system["reference_quantum"]) or quantum,
    }
    return record


def _unlike(w: Mapping[str, Array], position: Array, rest: NDArray[np.bool_]) -> list[str]:
    """Return which readings do not turn with the position, but for a constant."""
    found = []
    for name in ("reading", "reading_2", "reference"):
        apart = (w[name] - position)[rest] if name in w else np.zeros(0)
        off = np.abs(in_turn(apart - middle(apart))) > FAR if apart.size else apart > 0.0
        if np.any(off):
            found.append(
                f"{name}: does not follow the position in {np.count_nonzero(off)} of {off.size} rows at rest; check "
                "unit and sense"
            )
    return found


def _turning_otherwise(w: Mapping[str, Array], rate: Array) -> list[str]:
    """Return at which rates the reference turns at another one, of the other sense or in another unit."""
    found = []
    for p in np.unique(w["phase"][rate != 0.0]):
        of = w["phase"] == p
        turned, went = np.diff(w["reference"][of]), rate[of][1:] * np.diff(w["t_reference"][of])
        if went.size < 3:
            continue
        off = float(np.median(np.abs(in_turn(turned - went))))
        if off > OTHER * float(np.median(np.abs(went))):
            seen = float(np.median(in_turn(turned) / np.diff(w["t_reference"][of]))) / ERU
            found.append(
                f"phase {p}: by its readings the reference turns at {seen:.4g} ERU, rate says "
                f"{float(rate[of][0]) / ERU:.4g} ERU; check sign and unit of the rate, and the times"
            )
    return found


def _second(reading: Array, reference: Array, turned: NDArray[np.bool_], first: NDArray[np.bool_]) -> Array:
    """Return the one head of a reversal as the second one: at the first turn the reading, moved by the angle turned."""
    apart = reading - reference
    return np.where(turned, reading, reading + middle(apart[turned]) - middle(apart[first]))


MEASURED = MeasuredData(TEMPLATE, read)
