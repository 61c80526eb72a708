"""Long drift records from a file to the report: seconds, and memory at its peak.

python tests/benchmarks/drift_record.py                        10^7 samples of a Parquet file, whole report; budget 60 s
python tests/benchmarks/drift_record.py --samples 100000000    budget 1 GB
python tests/benchmarks/drift_record.py --csv                  the same from a CSV file
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

BLOCK = 1 << 20
RATE = 100.0  # Hz
N, WALK, LINE = 0.02, 2e-5, 0.01  # deg/h/sqrt(Hz), deg/h/s per sqrt(Hz), deg/h at 0.5 Hz


def blocks(samples: int) -> Iterator[pa.RecordBatch]:
    """Yield time and rate, deg/h: white noise, a rate random walk, a line, and a gap of ten minutes in the middle."""
    rng = np.random.default_rng(1)
    level = 0.0
    for first in range(0, samples, BLOCK):
        n = min(BLOCK, samples - first)
        t = (np.arange(first, first + n) + (60000 if first > samples // 2 else 0)) / RATE
        walk = level + np.cumsum(rng.normal(scale=WALK / np.sqrt(RATE), size=n))
        level = float(walk[-1])
        rate = 1.0 + walk + LINE * np.sin(np.pi * t) + rng.normal(scale=N * np.sqrt(RATE), size=n)
        yield pa.record_batch({"time [s]": t, "rate [deg/h]": np.round(rate, 6)})


def write(file: Path, samples: int) -> None:
    schema = next(iter(blocks(2))).schema
    if file.suffix == ".csv":
        with pyarrow.csv.CSVWriter(file, schema) as out:
            for batch in blocks(samples):
                out.write(batch)
    else:
        with pq.ParquetWriter(file, schema) as out:
            for batch in blocks(samples):
                out.write_batch(batch)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--csv", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"record.{'csv' if options.csv else 'parquet'}"
        write(file, options.samples)
        command = [sys.executable, "-m", "gyrobench", "reduce", "drift_record", "--data", str(file)]
        wall = time.perf_counter()
        done = subprocess.run([*command, "--out", f"{folder}/out"], capture_output=True, text=True, check=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(done.stdout, done.stderr)
        print(
            f"{options.samples} samples, {file.stat().st_size / 1e6:.0f} MB of {file.suffix[1:]}: "
            f"{time.perf_counter() - wall:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of CPU, peak "
            f"{used.ru_maxrss / 1024:.0f} MB"
        )
