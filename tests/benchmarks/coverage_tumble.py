"""Do the 95 % intervals of the tumble cover?  Monte Carlo on the whole co-simulation: FMUs, loop, sampler, reduction.

    python tests/benchmarks/coverage_tumble.py --runs 1000 [--case white ...] [--turns 3] [--windows 36]

Each run draws a gyro (nine coefficients in the book's ranges, both signs) and new noise.  The plan is the book's, both
senses and three turns in each, with the table at 0.3 rad/s instead of 7.3e-4: 36 windows of 0.58 s a turn and dwells of
twenty windows.  Noise is set so that a shortened window is to the noise what a window of the full test is:

  white         0.0178 deg/h/sqrt(Hz), the standard gyro's: 0.023 deg/h a window
  markov 1, 5   the same, and Gauss-Markov drift of 0.04 deg/h rms with a correlation time of 1 and 5 windows

The pickoff noise (blue in the current: it telescopes over a window) is scaled to the share of the full test, one
tenth of the white noise; the meter's noise stays.  The lag of the loop at this rate is 9e-5 of the first harmonics,
a thirtieth of u.  The reduction is told nothing about the noise.

Measured, 1000 runs each, three turns: white 0.941 .. 0.962, markov 1 0.935 .. 0.946, markov 5 0.936 .. 0.956 over the
nine coefficients.  Less data leaves more open about the noise: with a single turn in one sense and dwells of ten
windows, white 0.954 .. 0.971, markov 1 0.938 .. 0.986, markov 5 0.917 .. 0.968 (D_IS and D_IO lowest,
D_F and D_O highest; these with an earlier prior of the correlation time).
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).parents[1] / "systems"))
from tumbling import DPH, NAMES, gyro, load

from gyrobench.system.run import Session

RATE = 0.3  # rad/s
SIGMA = 0.04 * DPH
CASES = {"white": 0.0, "markov 1": 1.0, "markov 5": 5.0}  # correlation time in windows


def values(case: str, windows: int = 36, turns: int = 3) -> dict[str, Any]:
    """Options and noise parameters of a case."""
    window = 2.0 * math.pi / RATE / windows
    tau = CASES[case] * window
    return {
        "rate": RATE,
        "windows": windows,
        "turns": turns,
        "both_senses": True,
        "dwell": 20.0 * window,
        "settle": 2.0,
        "gyro.pickoff": 5e-9,
        "gyro.markov": SIGMA if tau else 0.0,
        "gyro.markov_tau": tau or 1.0,
    }


def coverage(
    case: str, runs: int, windows: int = 36, turns: int = 3, seed: int = 1, tell: Callable[[int], None] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Intervals that hold the truth (count per coefficient), and root mean square of u over that of the errors."""
    system = load()
    rng = np.random.default_rng(seed)
    hits, u2, e2 = np.zeros(9, dtype=int), np.zeros(9), np.zeros(9)
    with Session(system) as session:
        for run in range(runs):
            record = session.run({**values(case, windows, turns), **gyro(rng)}, seed=seed * 1_000_000 + run)
            result = system.reduce(record)
            for j, c in enumerate(result.coefficients):
                hits[j] += c.interval[0] <= c.truth <= c.interval[1]
                u2[j] += c.u**2
                e2[j] += (c.estimate - c.truth) ** 2
            if tell is not None:
                tell(run + 1)
    return hits, np.sqrt(u2 / e2)


def bounds(hits: int, runs: int, level: float = 0.95) -> tuple[float, float]:
    """Clopper-Pearson interval of the probability."""
    a = (1.0 - level) / 2.0
    low = stats.beta.ppf(a, hits, runs - hits + 1) if hits else 0.0
    high = stats.beta.ppf(1.0 - a, hits + 1, runs - hits) if hits < runs else 1.0
    return float(low), float(high)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--case", action="append", choices=list(CASES))
    parser.add_argument("--windows", type=int, default=36, help="a turn")
    parser.add_argument("--turns", type=int, default=3, help="in each mount and sense")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    bad = []
    for case in given.case or CASES:
        began = time.monotonic()

        def tell(done: int, began: float = began, case: str = case) -> None:
            if done % 50 == 0 or done == given.runs:
                rate = done / (time.monotonic() - began)
                left = (given.runs - done) / rate
                print(f"{case}: {done}/{given.runs}, {rate:.1f} runs/s, {left:.0f} s left", file=sys.stderr)

        hits, ratio = coverage(case, given.runs, given.windows, given.turns, given.seed, tell)
        print(f"\n{case}: {given.runs} runs, {given.windows} windows a turn, {given.turns} turns")
        print(f"{'coefficient':<12}{'coverage':>9}   95 % bounds       u/scatter")
        for name, h, r in zip(NAMES, hits.tolist(), ratio.tolist(), strict=True):
            low, high = bounds(h, given.runs)
            inside = 0.93 <= h / given.runs <= 0.97
            print(
                f"{name:<12}{h / given.runs:>9.3f}   {low:.3f} .. {high:.3f}   {r:9.2f}{'' if inside else '  OUTSIDE'}"
            )
            if not inside:
                bad.append(f"{case} {name}")
        sys.stdout.flush()
    print("\nall between 0.93 and 0.97" if not bad else f"\noutside 0.93..0.97: {', '.join(bad)}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
