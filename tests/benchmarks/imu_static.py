"""Whole IMUs at rest: what a report states of correlations, temperature, common lines and N, against known truth.

    python tests/benchmarks/imu_static.py [seeds] [samples]

Records from the equations with numpy and scipy alone: two gyros and two accelerometers whose white noise and whose
Gauss-Markov drift are correlated, a rate that follows the temperature, a force that follows its rate of change, a sine
in two channels.  Printed: how often what is stated holds.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.signal import lfilter

from gyrobench.system.system import load_system

NAMES = ("gyro_x", "gyro_y", "acc_x", "acc_y")
UNITS = ("deg/h", "deg/h", "mg", "mg")
STEP, TAU, LINE = 0.1, 20.0, 1.234  # s, s, Hz
WHITE = np.array([30.0, 30.0, 1.0, 1.0])  # of a sample
SLOW = np.array([4.0, 4.0, 0.1, 0.1])  # rms of the process
#: correlations of the white noise and of the processes; the pairs that are not named have none
OF_WHITE = {(0, 1): 0.2, (1, 2): -0.1}
OF_SLOW = {(0, 1): 0.6}
PER_KELVIN, PER_CHANGE = 3.0, 0.02  # deg/h per K of gyro_x, mg per (K/h) of acc_y
AMPLITUDE = {0: 3.0, 2: 0.1}


def matrix(of: dict[tuple[int, int], float]) -> np.ndarray:
    out = np.eye(len(NAMES))
    for (i, j), r in of.items():
        out[i, j] = out[j, i] = r
    return out


def process(innovations: np.ndarray, tau: float) -> np.ndarray:
    """Gauss-Markov process of unit variance from unit innovations (n,), stationary from the first sample on."""
    a = math.exp(-STEP / tau)
    x0 = innovations[0]
    out = lfilter([math.sqrt(1.0 - a * a)], [1.0, -a], innovations[1:], zi=np.array([a * x0]))[0]
    return np.concatenate([[x0], out])


def record(seed: int, n: int) -> tuple[dict[str, np.ndarray], dict[str, float]]:
    """Columns of a record and its true shares of the variance."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(n)
    white = rng.normal(size=(n, 4)) @ np.linalg.cholesky(matrix(OF_WHITE)).T * WHITE
    drive = rng.normal(size=(n, 4)) @ np.linalg.cholesky(matrix(OF_SLOW)).T
    slow = np.column_stack([process(drive[:, k], TAU) for k in range(4)]) * SLOW
    turn = 2.0 * math.pi / (0.6 * n * STEP)
    phase = rng.uniform(0.0, 2.0 * math.pi)
    T = 2.0 * np.sin(turn * t + phase) + 0.4 * np.sin(3.3 * turn * t)
    # K/h
    change = 3600.0 * turn * (2.0 * np.cos(turn * t + phase) + 1.32 * np.cos(3.3 * turn * t))
    y = white + slow
    y[:, 0] += PER_KELVIN * (T - T.mean())
    y[:, 3] += PER_CHANGE * change
    for k, a in AMPLITUDE.items():
        y[:, k] += a * np.sin(2.0 * math.pi * LINE * t + k)
    y += (5.0, -3.0, 2.0, 1000.0)
    columns = {"time [s]": t, **{f"{n_} [{u}]": y[:, k] for k, (n_, u) in enumerate(zip(NAMES, UNITS, strict=True))}}
    shares = {"gyro_x": PER_KELVIN**2 * np.var(T) / np.var(y[:, 0]),
              "acc_y": PER_CHANGE**2 * np.var(change) / np.var(y[:, 3])}  # fmt: skip
    return {**columns, "temperature [degC]": 20.0 + T}, shares


def correlation(i: int, j: int, tau: float) -> float:
    """True correlation in the octave whose averaging time is tau, of spectra that vary little in it."""
    low = 0.371 * math.sqrt(2.0) / tau / 2.0
    f = np.linspace(low, 2.0 * low, 400)
    a = math.exp(-STEP / TAU)
    shape = (1.0 - a * a) / (1.0 - 2.0 * a * np.cos(2.0 * np.pi * f * STEP) + a * a)
    S = [WHITE[k] ** 2 + SLOW[k] ** 2 * shape for k in (i, j)]
    cross = OF_WHITE.get((i, j), 0.0) * WHITE[i] * WHITE[j] + OF_SLOW.get((i, j), 0.0) * SLOW[i] * SLOW[j] * shape
    return float(np.mean(cross / np.sqrt(S[0] * S[1])))


def judge(seed: int, n: int, folder: Path) -> Counter[str]:
    """What holds of the statements on one record: "what ok" and "what of"."""
    columns, shares = record(seed, n)
    file = folder / "record.parquet"
    pq.write_table(pa.table(columns), file)
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(file, {"type_b": "none"}))
    tables = {table.id: table for table in result.tables}
    out: Counter[str] = Counter()

    def count(what: str, ok: bool) -> None:
        out[f"{what}: of"] += 1
        out[f"{what}: ok"] += ok

    rows = tables["correlations"].rows if "correlations" in tables else []
    listed = {tuple(NAMES.index(n_) for n_ in row[0].split(" – ")): row for row in rows}
    for pair in {*OF_WHITE, *OF_SLOW}:
        count("correlated pair listed", pair in listed)
    for pair, row in listed.items():
        count("stated correlation in its interval", row[3] <= correlation(*pair, row[1]) <= row[4])
    count("no pair listed that is not correlated", all(p in {*OF_WHITE, *OF_SLOW} for p in listed))
    lines = tables["common_lines"].rows if "common_lines" in tables else []
    near = [r for r in lines if abs(r[0] - LINE) < 4.0 * r[1]]
    count("common line found, in its two channels", [r[2] for r in near] == [2])
    count("no other common line", len(lines) == len(near))
    for k, c in enumerate(result.columns):
        for row in c.tables["regression"][0].rows:
            own = {"gyro_x": "temperature", "acc_y": "d(temperature)/dt"}.get(c.name)
            if row[0] == own:
                count(f"{row[0]}: share in its interval", row[8] <= 100.0 * shares[c.name] <= row[9])
                count(f"{row[0]}: taken out where it acts", row[-1] == "taken out")
                slope = PER_KELVIN if own == "temperature" else 1e3 * PER_CHANGE
                count(f"{row[0]}: slope in its interval", row[3] <= slope <= row[4])
            else:
                count("share of a column that does nothing holds 0", row[8] == 0.0)
        N = WHITE[k] * math.sqrt(STEP) / 60.0 if k < 2 else WHITE[k] * 9.80665e-3 * math.sqrt(STEP) * 60.0
        low, high = result[f"N {c.name}"].interval
        count("N in its interval", low <= N <= high)
    return out


def main(seeds: int, n: int) -> None:
    began, total = time.process_time(), Counter[str]()
    with TemporaryDirectory() as folder:
        for seed in range(seeds):
            total += judge(seed, n, Path(folder))
    for what in sorted({key.rpartition(":")[0] for key in total}):
        of, ok = total[f"{what}: of"], total[f"{what}: ok"]
        print(f"| {what} | {ok} of {of} | {ok / of:.3f} |")
    print(f"{seeds} records of {n} samples, {time.process_time() - began:.0f} s of CPU")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 30, int(sys.argv[2]) if len(sys.argv) > 2 else 12_000)
