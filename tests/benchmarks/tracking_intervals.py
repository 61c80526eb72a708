"""How often the intervals of a tracking gimbal hold:  python tests/benchmarks/tracking_intervals.py [--runs 200]

A target on a sine, another seed each run, 36 s of ride.  Bias, K_a and jitter against the linear model, rms errors
against their mean square over the runs.  The gyro's slow drift is off: with it a type 1 loop has another bias each run.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from asked import asked

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

VALUES: dict[str, Any] = {
    "sweeps": False, "base": 0.0, "load_step": 0.0, "acquire": 0.0, "ride": 36.0, "target": "sine",
}  # fmt: skip
DRIFTS = {f"gyro.{n}": 0.0 for n in ("turn_on", "flicker_x", "flicker_y", "walk_x", "walk_y")}


def main() -> None:
    runs = asked(__doc__, runs=20).runs
    for kind in (1, 2):
        system: Any = load_system("gimbal_tracking")
        for name, value in (VALUES | {"type": kind}).items():
            system.set(name, value)
        rows: dict[str, list[tuple[float, float, float]]] = {}
        with Session(system) as session:
            for seed in range(1, runs + 1):
                for c in system.reduce(session.run(DRIFTS, seed=seed)).coefficients:
                    if not c.no_value and c.name not in ("peak", "inside"):
                        rows.setdefault(c.name, []).append((c.estimate, c.k * c.u, c.closed or np.nan))
        for name, found in rows.items():
            x, U, closed = np.array(found).T
            by_runs = np.isnan(closed)
            true = np.where(by_runs, np.sqrt(np.mean(x**2)), closed)
            against = "runs" if by_runs.all() else f"linear model, {np.mean(closed):.5g}"
            held = 100.0 * np.mean(np.abs(x - true) <= U)
            shown = f"{x.mean():10.5g} ± {U.mean():8.3g}"
            print(f"type {kind}  {name:14s} {shown}  {held:5.1f} % of {x.size} hold ({against})", flush=True)


if __name__ == "__main__":
    main()
