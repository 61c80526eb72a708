"""How often the 95 % intervals of gyro_bandwidth contain the true value: random gyros and noise.

    python tests/benchmarks/bandwidth_coverage.py [--runs 300] [--seed 1] [--unstated]

Each run draws filter, loop, split, output rate and scale factor, white noise of gyro and reading and, in half of the
runs each, flicker, a random walk, stated errors of gain and lag of the reading, runs the whole co-simulation on a
shortened plan and reduces it.  --unstated: the errors of the reading are simulated, but nobody states them.
"""

from __future__ import annotations

import argparse
import logging
import math
import sys

import numpy as np
from held import Held, found, stated

from gyrobench.engine.session import Session

NAME, DEG = "gyro_bandwidth", math.pi / 180.0
SHORT = {"points": 14, "lowest": 2.0, "highest": 150.0, "dwell": 0.3, "periods": 12, "settle": 0.3}
PARTS = ("gyro_mems", "gyro_vibratory", "gyro_fog")


def drawn(rng: np.random.Generator, part: str) -> dict[str, object]:
    white = 0.02 * DEG * 10.0 ** rng.uniform(-1.0, 0.5)
    gain, lag = 3e-3 * rng.integers(2), 5e-5 * rng.integers(2)
    values: dict[str, object] = {
        **SHORT,
        "u_gain": gain,
        "u_lag": lag,
        "table.read_gain": gain * rng.normal(),
        "table.read_lag": lag * rng.normal(),
        "table.reading": white * rng.integers(2),
        "gyro.scale": [rng.uniform(-0.02, 0.02), 0.0],
        "gyro.walk_x": white * 10.0 ** rng.uniform(-3.0, -1.0) * rng.integers(2),
        "gyro.flicker_x": white * 10.0 ** rng.uniform(-1.5, 0.0) * rng.integers(2),
    }
    if part == "gyro_fog":
        return {**values, "gyro.optical": 0.0, "gyro.electronics": white}
    values |= {"gyro.white": white, "gyro.bandwidth": rng.uniform(25.0, 90.0)}
    values["gyro.period"] = rng.uniform(5e-4, 4e-3) * rng.integers(2)
    if part == "gyro_vibratory":
        values |= {"gyro.loop": rng.uniform(30.0, 150.0), "gyro.split": rng.uniform(-200.0, 200.0)}
    return values


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unstated", action="store_true")
    given = parser.parse_args()
    logging.getLogger("gyrobench").setLevel(logging.ERROR)  # a line for each simulated error
    rng = np.random.default_rng(given.seed)
    held = Held()
    for k, part in enumerate(PARTS):
        with Session(NAME, {"gyro": part}) as session:
            for run in range(given.runs // len(PARTS)):
                values = stated(drawn(rng, part), given.unstated)
                for c in found(session, values, 100_000 * given.seed + 10_000 * k + run):
                    held.count(c.name, c)
    return int(held.show(6) > 0)


if __name__ == "__main__":
    sys.exit(main())
