"""How often the intervals of the vertical gyro hold what a tenth of the step gives: random flights.

    python tests/benchmarks/vertical_gyro.py [--runs 30] [--seed 1]

Latitude, heading, tilt, law and rate of the erection, ring servo and cut-off are drawn; erection, acceleration, a full
loop and a full roll are flown at the default step (10 ms, readings every 0.1 s) and at 1 ms.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from asked import asked

from gyrobench.engine.session import Session


def flight(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "phases": "erection acceleration loop roll",
        "latitude": float(rng.uniform(-1.2, 1.2)), "motion.start_angle[3]": float(rng.uniform(-3.0, 3.0)),
        "tilt": float(rng.uniform(0.0, 0.03)), "time": float(rng.integers(10, 25)),
        "law": str(rng.choice(["switches", "linear"])), "rate": math.radians(float(rng.uniform(2.0, 6.0))) / 60.0,
        "gyro.k_ring": float(rng.uniform(15.0, 60.0)), "cut_off": int(rng.integers(0, 2)),
    }  # fmt: skip


def main() -> int:
    given = asked(__doc__, runs=30, seed=1)
    rng = np.random.default_rng(given.seed)
    rows: dict[str, list[tuple[bool, float, float]]] = {}
    with Session("vertical_gyro") as session:
        for run in range(given.runs):
            values = flight(rng)
            system = session.system.with_values(values)
            coarse, fine = (
                {c.name: c for c in system.reduce(session.run(values, seed=run, step=h)).coefficients}
                for h in (None, 1e-3)
            )
            for name in coarse.keys() & fine.keys():
                low, high = coarse[name].interval
                truth = fine[name].estimate
                rows.setdefault(name, []).append((low <= truth <= high, coarse[name].estimate - truth, coarse[name].u))
    for name, found in sorted(rows.items()):
        held, error, u = (np.array(column) for column in zip(*found, strict=True))
        worst = np.abs(error).max()
        print(f"{name:<10} {held.mean():.3f} of {held.size}, largest error {worst:.2g}, u {np.median(u):.2g}")
    return int(any(not all(held for held, _, _ in found) for found in rows.values()))


if __name__ == "__main__":
    raise SystemExit(main())
