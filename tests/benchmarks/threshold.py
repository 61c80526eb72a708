"""How often the interval of a threshold contains it: a rebalance loop that is read in steps, a gyro with a dead band.

    python tests/benchmarks/threshold.py [loop|table] [--runs 1000] [--seed 1]

loop, rebalance_loop_test, an analog loop.  A reading in steps q answers with nothing below q/2: with a drift b, and
samples of the current that scatter by s about it, the mean reading at the rate r is  m(r + b),  m(x) = q sum over n of
[Phi((x - (n - 1/2) q)/s) - Phi((-x - (n - 1/2) q)/s)], and the threshold is the least r with (m(r + b) - m(b -
r))/(2 r) = 1/2.  s is taken from a run of the same noise that is read without steps; what drifts slowly is no part of
it.  Each run draws q, drift, the rates of the plan and the noise of the gyro: white, Gauss-Markov or both, with a
correlation time from a reading to the whole test.

table, rate_table_test, a fibre-optic gyro with the dead band d, whose threshold is d/sqrt(3/4) whatever its noise: each
run draws d, the rates, white noise and, in half of the runs each, a random walk and flicker noise.

The interval lies between a rate that is surely not answered and one that surely is, so that it holds the threshold in
at least 95 % of the runs; those where the record does not tell are counted apart.
"""

from __future__ import annotations

import argparse
import math
import sys
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from gyrobench.engine.session import Session
from gyrobench.packaging import build
from gyrobench.result import Coefficient
from gyrobench.system.system import load_system

NAME, DPH, K = "rebalance_loop_test", math.pi / 648000.0, 0.0833879532
DEG, LEAST = math.pi / 180.0, 0.93
TABLE: dict[str, Any] = {"cycles": 1, "steps": 2, "dwell": 0.6, "settle": 0.2, "windows": 3, "full_scale": 100.0 * DEG,
                         "table.acceleration": 50.0}  # fmt: skip
SHORT: dict[str, Any] = {
    "range": "0.1deg/s",
    "rates": "0.3 0.6 1",
    "gate": 0.2,
    "rest": 6,
    "readings": 10,
    "settle": 0.5,
}


def answered(r: float, q: float, b: float, s: float) -> float:
    """Return the response at the rate r over r."""
    n = np.arange(1, 40)

    def m(x: float) -> float:
        edges = (n - 0.5) * q
        return q * float(np.sum(stats.norm.cdf((x - edges) / s) - stats.norm.cdf((-x - edges) / s)))

    return (m(r + b) - m(b - r)) / (2.0 * r)


def threshold(q: float, b: float, s: float) -> float:
    """Return the least rate with half of the response; 0 where every rate has it."""
    grid = np.geomspace(1e-3 * q, 2.0 * q, 400)
    response = np.array([answered(float(r), q, b, s) for r in grid])
    above = np.flatnonzero(response >= 0.5)
    if above[0] == 0:
        return 0.0
    low, high = grid[above[0] - 1], grid[above[0]]
    return float(brentq(lambda r: answered(r, q, b, s) - 0.5, low, high))


def drawn(rng: np.random.Generator) -> tuple[dict[str, Any], float, float]:
    """Return values of a run, and the step and the drift of its reading, rad/s."""
    q = float(rng.uniform(0.3, 1.2)) * DPH
    size = q * 10.0 ** rng.uniform(-2.0, -0.7)  # of a reading of 0.2 s
    share = float(rng.choice([0.0, 1.0, rng.uniform()]))
    rates = np.sort(q * 0.5 * 2.0 ** np.arange(-3.0, 2.5, float(rng.uniform(0.4, 0.8)))) * rng.uniform(0.8, 1.25)
    b = float(rng.uniform(-0.25, 0.25)) * q
    values = {
        **SHORT,
        "small": " ".join(f"{r / DPH:.6g}" for r in rates),
        "rebalance.resolution": q / K,
        "rebalance.meter": 0.0,
        "gyro.D_F": b,
        "gyro.white": size * math.sqrt((1.0 - share) * SHORT["gate"]),
        "gyro.markov": size * math.sqrt(share),
        "gyro.markov_tau": float(10.0 ** rng.uniform(-0.5, 2.0)),
        "gyro.pickoff": 0.0,
    }
    return values, q, b


def said(c: Coefficient, true: float) -> str:
    """Return whether an interval holds the true threshold, printed unit, or why there is no interval."""
    if c.no_value:
        below = c.no_value.startswith("below")
        low, high = (0.0, c.interval[1]) if below else (math.inf, math.inf)
        why = "below" if below else c.no_value.split()[0]
        return f"{why}: {'holds' if low <= true <= high else 'misses' if below else 'open'}"
    low, high = c.interval
    return "holds" if low <= true <= high else "misses"


def on_a_table(seeds: list[int]) -> list[str]:
    """Return what each run of a gyro with a dead band says."""
    found = []
    with Session("rate_table_test", {"gyro": build("gyro_fog")}) as prepared:
        for seed in seeds:
            rng = np.random.default_rng([seed, 1])
            d = 0.02 * DEG * 10.0 ** rng.uniform(-0.5, 0.5)
            white = d * 10.0 ** rng.uniform(-2.5, -0.5) * math.sqrt(TABLE["dwell"])
            rates = np.sort(d * 2.0 ** np.arange(-2.0, 2.6, float(rng.uniform(0.4, 0.8)))) * rng.uniform(0.8, 1.25)
            values = {
                **TABLE,
                "small": " ".join(f"{r / DEG:.6g}" for r in rates),
                "latitude": rng.uniform(-1.4, 1.4),
                "gyro.dead_band": d,
                "gyro.optical": 0.0,
                "gyro.electronics": white,
                "gyro.walk_x": white * 10.0 ** rng.uniform(-2.0, -0.5) * rng.integers(2),
                "gyro.flicker_x": white * 10.0 ** rng.uniform(-1.0, 0.3) * rng.integers(2),
            }
            options = {n: v for n, v in values.items() if "." not in n}
            result = load_system("rate_table_test").with_values(options).reduce(prepared.run(values, seed=seed))
            found.append(said(result["threshold"], d / math.sqrt(0.75) / DEG))
    return found


def counted(seeds: list[int]) -> list[str]:
    """Return what each run of a loop says: holds, misses, or why there is no interval."""
    found = []
    with Session(NAME, {"rebalance": build("rebalance_analog")}) as prepared:
        for seed in seeds:
            values, q, b = drawn(np.random.default_rng([seed, 1]))
            plain = {**values, "rebalance.resolution": 0.0, "small": "", "rest": 60, "gyro.markov": 0.0}
            still = prepared.run(plain, seed=seed).windows
            s = max(float(np.mean(still["std"][:50])) * K, 1e-4 * q)
            true = threshold(q, b, s)
            result = load_system(NAME).with_values(values).reduce(prepared.run(values, seed=seed))
            found.append(said(result["threshold"], true / DPH))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("test", choices=("loop", "table"), nargs="?", default="loop")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    count = counted if given.test == "loop" else on_a_table
    found = count([given.seed * 1_000_000 + k for k in range(given.runs)])
    for word in sorted(set(found)):
        print(f"{word:<20}{found.count(word):>6}")
    told = [w for w in found if w.endswith(("holds", "misses"))]
    share = sum(w.endswith("holds") for w in told) / len(told)
    print(f"of {len(told)} intervals {share:.3f} hold the threshold")
    return int(share < LEAST)


if __name__ == "__main__":
    sys.exit(main())
