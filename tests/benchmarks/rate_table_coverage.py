"""How often the 95 % intervals of rate_table_test contain the true value: random gyros, latitudes and noise.

    python tests/benchmarks/rate_table_coverage.py [--runs 300] [--seed 1] [--unstated]

Each run draws scale factor error, asymmetry, cubic, hysteresis, bias, latitude, white noise from 0.002 to 0.06
deg/sqrt(s) and, in half of the runs each, a random walk, flicker noise, a table axis that leans by 1 mrad and an input
axis that leans by 3 mrad (standard deviations), runs the whole co-simulation on a shortened plan and reduces it.
--unstated: the two are simulated, but nobody states them.
"""

from __future__ import annotations

import argparse
import logging
import math
import sys

import numpy as np
from held import Held, found, stated
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session

NAME, DEG = "rate_table_test", math.pi / 180.0
SHORT = {"cycles": 2, "steps": 5, "dwell": 0.6, "settle": 0.2, "windows": 2, "table.acceleration": 50.0}


def drawn(rng: np.random.Generator) -> dict[str, object]:
    white = 0.02 * DEG * 10.0 ** rng.uniform(-1.0, 0.5)
    axis, mount = 1e-3 * rng.integers(2), 3e-3 * rng.integers(2)
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
        "u_axis": axis,
        "u_mount": mount,
        "table.tilt": (axis * rng.normal(size=2)).tolist(),
        "gyro.mount": Rotation.from_rotvec(mount * rng.normal(size=3)).as_matrix().tolist(),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unstated", action="store_true")
    given = parser.parse_args()
    logging.getLogger("gyrobench").setLevel(logging.ERROR)  # a line for each simulated error
    rng = np.random.default_rng(given.seed)
    held = Held()
    with Session(NAME) as session:
        for run in range(given.runs):
            values = stated(drawn(rng), given.unstated)
            for c in found(session, values, 1000 * given.seed + run):
                held.count(c.name, c)
    return int(held.show(4) > 0)


if __name__ == "__main__":
    sys.exit(main())
