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
from scipy import stats

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

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
    hits: dict[str, list[bool]] = {}
    z: dict[str, list[float]] = {}
    for k, part in enumerate(PARTS):
        with Session(NAME, {"gyro": part}) as session:
            for run in range(given.runs // len(PARTS)):
                values = drawn(rng, part)
                options = {n: v for n, v in values.items() if "." not in n}
                record = session.run(values, seed=100_000 * given.seed + 10_000 * k + run)
                for c in load_system(NAME).with_values(options).reduce(record).coefficients:
                    if c.truth is not None and not c.no_value:
                        name = f"{c.name} ({values['axis']})"
                        hits.setdefault(name, []).append(c.interval[0] <= c.truth <= c.interval[1])
                        z.setdefault(name, []).append(c.z or 0.0)
    bad = 0
    for name, held in sorted(hits.items()):
        k, n = sum(held), len(held)
        low, high = stats.beta.ppf(0.025, k, n - k + 1), stats.beta.ppf(0.975, k + 1, max(n - k, 1))
        bad += not low <= 0.95 <= high
        print(f"{name:<18}{k / n:.3f} of {n} ({low:.3f} to {high:.3f}), rms z {np.std(z[name]):.2f}")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
