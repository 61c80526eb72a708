"""Starts by program with random stands: are the intervals right, is a fault named, is any start broken off without one?

    python tests/benchmarks/start_up.py --runs 1000 [--faults 30] [--seed 1]

Each run draws torquer (3 % about its data sheet, by which the program goes on), voltage of the reference, offset of the
pickoff and the noises of the stand; each fault is put into ``--faults`` further ones.
"""

from __future__ import annotations

import importlib
from collections import Counter

import numpy as np
from asked import asked

from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.uncertainty import clopper_pearson

K, GAIN = 17.2e3 / 3600.0 * np.pi / 180.0, 0.8338795  # rad/s/A; K_sg H k / C, V/(s.A)
NOISES = {"stand.pickoff": 2e-6, "stand.reading": 2e-4, "stand.ammeter": 5e-4}


def main() -> None:
    given = asked(__doc__, runs=100, faults=3, seed=1)
    rng, inside, broken = np.random.default_rng(given.seed), Counter[str](), 0
    with Session("test_start_up") as session:
        system = importlib.import_module(type(session.system).__module__)
        reasons = importlib.import_module(".reduction", system.__package__).REASONS
        for run in range(given.runs):
            scale, volts = 1.0 + rng.uniform(-0.03, 0.03), 5.0 + rng.uniform(-3e-3, 3e-3)
            null = rng.uniform(-3e-5, 3e-5)
            values = {
                "gyro.k": scale * K,
                "program.gain": GAIN,
                "stand.V_ref": volts,
                "stand.offset": null,
                "dwell": 6.0,
            }
            values |= {n: size * rng.uniform(0.3, 2.0) for n, size in NOISES.items()}
            record = session.run(values, seed=given.seed * 10_000 + run)
            broken += bool(record.windows["reason"].any())
            found = session.system.reduce(record)
            truths = {"reference": volts, "null": 1e3 * null, "torquer": scale * K * 10.0 / GAIN, "loop": 1.0}
            for name, truth in truths.items():
                low, high = found[name].interval
                inside[name] += bool(low <= truth <= high)
        print(f"broken off without a fault: {broken} of {given.runs}")
        for name, count in inside.items():
            low, high = clopper_pearson(count, given.runs)
            print(f"{name}: {count / given.runs:.3f} ({low:.3f} to {high:.3f})")
        for fault in system.FAULTS:
            names = Counter(
                int(session.run({"fault": fault}, seed=given.seed * 20_000 + k).windows["reason"].max())
                for k in range(given.faults)
            )
            words = [f"{reasons[r - 1] if r else 'not broken off'} {n}" for r, n in names.items()]
            print(f"{fault}: {', '.join(words)}")


if __name__ == "__main__":
    main()
