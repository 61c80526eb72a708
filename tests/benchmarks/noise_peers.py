"""The noise model beside its peers: readings of the slopes of allantools' deviation, and a fit of the five terms.

    python tests/benchmarks/noise_peers.py RECORDS SAMPLES          simulated: error of N and Q, deviation at 30 samples
    python tests/benchmarks/noise_peers.py FOLDER [PART_OF_A_NAME]  real: averaging times at which the deviation agrees

Slopes: lines of slope -1 and -1/2 through the octave where the local slope of log deviation is nearest to them, read at
their places of IEEE 952, annex C.  Five terms: non-negative least squares of relative errors of the Allan variance by
3 Q^2/tau^2, N^2/tau, (2 ln 2/pi) B^2, K^2 tau/3, R^2 tau^2/2, as the package allan_variance describes it, written anew.
"""

from __future__ import annotations

import math
import sys
from collections import defaultdict
from pathlib import Path

import allantools
import numpy as np
import pyarrow.parquet as pq
from noise_model_coverage import TRUTHS, simulated
from real_records import MOVED
from scipy.optimize import nnls

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.agreement import ENOUGH, PART, SHORTEST
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.deviations import deviations

PLACE = 30  # samples, where the deviations are compared
SLOPES = {"Q": (-1.0, math.sqrt(3.0)), "N": (-0.5, 1.0)}  # slope and deviation over the coefficient at tau = 1


def by_slopes(tau: Array, deviation: Array) -> dict[str, float]:
    """Return Q and N read from the slopes of a deviation (k,)."""
    local = np.diff(np.log(deviation)) / np.diff(np.log(tau))
    middle, value = np.sqrt(tau[1:] * tau[:-1]), np.sqrt(deviation[1:] * deviation[:-1])
    out = {}
    for name, (slope, factor) in SLOPES.items():
        k = int(np.argmin(np.abs(local - slope)))
        out[name] = float(value[k] * middle[k] ** -slope) / factor
    return out


def of_five(tau: Array) -> Array:
    """Return the Allan variances (k, 5) of Q, N, B, K, R of 1."""
    return np.column_stack([3.0 / tau**2, 1.0 / tau, np.full_like(tau, 2.0 * math.log(2.0) / math.pi), tau / 3.0,
                            tau**2 / 2.0])  # fmt: skip


def by_five(tau: Array, deviation: Array) -> Array:
    """Return the squares (5,) of Q, N, B, K, R of a deviation (k,)."""
    return np.asarray(nnls(of_five(tau) / deviation[:, None] ** 2, np.ones_like(tau))[0])


def deviation_of(truth: dict[str, object], n: int) -> float:
    """Return the true Allan deviation at PLACE samples: of the mean of the variances of 40 records."""
    v = [allantools.oadev(simulated(n, truth, [], np.random.default_rng([7, i])), 1.0, "freq", [PLACE])[1][0]
         for i in range(40)]  # fmt: skip
    return float(np.sqrt(np.mean(np.square(v))))


def simulated_records(records: int, n: int) -> None:
    print("| truth | N: model | slopes | five terms | Q: model | slopes | five terms | deviation: model | five terms |")
    for name, truth in TRUTHS.items():
        error, place = defaultdict(list), deviation_of(truth, n)
        for i in range(records):
            x = simulated(n, truth, [], np.random.default_rng([12, i, n]))
            tau, deviation, *_ = allantools.oadev(x, 1.0, "freq", "octave")
            model = fit_noise(x, 1.0, means=False)
            slopes, five = by_slopes(tau, deviation), by_five(tau, deviation)
            for k, term in enumerate("QN"):
                if true := truth.get(term, 0.0):
                    of = {"model": model[term].value, "slopes": slopes[term], "five": math.sqrt(five[k])}
                    if not model[term].determined:  # below an upper end, no value
                        del of["model"]
                    for what, value in of.items():
                        error[f"{term} {what}"].append(abs(math.log(max(value, 1e-3 * true) / true)))
            at = np.array([float(PLACE)])
            error["model"].append(abs(math.log(float(model.allan(at)[0]) / place)))
            error["five"].append(abs(math.log(math.sqrt(float((of_five(at) @ five)[0])) / place)))
        cells = [f"{np.median(error[k]):.3f}" if k in error else "" for k in
                 ("N model", "N slopes", "N five", "Q model", "Q slopes", "Q five", "model", "five")]  # fmt: skip
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


def real_records(folder: Path, part: str) -> None:
    agreed = []
    for file in sorted(f for f in folder.glob("*.parquet") if part in f.name and MOVED not in f.name):
        table = pq.read_table(file)
        for name in (n for n in table.schema.names if n.startswith(("gyro", "acc"))):
            x = table[name].to_numpy().astype(float)
            own = deviations(x - x.mean(), 1.0, ("allan",), fine=True)["allan"]
            octaves = np.log2(own.tau) % 1.0 == 0.0
            five = by_five(own.tau[octaves], own.deviation[octaves])
            k = (own.tau >= SHORTEST) & (own.tau <= PART * x.size)
            implied = np.sqrt(of_five(own.tau) @ five)
            agreed.append(float(np.mean(((own.low <= implied) & (implied <= own.high))[k])))
            print(f"| {file.stem} {name} | {100.0 * agreed[-1]:.1f} |", flush=True)
    enough = sum(a >= ENOUGH for a in agreed)
    print(f"five terms: 95 % inside for {enough} of {len(agreed)}, median {np.median(agreed):.2f}")


if __name__ == "__main__":
    if Path(sys.argv[1]).is_dir():
        real_records(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "")
    else:
        simulated_records(int(sys.argv[1]), int(float(sys.argv[2])))
