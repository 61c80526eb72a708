"""Jitter of random gimbals against their linear budgets:  python tests/benchmarks/jitter_budget.py [count]

Each has random inertias with products, unbalance, form, joint angles, mode, friction, cogging, cables, gyro and base
spectra; a ride of 60 s from 1 Hz.  Printed: co-simulated over budget, its u, and how many are within 5 % and 2 u.  Then
a source may be as large as the report allows it for WANTED times the jitter, and the ride is taken again with it.
"""

from __future__ import annotations

import math
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

COUNT = 20
WANTED = 1.3  # times the jitter of the budget
QUANTITIES = {"gyro_noise": math.radians(1.0), "psd_scale": 1.0, "platform.stiction": 1.0}  # options, SI of a unit


def inertia(rng: np.random.Generator, about: list[float]) -> dict[tuple[int, int], float]:
    """Return an inertia matrix with these moments and small products."""
    found = {(k + 1, k + 1): x for k, x in enumerate(about)}
    for i, j in ((1, 2), (1, 3), (2, 3)):
        found[i, j] = found[j, i] = float(rng.uniform(-0.08, 0.08)) * min(about)
    return found


def gimbal(rng: np.random.Generator, folder: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """Return options and parameters of a random gimbal."""
    size = float(rng.uniform(0.5, 2.0))
    f = np.geomspace(rng.uniform(0.1, 0.5), rng.uniform(30.0, 100.0), 6)
    rows = 10.0 ** rng.uniform(-1.0, 0.5, (6, 3)) / (1.0 + (f[:, None] / 4.0) ** 2.5)
    file = folder / "base.csv"
    head = "frequency [Hz],rate_x [deg2/s2/Hz],rate_y [deg2/s2/Hz],rate_z [deg2/s2/Hz]"
    file.write_text("\n".join([head, *(",".join(f"{x:.6g}" for x in (a, *r)) for a, r in zip(f, rows, strict=True))]))
    form = str(rng.choice(["yaw-pitch", "pitch-yaw"]))
    inner, outer = ("pitch", "yaw") if form == "yaw-pitch" else ("yaw", "pitch")
    options = {
        "form": form, inner: float(rng.uniform(-0.7, 0.7)), outer: float(rng.uniform(-1.0, 1.0)),
        "bending": float(rng.uniform(38.0, 70.0)), "crossover": float(rng.uniform(6.0, 12.0)), "psd": str(file),
        "stiction": float(rng.choice([0.0, 0.0, 0.01, 0.05])) * size, "gyro_noise": 10.0 ** rng.uniform(-4.5, -3.5),
        "sweeps": False, "base": 0.0, "load_step": 0.0,
    }  # fmt: skip
    values = {}
    for name, about in (("I_outer", [0.03, 0.03, 0.03]), ("I_inner", [0.045, 0.035, 0.045])):
        for (i, j), x in inertia(rng, [size * float(a * rng.uniform(0.8, 1.2)) for a in about]).items():
            values[f"platform.{name}[{i},{j}]"] = x
    for k in (1, 2):
        values[f"platform.J_motor[{k}]"] = 0.005 * size
        values[f"platform.viscous[{k}]"] = float(rng.uniform(0.005, 0.05))
        values[f"platform.cable[{k}]"] = float(rng.choice([0.0, 0.2]))
        values[f"platform.cogging[{k}]"] = float(rng.choice([0.0, 0.005]))
        for j in (1, 2, 3):
            values[f"platform.unbalance[{k},{j}]"] = float(rng.normal(0.0, 5e-4))
    return options, values


def ridden(options: dict[str, Any], values: dict[str, float], seed: int) -> tuple[Any, Any]:
    """Return the system and the record of a ride."""
    system: Any = load_system("gimbal_stabilization")
    for name, x in options.items():
        system.set(name, x)
    with Session(system) as session:
        return system, session.run(values, seed=seed)


def allowed(found: Any, wanted: float, k: int) -> tuple[str, float, float]:
    """Return an option, its factor and its value (SI) at which a source takes the jitter to what is wanted, µrad."""
    table = next(t for t in found({"jitter": (None, wanted)}).tables if t.id == "budget.allowance:jitter")
    rows = [r for r in table.rows if r[2] in QUANTITIES and not isinstance(r[4], str)]
    _, _, quantity, now, most, _ = rows[k % len(rows)]
    return quantity.rpartition(".")[2], most / now, most * QUANTITIES[quantity]


def main() -> None:
    rng = np.random.default_rng(2029)
    near = inside = held = 0
    count = int(sys.argv[1]) if sys.argv[1:] else COUNT
    for k in range(count):
        with TemporaryDirectory() as folder:
            options, values = gimbal(rng, Path(folder))
            system, record = ridden(options, values, k)
            result = system.reduce(record)
            wanted = WANTED * result["jitter"].closed
            name, factor, value = allowed(partial(system.reduce, record), wanted, k)
            system, record = ridden({**options, name: value}, values, k)
            reached = system.reduce(record)["jitter"].estimate / wanted
        c = result["jitter"]
        ratio, u = c.estimate / c.closed, c.u / c.closed
        source = max((row for t in result.tables if t.id == "budget.sources" for row in t.rows if row[3]),
                     key=lambda row: row[3])  # fmt: skip
        near += abs(ratio - 1.0) <= 0.05
        inside += abs(ratio - 1.0) <= c.k * u
        held += abs(reached - 1.0) <= 0.05
        print(f"{k:3d}  {c.estimate:8.1f} µrad  co-simulated/budget {ratio:.3f}, u {u:.3f}   {source[0]} "
              f"{source[3]:.0f} %, {options['form']}, inner {math.degrees(options['pitch']):.0f}°, "
              f"stiction {1e3 * options['stiction']:.0f} mN·m; co-simulated/wanted {reached:.3f} with "
              f"{factor:.2f} {name}", flush=True)  # fmt: skip
    print(f"{near} of {count} within 5 %, {inside} within their intervals")
    print(f"{held} of {count} within 5 % of {WANTED} times the jitter with a source as large as it may be")


if __name__ == "__main__":
    main()
