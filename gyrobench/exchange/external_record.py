"""A record from time series that another tool has produced: from an exported system, or from a logger."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.record.record import WHOLE, Record
from gyrobench.record.run_document import RunDocument
from gyrobench.system.system import System

Array = np.ndarray[Any, np.dtype[np.float64]]


def record_from_series(system: System, series: Mapping[str, Array], run: RunDocument | None = None) -> Record:
    """Return the record of a run that another tool did.

    series: "slot.output" -> samples at every communication step, for the watched output and all columns of
    ``system.windows``.  A window is complete where the watched output changes, as in runs of the bench.  Raises
    KeyError naming the series that are missing.
    """
    assert system.windows is not None, f"{system.name} has no windows"
    names = [system.windows.watch, *system.windows.columns.values()]
    missing = [n for n in names if n not in series]
    if missing:
        raise KeyError(f"series missing: {', '.join(missing)}")
    count = np.asarray(series[system.windows.watch], dtype=float)
    at = np.flatnonzero(np.diff(count) != 0.0) + 1
    columns = {}
    for name, source in system.windows.columns.items():
        column = np.asarray(series[source], dtype=float)[at]
        columns[name] = column.astype(np.int64) if name in WHOLE else column
    return Record(columns, {}, run or RunDocument())
