"""How often the 95 % intervals of autoregressive coefficients and of the correlation time hold the truth, and how often
a record without lines shows one.

python tests/benchmarks/series_models.py                # 1000 records of each: three hours of CPU
python tests/benchmarks/series_models.py --only coefficients --samples 100000 1000000

Each coefficient of three models by Burg, 10^3 to 10^6 samples; correlation time of 20 samples
alone, of 1/20 of the record, and of 20 samples under white noise of the same variance; false alarms at 5 %.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import signal

from gyrobench.reduction.series.autoregression import fit_ar
from gyrobench.reduction.series.gauss_markov import gauss_markov
from gyrobench.reduction.series.lines import find_lines

MODELS = {
    "Gauss-Markov of 20 samples": (math.exp(-1 / 20),),
    "AR(2)": (1.2, -0.5),
    "AR(3) of Xia 2008": (-0.7466, -0.5044, -0.2538),
}


def record(phi: Any, n: int, rng: np.random.Generator) -> Any:
    """Stationary from the start."""
    settle = min(20_000, int(40 / -math.log(np.abs(np.roots(np.r_[1.0, -np.array(phi)])).max())) + 10)
    return signal.lfilter([1.0], np.r_[1.0, -np.array(phi)], rng.normal(size=n + settle))[settle:]


def coefficients(runs: int, lengths: Sequence[int], seed: int) -> None:
    for n in lengths:
        for name, phi in MODELS.items():
            rng = np.random.default_rng(n + 4 * seed)
            held = np.zeros(len(phi))
            for _ in range(runs):
                fit = fit_ar(record(phi, n, rng), len(phi))
                held += (fit.low <= phi) & (phi <= fit.high)
            print(f"{name}, {n} samples: {' '.join(f'{v / runs:.3f}' for v in held)}", flush=True)


def times(runs: int, lengths: Sequence[int], seed: int) -> None:
    for n in lengths:
        for tau in (20.0, n / 20.0):
            rng = np.random.default_rng(n + 1 + 4 * seed)
            phi = math.exp(-1 / tau)
            held = 0
            for _ in range(runs):
                x = rng.normal(size=n)
                x[0] /= math.sqrt(1 - phi * phi)  # stationary from the first value on
                found = gauss_markov(signal.lfilter([1.0], [1.0, -phi], x), 1.0, white=False)
                held += found.low <= tau <= found.high
            print(f"correlation time {tau:g} of {n} samples alone: {held / runs:.3f}", flush=True)


def times_under_white(runs: int, lengths: Sequence[int], seed: int) -> None:
    """A record of 1e6 samples takes 0.4 s."""
    for n in lengths:
        rng, phi = np.random.default_rng(n + 2 + 4 * seed), math.exp(-1 / 20)
        held = 0
        for _ in range(runs):
            x = record((phi,), n, rng)
            found = gauss_markov(x + rng.normal(size=n) / math.sqrt(1 - phi * phi), 1.0)
            held += found.low <= 20.0 <= found.high
        print(f"correlation time 20 of {n} samples under white noise: {held} of {runs}", flush=True)


def alarms(runs: int, lengths: Sequence[int], seed: int) -> None:
    for n in lengths:
        rng = np.random.default_rng(n + 3 + 4 * seed)
        seen = dict.fromkeys(
            ("white", "Gauss-Markov", "random walk", "differenced white", "AR(2)", "white on a walk"), 0
        )
        for _ in range(runs):
            w = rng.normal(size=n)
            for name, x in {
                "white": w,
                "Gauss-Markov": signal.lfilter([1.0], [1.0, -0.95], w),
                "random walk": np.cumsum(w),
                "differenced white": np.diff(w),
                "AR(2)": signal.lfilter([1.0], [1.0, -1.2, 0.5], w),
                "white on a walk": 0.01 * np.cumsum(w) + rng.normal(size=n),
            }.items():
                seen[name] += bool(find_lines(x, 1.0, 0.05).lines)
        print(f"lines in {n} samples without: " + ", ".join(f"{k} {v / runs:.3f}" for k, v in seen.items()), flush=True)


COUNTS = {
    "coefficients": (coefficients, (1000, 10_000, 100_000, 1_000_000)),
    "times": (times, (1000, 10_000, 100_000, 1_000_000)),
    "white": (times_under_white, (1000, 10_000, 100_000, 1_000_000)),
    "alarms": (alarms, (1000, 5000, 50_000)),
}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=int, default=1000)
    parser.add_argument("--only", choices=COUNTS, nargs="+", default=list(COUNTS))
    parser.add_argument("--samples", type=int, nargs="+", help="lengths of the records; default: those of each count")
    parser.add_argument("--seed", type=int, default=0, help="other records")
    given = parser.parse_args()
    for name in given.only:
        count, lengths = COUNTS[name]
        count(given.records, given.samples or lengths, given.seed)
