"""Consistency of the attitude filters over seeds: NEES and NIS in rest and rocking, intervals of the rms errors.

python tests/benchmarks/attitude_consistency.py 60

Each seed is a run with other biases and noise.  NEES of one run has few independent values (biases stay for an hour);
over the seeds its mean must be 1 within its standard error, which is that of the seeds' scatter.
"""

from __future__ import annotations

import sys

import numpy as np

import gyrobench as gb

CASES = {
    "mekf, rocking 20 deg": ("attitude_mekf", "20deg"),
    "mekf, rocking 60 deg": ("attitude_mekf", "60deg"),
    "kalman, rocking 1 deg": ("attitude_kalman", "1deg"),
}


def main(seeds: int) -> None:
    for title, (part, rocking) in CASES.items():
        test = gb.load("attitude_estimator", parts={"estimator": part}, phases="rest rocking", rocking=rocking)
        results = [test.run(seed=seed).result for seed in range(1, seeds + 1)]
        for name in ("NEES", "NIS"):
            x = np.array([r[name].estimate for r in results])
            error = x.std(ddof=1) / np.sqrt(seeds)
            inside = np.mean([abs(r[name].estimate - 1.0) < r[name].k * r[name].u for r in results])
            print(f"{title}: {name} {x.mean():.3f} +- {error:.3f}, intervals with 1: {inside:.2f}", flush=True)
        for name in results[0].names[:-2]:
            size = np.sqrt(np.mean([r[name].estimate ** 2 for r in results]))
            inside = np.mean([r[name].interval[0] <= size <= r[name].interval[1] for r in results])
            print(f"{title}: {name}, rms over the seeds {size:.3g}, intervals with it: {inside:.2f}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
