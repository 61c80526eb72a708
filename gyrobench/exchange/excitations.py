"""Excitations of a loop test in the record of another tool, held against the values that the reduction divides by.

A tool may set a parameter of the exported system (a load of 2 N.m in place of 1), and its file need not state it.
"""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import AnyArray
from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow

PHASE, GATE = "exciter.phase", "exciter.gate"
#: what a phase excites -> output of the exciter
SIGNALS = {"torque": "torque", "command": "command", "test": "test", "motion": "motion_angle"}
TOLERANCE = 1e-3  # of a size: six digits of a file, and a sine of some samples a period
LEAST = 4  # samples in a phase


def check_excitations(record: Record) -> None:
    """Raise DataError where the file has an excitation of another size than the values of the run say."""
    channels, sizes = record.channels, record.run.parameters.get("exciter.amplitudes")
    if sizes is None or not {PHASE, GATE} <= channels.keys():
        return
    wrong = []
    for row in record.run.plan:
        name = f"exciter.{SIGNALS.get(row.mode, '')}[{row.axis}]"
        inside = (channels[PHASE] == row.phase) & (channels[GATE] > 0.5)
        if name not in channels or np.count_nonzero(inside) < LEAST:
            continue
        there, here = _size(row, channels["time"][inside], channels[name][inside]), float(sizes[row.phase - 1])
        here = abs(here) if row.shape == "sine" else here
        if abs(there - here) > TOLERANCE * abs(here):
            wrong.append(f"phase {row.phase} '{row.label}': {name} has {there:.4g} {row.unit}, here it is {here:.4g}")
    if wrong:
        raise DataError(record.run.data.file if record.run.data else "the file", [
            *wrong, "the run had other values; give the same with --set as there",
        ])  # fmt: skip


def _size(row: PlanRow, t: AnyArray, y: AnyArray) -> float:
    """Return the amplitude of a sine, or the value of a step that is farthest from 0."""
    if row.shape != "sine":
        return float(y[np.argmax(np.abs(y))])
    turned = 2.0 * np.pi * row.frequency * (t - t[0])
    parts = np.linalg.lstsq(np.column_stack([np.sin(turned), np.cos(turned)]), y, rcond=None)[0]
    return float(np.hypot(*parts))
