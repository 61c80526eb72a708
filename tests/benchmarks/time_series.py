"""Ten million rows of a time series to windows: seconds, and memory at its peak.

python tests/benchmarks/time_series.py [rows]
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from gyrobench.system.system import load_system

HEAD = "# latitude = 45.75deg\n# k = 17.2deg/h/mA\n# dwell = {dwell}s\n# rate = 200 ERU\n# phase 1 = static 3\n"


def write(file: Path, n: int, phase: bool) -> None:
    """Write a dwell sampled at 1 kHz."""
    rng = np.random.default_rng(1)
    columns = [np.arange(n) * 1e-3, np.zeros(n), np.round(1.0 + 0.01 * rng.normal(size=n), 7)]
    names = ["time [s]", "angle [deg]", "current [mA]"] + ["phase"] * phase
    if phase:
        columns.append(np.ones(n, dtype=int))
    with file.open("wb") as out:
        out.write((HEAD.format(dwell=n * 1e-3 - 11.0) + ",".join(names) + "\n").encode())
        csv.write_csv(
            pa.table(columns, names=list("abcd"[: len(columns)])), out, csv.WriteOptions(include_header=False)
        )


if __name__ == "__main__":
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    with tempfile.TemporaryDirectory() as folder:
        for phase in (True, False):
            file = Path(folder) / "series.csv"
            write(file, rows, phase)
            pa.default_memory_pool().release_unused()
            wall, cpu = time.perf_counter(), time.process_time()
            record = load_system("tumble_single_axis").read_measured(file, {})
            print(
                f"{rows} rows, phases by {'number' if phase else 'motion'}: {time.perf_counter() - wall:.1f} s, "
                f"{time.process_time() - cpu:.1f} s of CPU, {len(record.windows['mean'])} windows; peak of the process "
                f"(the writing included) {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB"
            )
