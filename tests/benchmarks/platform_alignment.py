"""Alignment of a gyro platform, counted: does the interval of the controller hold the true heading.

    python tests/benchmarks/platform_alignment.py [--runs 50] [--base rest]

Each run draws latitude (to 63 deg), heading and tilt at switch-on, grade, order and accelerometer biases of the grade;
drifts are drawn in the gyros.  For one and two positions, --runs each: errors over their standard deviation by the
coarse stage, when it is ready and at the end, their rms with the standard error by chance, and how often the 95 %
interval held.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from asked import asked

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system
from systems.platform_alignment import plans
from systems.platform_alignment.record import read

ARCMIN = math.pi / 10800.0


def drawn(positions: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return a random alignment; wanted: somewhat above what the sensors can reach at this latitude."""
    grade = str(rng.choice(list(plans.GRADES)))
    s, latitude = plans.GRADES[grade], float(rng.uniform(-1.1, 1.1))
    floor = (s.bias if positions == 1 else 0.5 * s.bias) / (7.2921159e-5 * math.cos(latitude))
    return {
        "positions": positions, "grade": grade, "latitude": latitude, "order": int(rng.integers(2, 4)),
        "heading": float(rng.uniform(-math.pi, math.pi)), "pitch": float(rng.uniform(-0.05, 0.05)),
        "roll": float(rng.uniform(-0.05, 0.05)), "wanted": float(rng.uniform(1.2, 2.5) * floor), "time": 1200.0,
        "accelerometers.bias": rng.normal(0.0, s.accelerometer, 3).tolist(),
    }  # fmt: skip


def main() -> None:
    given = asked(__doc__, runs=50, base="rest")
    begun = time.perf_counter()
    for positions in (1, 2):
        system = load_system("platform_alignment")
        system.set("base", given.base)
        rows, ready = [], []
        with Session(system) as session:
            for k in range(given.runs):
                run = read(session.run(drawn(positions, np.random.default_rng(k)), seed=k))
                z = run.error / run.sigma
                at = int(np.argmax(run.ready == 1.0)) if run.ready.any() else -1
                coarse = run.first(plans.TO_NORTH)
                assert coarse is not None and run.status[-1] == 1.0
                rows.append([z[coarse], z[at], z[-1]])
                ready.append(float(run.t[at]) if run.ready.any() else math.nan)
        z = np.array(rows)
        for k, stage in enumerate(("coarse", "ready", "end")):
            rms, held = math.sqrt(float(np.mean(z[:, k] ** 2))), float(np.mean(np.abs(z[:, k]) < 1.96))
            print(
                f"{given.base}, positions {positions}, {stage:<7}{len(z)} runs: mean {z[:, k].mean():+.2f}, "
                f"rms {rms:.2f} ± {1 / math.sqrt(2 * len(z)):.2f}, held {held:.3f} ± {math.sqrt(0.0475 / len(z)):.3f}",
                flush=True,
            )
        print(f"ready: {np.isfinite(ready).sum()} of {len(ready)}, median {np.nanmedian(ready):.0f} s")
    print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
