"""Coverage of stabilizers and followers:  python tests/benchmarks/stabilizers.py CASE [--runs N]

CASE: following (platform_following, 120 s, random places and errors), two_axis (stabilizer_power_two_axis: load steps,
servo torque, drift hold), double (double loop of stabilizer_floated_2dof: load step and drift hold).  The share of 95 %
intervals that hold the truth, by measure: the simulated value, the closed form where a measure has none, and for the
largest angles, whose closed form knows no step, what the same run finds without noise.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from gimballed import session as with_plan

from gyrobench.engine.session import Session
from gyrobench.result import Coefficient
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.units import ARCMIN, DPH


def following(rng: np.random.Generator) -> dict[str, Any]:
    """Return a place, a way, errors, and slow drift of the gyros that lasts a quarter of the record to 25 times it."""
    slow = {f"{g}.markov_{c}": float(10.0 ** rng.uniform(-3.0, -1.5)) * DPH for g in ("gyro_a", "gyro_b") for c in "xy"}
    tau = {f"{g}.markov_tau": float(10.0 ** rng.uniform(1.5, 3.5)) for g in ("gyro_a", "gyro_b")}
    return slow | tau | {
        "time": 120.0, "latitude": math.radians(rng.uniform(-70.0, 70.0)), "east": float(rng.uniform(-250.0, 250.0)),
        "north": float(rng.uniform(-250.0, 250.0)), "base": int(rng.integers(0, 6)),
        "mounting": float(rng.normal() * 3.0 * ARCMIN), "torquer": float(rng.normal() * 1e-4),
        "residual": float(rng.normal() * 0.05 * DPH), "latitude_error": float(rng.normal() * ARCMIN),
    }  # fmt: skip


LARGEST = ("cross", "θ_max")
STILL: dict[str, dict[str, Any]] = {
    "two_axis": {"platform.white": 0.0},
    "double": {f"gyro.{n}_{c}": 0.0 for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"},
}


def reduced(session: Session, values: dict[str, Any], seed: int) -> dict[str, Coefficient]:
    """Return what a run finds, by name."""
    record = session.run(values, seed=seed)
    return {c.name: c for c in session.system.with_values(record.run.options).reduce(record).coefficients}


def case(name: str) -> tuple[Session, Any]:
    """Return the prepared system and what draws the values of a run."""
    if name == "following":
        return Session("platform_following"), following
    hold = LoopPhase("drift", "hold", settle=3.0, dwell=15.0)
    if name == "double":
        steps = LoopPlan([LoopPhase("load step", "torque", "step", 1, 1.0, settle=1.0, dwell=3.0), hold])
        parts = {"stabilizer": "stabilizer_double_loop"}
        prepared = with_plan("stabilizer_floated_2dof", parts=parts, plan=lambda self: steps)
        return prepared, lambda rng: {"loops": "double", "position_loop": float(rng.uniform(5.0, 15.0))}
    load = [
        LoopPhase(f"load about {a}", "torque", "step", k, 1.0, settle=3.0, dwell=3.0) for k, a in ((1, "x"), (2, "y"))
    ]
    servo = LoopPhase("servo torque", "torque", "constant", 3, 0.02, settle=3.0, dwell=3.0)
    plan = LoopPlan([*load, servo, hold])
    prepared = with_plan("stabilizer_power_two_axis", plan=lambda self: plan)
    return prepared, lambda rng: {"K_m": float(rng.uniform(60.0, 400.0)), "drift": float(rng.normal() * 0.3 * DPH)}


def main() -> None:
    """Count, and print a line for each measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", choices=("following", "two_axis", "double"))
    parser.add_argument("--runs", type=int, default=50)
    given, rng, held = parser.parse_args(), np.random.default_rng(1), dict[str, list[bool]]()
    prepared, draw = case(given.case)
    with prepared as session:
        for seed in range(given.runs):
            values = draw(rng)
            found = reduced(session, values, seed + 1)
            still = {} if given.case == "following" else reduced(session, values | STILL[given.case], seed + 1)
            for c in found.values():
                true = c.truth if c.truth is not None else c.closed
                true = still[c.name].estimate if c.name.startswith(LARGEST) else true
                if true is not None:
                    held.setdefault(c.name, []).append(c.interval[0] <= true <= c.interval[1])
    for name, rows in held.items():
        print(f"{name:18} {sum(rows) / len(rows):.3f} of {len(rows)}")


if __name__ == "__main__":
    main()
