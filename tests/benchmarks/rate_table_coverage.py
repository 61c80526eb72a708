"""How often the 95 % intervals of rate_table_test contain the true value: random gyros, latitudes and noise.

    python tests/benchmarks/rate_table_coverage.py [--runs 300] [--seed 1]

Each run draws scale factor error, asymmetry, cubic, hysteresis, bias, latitude, white noise from 0.002 to 0.06
deg/sqrt(s) and, in half of the runs each, a random walk and flicker noise, runs the whole co-simulation on a shortened
plan and reduces it.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np
from held import Held, found

from gyrobench.engine.session import Session

NAME, DEG = "rate_table_test", math.pi / 180.0
SHORT = {"cycles": 2, "steps": 5, "dwell": 0.6, "settle": 0.2, "windows": 2, "table.acceleration": 50.0}


def drawn(rng: np.random.Generator) -> dict[str, object]:
    white = 0.02 * DEG * 10.0 ** rng.uniform(-1.0, 0.5)
    return {
        **SHORT,
        "latitude": rng.uniform(-1.4, 1.4),
        "gyro.scale": [rng.uniform(-0.01, 0.01), 0.0],
        "gyro.asymmetry": rng.uniform(-3e-3, 3e-3),
        "gyro.cubic": rng.uniform(-3e-3, 3e-3) / (100.0 * DEG) ** 2,
        "gyro.hysteresis": rng.uniform(0.0, 0.05) * DEG,
        "gyro.bias": [rng.uniform(-1.0, 1.0) * DEG, 0.0],
        "gyro.white": white,
        "gyro.walk_x": white * 10.0 ** rng.uniform(-3.0, -1.0) * rng.integers(2),
        "gyro.flicker_x": white * 10.0 ** rng.uniform(-1.5, 0.0) * rng.integers(2),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    held = Held()
    with Session(NAME) as session:
        for run in range(given.runs):
            for c in found(session, drawn(rng), 1000 * given.seed + run):
                held.count(c.name, c)
    return int(held.show(4) > 0)


if __name__ == "__main__":
    sys.exit(main())
