"""How often the 95 % intervals of the tests of rate gyros and inertial units contain the true value.

    python tests/benchmarks/instrument_coverage.py TEST [--runs 300] [--seed 1] [--unstated]

Each run draws instrument, noise and errors of the set-up by the function of its name, runs the whole co-simulation on a
shortened plan and reduces it.  --unstated: the errors of the set-up are simulated, but nobody states them.
"""

from __future__ import annotations

import argparse
import logging
import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

DEG = math.pi / 180.0
DPH = DEG / 3600.0
ARCMIN = DEG / 60.0
Drawn = dict[str, Any]


def coning_test(rng: np.random.Generator) -> Drawn:
    """Gyros with errors of 100 ppm to 0.1 %, white noise, in half of the runs each a wandering bias and a case or a
    table that is off; filter, output rate and algorithm by chance.
    """
    size, white = 10.0 ** rng.uniform(-4.0, -3.0), 0.01 * DEG / 60.0 * 10.0 ** rng.uniform(-0.5, 0.7)
    mount, twist = ARCMIN * rng.integers(2), 0.1 * DPH * rng.integers(2)
    samples = int(rng.integers(1, 3))
    values: Drawn = {
        "readings": 4, "cycles": 2, "window": 1.0, "frequencies": "3 8 20", "half_angle": rng.uniform(0.2, 0.7) * DEG,
        "axis": "xyz"[rng.integers(3)], "samples": samples, "coning": bool(samples == 1 and rng.integers(2)),
        "bandwidth": float(rng.uniform(60.0, 300.0)), "u_mount": mount, "u_twist": twist,
        "imu.gyro_scale": rng.normal(0.0, size, (3, 3)).tolist(),
        "imu.mount": Rotation.from_rotvec(mount * rng.normal(size=3)).as_matrix().tolist(),
        "table.twist": twist * rng.normal(),
    }  # fmt: skip
    values |= {f"imu.{a}_gyro": white for a in "xyz"}
    values |= {f"imu.{a}_gyro_bias": white / 5.0 * rng.integers(2) for a in "xyz"}
    return values | {"imu.gyro_bias_tau": float(10.0 ** rng.uniform(1.0, 3.0))}


DRAWN: dict[str, Callable[[np.random.Generator], Drawn]] = {"coning_test": coning_test}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("test", choices=sorted(DRAWN))
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unstated", action="store_true")
    given = parser.parse_args()
    logging.getLogger("gyrobench").setLevel(logging.ERROR)  # a line for each simulated error
    rng = np.random.default_rng(given.seed)
    hits: dict[str, list[bool]] = {}
    with Session(given.test) as session:
        for run in range(given.runs):
            values = DRAWN[given.test](rng)
            if given.unstated:
                values |= {n: 0.0 for n in values if n.startswith("u_")}
            options = {n: v for n, v in values.items() if "." not in n}
            record = session.run(values, seed=100_000 * given.seed + run)
            for c in load_system(given.test).with_values(options).reduce(record).coefficients:
                if c.truth is not None and not c.no_value:
                    kind = c.name.split("(")[0].replace(f"_{options.get('axis')}", "_along")
                    hits.setdefault(kind, []).append(c.interval[0] <= c.truth <= c.interval[1])
    bad = 0
    for name, held in hits.items():
        k, n = sum(held), len(held)
        low, high = stats.beta.ppf(0.025, k, n - k + 1), stats.beta.ppf(0.975, k + 1, max(n - k, 1))
        bad += not low <= 0.95 <= high
        print(f"{name:<12}{k / n:.3f} of {n} ({low:.3f} to {high:.3f})")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
