"""How often the 95 % intervals of the servo tests hold the truth, on the whole co-simulation with all its noise.

    python tests/benchmarks/coverage_servo.py --runs 1000 [polar|vertical_level]

Days and dwells are shortened: the polar test turns at 500 Earth rates (a day in 172 s), the correlation time of the
drift is shortened with it, so that there are as many of them in a window as in the full test or more.

Measured: polar, 1000 runs, 0.959 .. 0.987 over the nine coefficients (D_I, D_II, D_F and D_IO above 0.97: too
wide, as the share of reading errors is left open); vertical_level, 300 runs, 0.957 .. 0.983 over the six.
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.system.run import Session
from gyrobench.system.system import load_system

ARCSEC = math.pi / 648000.0
PLANS: dict[str, tuple[str, dict[str, Any]]] = {
    "polar": (
        "servo_polar",
        {
            "site.earth_rate": 500.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "time": 172.4, "window": 4.8,
            "dwell": 48.0, "settle": 2.0, "gyro.markov_tau": 1.0, "table.quantum": 0.02 * ARCSEC,
        },
    ),
    "vertical_level": (
        "servo_vertical_level",
        {"dwell": 200.0, "cycles": 1, "settle": 2.0, "gyro.markov_tau": 10.0, "table.quantum": 0.05 * ARCSEC},
    ),
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("which", nargs="*", default=list(PLANS), help="polar, vertical_level")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    options = parser.parse_args()
    for which in options.which:
        name, values = PLANS[which]
        hits: dict[str, int] = {}
        ratio: dict[str, list[float]] = {}
        began = time.perf_counter()
        with Session(name) as session:
            for seed in range(options.first, options.first + options.runs):
                result = load_system(name).reduce(session.run(values, seed=seed))
                for c in result.coefficients:
                    inside = c.interval[0] <= c.truth <= c.interval[1]
                    hits[c.name] = hits.get(c.name, 0) + inside
                    ratio.setdefault(c.name, []).append((c.estimate - c.truth) / c.u)
        print(f"{name}: {options.runs} runs, {time.perf_counter() - began:.0f} s")
        for c, n in hits.items():
            z = np.array(ratio[c])
            print(f"  {c:6s} {n / options.runs:.3f}   z: mean {z.mean():+.2f}, rms {np.sqrt((z * z).mean()):.2f}")


if __name__ == "__main__":
    main()
