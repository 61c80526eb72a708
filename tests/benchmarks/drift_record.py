"""Long drift records from a file to the report: seconds, and memory at its peak.

python tests/benchmarks/drift_record.py                        10^7 samples of a Parquet file, whole report; budget 60 s
python tests/benchmarks/drift_record.py --samples 100000000    budget 1 GB
python tests/benchmarks/drift_record.py --csv                  the same from a CSV file
python tests/benchmarks/drift_record.py --imu [--csv]          2 million rows of seven channels of a unit at rest; 40 s
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from asked import asked
from scipy.signal import lfilter

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


AXES = ("x", "y", "z")
#: per triad: unit, white noise of a sample, rms and correlation time (s) of two processes, step of the output
TRIADS = {"gyro": ("deg/s", 0.05, (0.004, 3.0), (0.002, 300.0), 0.005),
          "acc": ("mg", 1.2, (0.15, 10.0), (0.05, 600.0), 0.05)}  # fmt: skip


def unit(samples: int) -> Iterator[pa.RecordBatch]:
    """Yield time, three gyros, three accelerometers and a temperature that gyro z follows, as a MEMS unit writes them:
    white noise that passed a mean of two samples, two Gauss-Markov processes, steps of the output, a wild sample of
    100,000.
    """
    rng = np.random.default_rng(2)
    t = np.arange(samples) / RATE
    temperature = np.round(25.0 + 4.0 * (1.0 - np.exp(-t / 2400.0)) + 0.02 * rng.normal(size=samples), 2)
    columns = {"time [s]": np.round(t, 3)}
    for name, (of, white, *processes, step) in TRIADS.items():
        for axis in AXES:
            x = white * np.convolve(rng.normal(size=samples + 1), [0.5, 0.5], "valid")
            for rms, tau in processes:
                a = np.exp(-1.0 / (RATE * tau))
                drive = rms * np.sqrt(1.0 - a * a) * rng.normal(size=samples)
                x += lfilter([1.0], [1.0, -a], drive, zi=[a * rms * rng.normal()])[0]
            if (name, axis) == ("gyro", "z"):
                x += 0.003 * (temperature - 25.0)
            x[rng.random(samples) < 1e-5] += 20.0 * white
            x += 1000.0 * ((name, axis) == ("acc", "z"))
            columns[f"{name}_{axis} [{of}]"] = np.round(step * np.rint(x / step), 4)
    columns["temperature [degC]"] = temperature
    yield pa.record_batch(columns)


def write(file: Path, samples: int, blocks: Callable[[int], Iterator[pa.RecordBatch]]) -> None:
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
    options = asked(__doc__, samples=0, csv=False, imu=False)
    samples = options.samples or (2_000_000 if options.imu else 10_000_000)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"record.{'csv' if options.csv else 'parquet'}"
        write(file, samples, unit if options.imu else blocks)
        command = [sys.executable, "-m", "gyrobench", "reduce", "drift_record", "--data", str(file)]
        wall = time.perf_counter()
        done = subprocess.run([*command, "--out", f"{folder}/out"], capture_output=True, text=True, check=True)
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(done.stdout, done.stderr)
        print(
            f"{samples} samples, {file.stat().st_size / 1e6:.0f} MB of {file.suffix[1:]}: "
            f"{time.perf_counter() - wall:.1f} s, {used.ru_utime + used.ru_stime:.1f} s of CPU, peak "
            f"{used.ru_maxrss / 1024:.0f} MB"
        )
