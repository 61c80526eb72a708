"""How often the 95 % intervals of the servo tests hold the truth for gyros of ordinary drift.

    python tests/benchmarks/servo_range.py [SYSTEM ...] [--runs 200] [--seed 1]

Vertical and level test: fixed drift to 30 deg/h, unbalances to 10 deg/h/g, which capture and level dwells must take.
Polar test: unbalance D_S of 5 to 12 deg/h/g, with which the table turns by a third to twice its mean rate; drift and
Earth rate fifty times larger than in a real day.  Noise and counting as in coverage.py.
"""

from __future__ import annotations

import argparse

import numpy as np
from coverage import coverage
from coverage_cases import DPH, Case, Rng, Values, floated, latitude, of_encoder, sign

from gyrobench import frames


def ordinary(rng: Rng) -> Values:
    sizes = {"D_F": 30.0, "D_I": 10.0, "D_S": 10.0}
    return {**floated(rng), **{f"gyro.{n}": float(rng.uniform(-s, s)) * DPH for n, s in sizes.items()}}


def unbalanced(rng: Rng) -> Values:
    return {**floated(rng), "gyro.D_S": 50.0 * float(rng.uniform(5.0, 12.0)) * sign(rng) * DPH}


CASES = {
    "servo_vertical_level": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0}, ordinary, latitude(0.0, 70.0), of_encoder
    ),
    "servo_polar": Case(
        "servo_polar",
        {"site.earth_rate": 50.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "time": 1724.0, "turns": 1, "window": 24.0,
         "dwell": 240.0, "settle": 2.0, "table.capture_rate": 250.0},
        unbalanced, latitude(12.0, 78.0), of_encoder,
    ),
}  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("system", nargs="*", default=list(CASES), help=", ".join(CASES))
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for name in given.system:
        print(f"{name}: {given.runs} runs")
        for n, c in coverage(CASES[name], given.runs, given.seed).items():
            low, high = c.bounds()
            rms = float(np.sqrt(np.mean(np.square(c.z))))
            print(f"  {n:<6} {c.hits / c.runs:.3f}   {low:.3f} .. {high:.3f}   rms of z {rms:.2f}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
