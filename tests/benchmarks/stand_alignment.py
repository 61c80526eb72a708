"""Coverage of the intervals of stand_alignment:  python tests/benchmarks/stand_alignment.py [--runs N] [--gyro]

Random stands, theodolites, dates and latitudes (12 to 70 deg), co-simulated with noise; the share of 95 % intervals
that hold the truth, by coefficient.  --gyro: a north finder in place of Polaris, its heading drawn with its u.
"""

from __future__ import annotations

import math

import numpy as np
from asked import asked
from held import Held

from gyrobench.engine.session import Session
from gyrobench.units import ARCSEC


def drawn(rng: np.random.Generator) -> dict[str, object]:
    """Return values of a run."""
    names = ("azimuth", "elevation", "collimation", "trunnion", "level_zero", "inclinometer_zero")
    year, month, day, hour = (int(rng.integers(*limits)) for limits in ((20, 35), (1, 13), (1, 28), (0, 24)))
    return {
        **{f"theodolite.{n}": float(rng.uniform(-30.0, 30.0)) * ARCSEC for n in names},
        "theodolite.lean": [float(x) * ARCSEC for x in rng.uniform(-10.0, 10.0, 2)],
        "theodolite.circle_zero": float(rng.uniform(-1.0, 1.0)), "longitude": float(rng.uniform(-3.0, 3.0)),
        "latitude": math.radians(rng.uniform(12.0, 70.0)), "start": f"20{year}-{month:02d}-{day:02d}T{hour:02d}:00",
        "sets": int(rng.integers(2, 7)),
    }  # fmt: skip


def main() -> None:
    """Count, and print a line for each coefficient."""
    given = asked(__doc__, runs=200, gyro=False)
    rng, held = np.random.default_rng(1), Held()
    with Session("stand_alignment") as session:
        for seed in range(given.runs):
            values = drawn(rng)
            if given.gyro:
                off, u = float(rng.normal()) * 3.0 * ARCSEC, 3.0 * ARCSEC
                values |= {"by": "gyro", "heading": 0.3, "theodolite.head": 0.3 + off, "u_heading": u}
            result = session.system.with_values(values).reduce(session.run(values, seed=seed + 1))
            for c in result.coefficients:
                held.count(c.name, c)
    held.show(18)
    print(f"{'all':18} {np.mean(np.concatenate([*held.hits.values()])):.4f}")


if __name__ == "__main__":
    main()
