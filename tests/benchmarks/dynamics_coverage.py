"""How often the 95 % intervals of gyro_dynamics contain the true value: random gyros and noise.

    python tests/benchmarks/dynamics_coverage.py [--runs 300] [--seed 1]

Each run draws momentum, inertia, damping, stiffnesses (or none) and drift of the gyro, white noise of pickoff and
reading, flicker and a random walk of the drift in half of the runs each, stated errors of gain of the reading, and the
axis; it runs the whole co-simulation on a shortened plan and reduces it.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from held import Held, found

from gyrobench.engine.session import Session

NAME = "gyro_dynamics"
SHORT = {"points": 14, "lowest": 2.0, "dwell": 0.3, "periods": 12, "settle": 0.3, "steps": 6, "hold": 0.15}
PARTS = ("compliant_gyro", "floated_gyro")


def drawn(rng: np.random.Generator, part: str) -> dict[str, object]:
    gain = 3e-3 * rng.integers(2)
    C = rng.uniform(0.12, 0.3)
    white = 8.6e-8 * 10.0 ** rng.uniform(-0.5, 1.0)
    values: dict[str, object] = {
        **SHORT,
        "axis": ("input", "input", "output")[rng.integers(3)],
        "u_gain": gain,
        "table.read_gain": gain * rng.normal(),
        "table.reading": 1e-6 * 10.0 ** rng.uniform(-1.0, 1.0) * rng.integers(2),
        "gyro.H": C * rng.uniform(0.6, 1.5),
        "gyro.C": C,
        "gyro.J": C * rng.uniform(0.6e-3, 1.8e-3),
        "gyro.white": white,
        "gyro.pickoff": 5e-8 * 10.0 ** rng.uniform(0.0, 1.5),
        "gyro.flicker": 1e-8 * 10.0 ** rng.uniform(-1.0, 1.0) * rng.integers(2),
        "gyro.walk": white * 10.0 ** rng.uniform(-2.0, -1.0) * rng.integers(2),
    }
    if part == "compliant_gyro":
        values |= {"gyro.K_I": rng.uniform(200.0, 800.0), "gyro.K_O": rng.uniform(800.0, 4000.0)}
    return values


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    held = Held()
    for k, part in enumerate(PARTS):
        with Session(NAME, {"gyro": part}) as session:
            for run in range(given.runs // len(PARTS)):
                values = drawn(rng, part)
                for c in found(session, values, 100_000 * given.seed + 10_000 * k + run):
                    held.count(f"{c.name} ({values['axis']})", c)
    return int(held.show(18) > 0)


if __name__ == "__main__":
    sys.exit(main())
