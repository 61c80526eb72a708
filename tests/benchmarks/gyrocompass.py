"""How often the intervals of the gyrocompass hold what a run without noise gives.

    python tests/benchmarks/gyrocompass.py [--runs 40] [--seed 200] [--damping vertical] [--phases "settling speed"]

Reading noise five times and drift twenty-five times the defaults of the system; a line for each measure: mean and
standard deviation of the errors over u, share of 95 % intervals that hold.
"""

from __future__ import annotations

import numpy as np
from asked import asked

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

NOISE = {"noise": "0.05deg/sqrt(Hz)", "random_drift": "0.005deg/sqrt(h)"}


def main() -> int:
    args = asked(__doc__, runs=40, seed=200, damping="vertical", phases="settling speed")
    system = load_system("gyrocompass")
    for name, value in {"damping": args.damping, "phases": args.phases, **NOISE}.items():
        system.set(name, value)
    found: dict[str, list[float]] = {}
    with Session(system) as session:
        quiet = system.reduce(session.run({"noise": 0.0, "random_drift": 0.0}, seed=1))
        for seed in range(args.seed, args.seed + args.runs):
            for c in system.reduce(session.run({}, seed=seed)).coefficients:
                found.setdefault(c.name, []).append((c.estimate - quiet[c.name].estimate) / c.u)
    for name, z in found.items():
        known = np.array(z)[np.isfinite(z)]  # a measure may have no value: the axis still swung
        inside = float(np.mean(np.abs(known) < 1.96))
        print(f"{name:34s} mean {known.mean():5.2f}  std {known.std():5.2f}  inside {inside:.3f}  of {known.size}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
