"""A laboratory's drift record of any length: rates, angles, specific forces, counts; CSV, Parquet, a run's channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record import drift_columns, sampling
from gyrobench.record.circumstances import Keys, faults
from gyrobench.record.csv_reader import DataError
from gyrobench.record.drift_series import DriftReader, Progress, as_dict
from gyrobench.record.record import Record
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.reduction.series.deviations import KINDS, DeviationAccumulator
from gyrobench.reduction.series.quantization import angle_quantization, quantization
from gyrobench.system.lab_record import ELSEWHERE, TEXTS, measured_run, set_options
from gyrobench.system.system import MeasuredData, System
from gyrobench.system.values import InvalidValueError

ATTITUDE = "at rest"
EXACT = 1e-15  # of an angle: to which decimals of a file are exact
NUMBERS = ("deviation", "low", "high", "edf", "count", "exponent")  # of a deviation
TEMPLATE = """\
# Drift record of a gyro at rest: one row a sample, evenly spaced; CSV or Parquet, any number of rows.
# instrument = type and number of the gyro
# operator = who took the record
#
# time: of the sample; or no such column, and a line '# sampling = 100Hz'.  Rows may be missing: gaps are found.
# Columns to reduce, one or several, any names: a rate [deg/h], an angle [arcsec], a specific force [g] (all of an IMU
#   together: names gyro_x ... acc_z make triads), or another quantity and a line
#   '# scale = 17.2deg/h/mA', of counts '# scale = 0.5arcsec'.  Angles and counts are cumulative (resets are found), or
#   those of one sample each (velocities [m/s] too): '# counts = increments'.  Some columns of many: '# channel = x y'.
# temperature [degC], and columns named by '# regressors = pressure', are taken out by regression, and harmonics over
#   the angle of the table: '# angle = table_angle', '# harmonics = 2'.
# flag: other than 0 where a sample is suspect.  What the samples are: '# samples = means' (each since the one before)
#   or points, of a signal of '# bandwidth = 14Hz'.
time [s],rate [deg/h]
"""


def read(system: System, data: Path, values: Mapping[str, str], progress: Progress | None = None) -> Record:
    """Return the record of a file or a run's folder: windows with rates in rad/s, forces in m/s², gaps as NaN.

    run.series: acquisition, and how many samples a window is the mean of.  Raises DataError and InvalidValueError.
    """
    table = drift_columns.open_table(data, values.get("channel", ""))
    said = {**table.head.comments, **values}
    for name in values:
        if name in ELSEWHERE:
            raise InvalidValueError(f"{name}: {ELSEWHERE[name]}")
        if name not in system.options and name not in (*TEXTS, "samples"):
            system.set(name, values[name])  # says which options there are
    problems = faults(table.head.statements, Keys((*system.options, *TEXTS, "samples"), elsewhere=ELSEWHERE))
    problems += set_options(system, table.head.statements, values)
    if system["counts"] not in ("cumulative", "increments"):
        problems.append(f"counts = {system['counts']}: must be 'cumulative' or 'increments'")
    kind = ""
    try:
        kind, _ = sampling.stated({k: v for k, v in said.items() if k == "samples"})
    except ValueError as error:
        problems.append(str(error))
    try:
        table, signals, reader = _opened(system, table, "counts" in said)
        if problems:
            for _ in table.blocks(reader.columns):  # what is wrong with the rows is in the same list
                pass
    except DataError as error:
        problems += error.problems
    if problems:
        raise DataError(data, problems)
    every = {s.name: _Every(reader) for s in signals}
    columns = reader.read(lambda name, first, values: every[name].add(first, values), progress)
    about = reader.about
    length = about.step * reader.held.factor
    middle = columns.pop(drift_columns.TIME)
    there, place = np.isfinite(middle), np.arange(float(middle.size))
    start = np.interp(place, place[there], middle[there]) - 0.5 * (length - about.step)
    windows: dict[str, Any] = {"t_start": start, "t_end": start + length, **columns}
    run = measured_run(system, [], {n: said[n] for n in TEXTS if n in said})
    si = {c.name: c.unit for c in reader.columns}
    run.window_units = {
        "t_start": "s",
        "t_end": "s",
        **{n: si[n] for n in reader.others},
        **{s.name: s.reduced for s in signals},
    }
    run.series = {
        "columns": {
            s.name: {
                "kind": s.kind,
                "unit": s.unit,
                **_rounding(s, reader.beginning[s.name], reader.steps),
                "alike": reader.equal.share(s.name) if s.kind in drift_columns.DIRECT else 0.0,
            }
            for s in signals
        },
        "others": reader.others,
        "unused": [n for n in drift_columns.named(table.head) if n not in si] if data.is_file() else [],
        "stated": [n for n in ("latitude", "gravity") if n in system.given],
        "factor": reader.held.factor,
        "samples": kind,
        "acquisition": as_dict(about),
    }
    if reader.held.factor > 1:
        run.series["deviations"] = {name: e.result() for name, e in every.items()}
    return Record(windows, {}, run)


def _opened(
    system: System, table: drift_columns.DriftTable, stated: bool
) -> tuple[drift_columns.DriftTable, list[drift_columns.Signal], DriftReader]:
    """Return the table with what is to be read of it.  stated: what an angle is.  Raises DataError."""
    regressors = system["regressors"]
    if system["angle"]:
        table = drift_columns.with_harmonics(table, system["angle"], system["harmonics"])
        regressors = " ".join([regressors, *drift_columns.harmonic_names(system["harmonics"])])
    signals = drift_columns.find_signals(table, system["channel"], system["scale"], system["counts"] == "increments")
    return table, signals, DriftReader(table, signals, regressors, system["sampling"], stated)


def _rounding(s: drift_columns.Signal, values: Array, angles: Mapping[str, Sequence[float]]) -> dict[str, Any]:
    """Return the step to which rates, forces or an angle (SI) are rounded, 0: none; whether it is a white error.

    values: rates, or increments of the angle; angles: least and largest increment and largest value of those that are
    cumulative, whose rounding in the computer their increments have.
    """
    counts, step, largest = values / s.factor, 0.0, angles[s.name][2] if s.name in angles else 0.0
    if s.unit in ("", "1") and s.kind not in drift_columns.DIRECT and np.all(np.abs(counts - np.rint(counts)) < 1e-6):
        step = abs(s.factor)
    if largest and not step:
        values = np.rint(values / (EXACT * largest)) * (EXACT * largest)
    try:
        q = quantization(values) if s.kind in drift_columns.DIRECT else angle_quantization(values, step)
    except SeriesError:
        return {"resolution": step, "white": not step}  # all the same number of counts
    return {"resolution": q.step, "white": q.white}


class _Every:
    """Deviations of every sample of a column, where the record holds means."""

    def __init__(self, reader: DriftReader) -> None:
        self.about = reader.about
        self.sums = DeviationAccumulator(1.0, KINDS)  # the step is known in the end
        self.next = 0

    def add(self, first: int, values: Array) -> None:
        """Add samples without a gap between them; first: index on the grid."""
        if self.next:
            self.sums.add(np.full(first - self.next, np.nan))
        self.sums.add(values)
        self.next = first + values.size

    def result(self) -> dict[str, dict[str, Any]]:
        step = self.about.step
        return {
            kind: {"tau": (d.tau * step).tolist(), **{n: getattr(d, n).tolist() for n in NUMBERS}}
            for kind, d in self.sums.result().items()
        }


MEASURED = MeasuredData(TEMPLATE, read, progress=True)
