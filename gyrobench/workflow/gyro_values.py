"""Noise of a drift record as values of a gyro of the bench: a file for ``--set @FILE``.  [DRIFT-RANDOM-ALLAN]"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gyrobench.bench import Bench, UsageError
from gyrobench.component import Parameter
from gyrobench.files import write_whole
from gyrobench.packaging import load_part
from gyrobench.record.record import Record
from gyrobench.reduction.series.gyro_noise import FLICKER_HIGH, FLICKER_LOW, gyro_noise
from gyrobench.reduction.series.noise_coefficients_table import TERMS
from gyrobench.result import Coefficient, Result
from gyrobench.units import DPH

NEEDED = ("white", "flicker", "flicker_tau", "walk", "ramp", "quantization", "quantization_tau")
SHARED = ("flicker_tau", "quantization_tau", "markov_tau")  # by the channels of a gyro
#: parameter -> the coefficient that sets it
OF = {"white": "N", "flicker": "B", "walk": "K", "ramp": "R", "quantization": "Q"}


def channels_of(part: str) -> Sequence[str]:
    """Return the endings of the noise parameters of a gyro: "" or "_x", "_y".  Raises UsageError for another part."""
    declared = load_part(part, Bench.find().folder).declarations
    for channels in ([""], ["_x", "_y"]):
        if all(isinstance(declared.get(named(n, c)), Parameter) for n in NEEDED for c in channels):
            return channels
    raise UsageError(f"--fit-to {part}: it has no parameters {', '.join(NEEDED)}; floated_gyro has")


def named(parameter: str, channel: str) -> str:
    """Return the name of a parameter of a channel."""
    return parameter if parameter in SHARED else parameter + channel


def columns_of(result: Result) -> Mapping[str, Mapping[str, Coefficient]]:
    """Return the noise coefficients of a result: column -> N, B, K, R, Q."""
    columns: dict[str, dict[str, Coefficient]] = {}
    for c in result.coefficients:
        term, _, column = c.name.partition(" ")
        if term in TERMS and c.unit == TERMS[term][0]:  # of a gyro
            columns.setdefault(column, {})[term] = c
    return {name: terms for name, terms in columns.items() if len(terms) == len(TERMS)}


def model_of(result: Result, index: int) -> tuple[dict[str, float], list[tuple[float, float]]]:
    """Return the noise model of a column of a drift record: N, B, K, R, Q and its Gauss-Markov processes, rms and
    correlation time, the largest first, SI.  Raises UsageError where none describes the record.
    """
    column = [c for c in getattr(result, "columns", []) if c.unit == "°/h"][index]
    tables = {t.id: t.rows for t in column.tables["model"]}
    if "terms" not in tables:
        raise UsageError("--fit-to: no noise model describes the record, its report says why; there are no values")
    values = {str(row[0]): float(row[1]) * TERMS[row[0]][1] for row in tables["terms"]}
    processes = [(DPH * float(row[2]), float(row[5])) for row in tables.get("gauss_markov", [])]
    return {term: values.get(term, 0.0) for term in TERMS}, sorted(processes, reverse=True)


def write_gyro_values(result: Result, record: Record, part: str, file: Path) -> None:
    """Write values with which a gyro of the bench has the noise of a record.  Raises UsageError.

    One column serves both channels of a gyro with two; two columns are x and y in their order.
    """
    channels, columns = channels_of(part), columns_of(result)
    if not columns:
        raise UsageError(f"--fit-to {part}: {result.system} gives no coefficients N, B, K, R, Q; drift_record does")
    if len(columns) > len(channels):
        raise UsageError(
            f"--fit-to {part}: the record has the columns {', '.join(columns)}; {part} has {len(channels)} "
            f"channel{'s'[: len(channels) - 1]}: choose by --set channel=NAME"
        )
    start, end = (np.asarray(record.windows[n], dtype=float) for n in ("t_start", "t_end"))
    series = getattr(record.run, "series", None)
    interval = float(series["acquisition"]["step"]) if series else float(np.median(end - start))
    duration = float(end[-1] - start[0])
    source = record.run.data.file if record.run.data else f"run of {record.run.system}, seed {record.run.seed}"
    lines = [
        f"# Noise of {source} ({duration:g} s) for {part}, SI: gyrobench run SYSTEM --set @{file.name}",
        "# The table is named as the slot of the gyro. N holds the noise of the reading too: set rebalance.meter to 0.",
        *(f"# Warning of the reduction: {text}" for text in result.warnings),
        "[gyro]",
    ]
    written: dict[str, str] = {}
    for number, channel in enumerate(channels):
        column = min(number, len(columns) - 1)
        coefficients = list(columns.values())[column]
        noise, found = model_of(result, column)
        for name, value in gyro_noise(noise, interval, duration, found[0] if found else (0.0, 0.0)).items():
            term = OF.get(name)
            said = f"  # {_words(coefficients[term], noise[term] > 0.0)}" if term else ""
            if name == "flicker_tau":
                said = f"  # flicker from {FLICKER_LOW / value:.2g} to {FLICKER_HIGH / value:.2g} Hz"
            if name == "markov" and len(found) > 1:
                said = f"  # the largest of {len(found)} processes; the gyro lacks " + ", ".join(
                    f"{s!r} rad/s of {tau:.6g} s" for s, tau in found[1:]
                )
            written.setdefault(named(name, channel), f"{named(name, channel)} = {value!r}{said}")
    write_whole(file, ("\n".join([*lines, *written.values()]) + "\n").encode())


def _words(c: Coefficient, there: bool) -> str:
    if c.no_value:
        return f"{c.name}: of the model as a whole, alone {c.no_value}" if there else f"{c.name}: {c.no_value}"
    low, high = c.interval
    return f"{c.name} = {c.estimate:.4g} {c.unit} ({low:.4g} to {high:.4g})"
