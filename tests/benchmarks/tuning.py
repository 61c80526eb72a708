"""Tuned loops against brute force: a grid of all numbers of the controller, and a grid of the spread.

    python tests/benchmarks/tuning.py [SYSTEM ...]     # all, some minutes

For each system the structure `lead` (gain, two time constants), or `gain`, with the spread of two parameters.  The grid
of controllers is refined twice about its best.  Ends with exit code 1 where the worst ratio of the search is more than
2 % below that of the grid, where a promise is more than 2 % above the worst of 225 points of the spread, or where the
co-simulation contradicts.
"""

from __future__ import annotations

import itertools
import sys
import time

import numpy as np

from gyrobench.bench import Bench
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from gyrobench.tuning.controller_search import TuningProblem, box, frequencies
from gyrobench.tuning.loop_ports import loops_of
from gyrobench.tuning.plant import plants
from gyrobench.tuning.robustness import measured
from gyrobench.tuning.structures import ControllerStructure
from gyrobench.tuning.tune_loop import tune
from gyrobench.tuning.wishes import parse_wishes

DRIVE = ("platform.J", "platform.k_t")
CASES = {
    "platform_single_axis": (["phase margin=40deg", "gain margin=6dB", "bandwidth>8Hz"], DRIVE),
    "stabilizer_floated_2dof": (["phase margin=40deg", "disk margin=0.5", "bandwidth>8Hz"], DRIVE),
    "stabilizer_sdf": (["phase margin=40deg", "peak S<6dB", "bandwidth>0.05Hz"], ("platform.J", "gyro.H")),
    "table_servo_loop": (["phase margin=40deg", "gain margin=6dB", "bandwidth>15Hz"], ("table.J", "table.lag")),
    "stabilizer_power_2dof": (["phase margin=60deg", "gain margin=12dB", "bandwidth>1Hz"], ("gyro.J_x", "gyro.C_x")),
}
STRUCTURES = {"stabilizer_power_2dof": "gain"}  # others: lead
SIDE = 13  # controllers along each number
SHARE = 0.2  # of each parameter, either way
FINE = 15  # points of the spread along each parameter


def grid_of(name: str, many: list[dict[str, float]]) -> tuple[list, float]:
    """Return the plants at relative points of the spread, and the step."""
    system = load_system(name)
    with Session(system, bench=Bench.find().folder, child=True) as session:
        now, _, document = session.prepare()
        nominal = document.parameters
        at = [{n: nominal[n] * x for n, x in point.items()} for point in many]
        ports = loops_of(system)["stabilizer"]
        found = plants(session.assembly, nominal, lambda s: load_part(session.names[s]), now.step, at, ports)
        return found, now.step


def brute(name: str, wishes: list[str], names: tuple[str, str]) -> float:
    """Return the best worst ratio of a grid of controllers, over the corners and the middle of the spread."""
    corners = [dict(zip(names, p, strict=True)) for p in itertools.product((1 - SHARE, 1 + SHARE), repeat=2)]
    found, step = grid_of(name, [{}, *corners])
    shape, parsed = ControllerStructure(STRUCTURES.get(name, "lead")).of(found[0]), parse_wishes(wishes)
    wanted = load_system(name).crossovers().get("stabilizer")
    decades = box(shape, parsed, wanted, step)
    problem = TuningProblem(shape, parsed, found, decades, frequencies(found, decades, parsed, 250))
    low, high = decades.T
    best, at = -np.inf, 0.5 * (low + high)
    for _ in range(3):
        sides = [np.linspace(a, b, SIDE) for a, b in zip(low, high, strict=True)]
        for x in itertools.product(*sides):
            worst = problem.worst(np.array(x))
            if worst > best:
                best, at = worst, np.array(x)
        cell = (high - low) / (SIDE - 1)
        low, high = np.maximum(decades[:, 0], at - 1.5 * cell), np.minimum(decades[:, 1], at + 1.5 * cell)
    return float(np.exp(best))


def main() -> int:
    failed = False
    for name, (wishes, names) in CASES.items():
        if sys.argv[1:] and name not in sys.argv[1:]:
            continue
        began = time.perf_counter(), time.process_time()
        spread = [f"{n}=±{SHARE:.0%}" for n in names]
        tuned = tune(load_system(name), wishes, spread, STRUCTURES.get(name, "lead"))
        took = time.perf_counter() - began[0], time.process_time() - began[1]
        best, got = tuned.best, min(w.ratio for w in tuned.wishes)
        reached = brute(name, wishes, names)
        shares = np.linspace(1 - SHARE, 1 + SHARE, FINE)
        every = [dict(zip(names, p, strict=True)) for p in itertools.product(shares, shares)]
        fine, _ = grid_of(name, every)
        response = fine[0].controller_response(tuned.controller, tuned.f)
        loops = np.array([p.response(tuned.f) * response + p.past(tuned.f) for p in fine])
        values = measured([w.wish for w in tuned.wishes], tuned.f, loops)
        least = min(w.wish.ratio(v) for row in values for w, v in zip(tuned.wishes, row, strict=True))
        kept = all(w.kept for p in tuned.proofs for w in p.wishes) or not tuned.had
        bad = best < 0.98 * reached or least < 0.98 * got or not kept
        failed |= bad
        print(
            f"{name}: worst ratio {best:.4f}, best of the grid {reached:.4f}; "
            f"quieter {got:.4f}, worst of {len(fine)} points {least:.4f}; "
            f"proven {tuned.proven}; {took[0]:.1f} s, {took[1]:.1f} s of CPU{'   FAILED' if bad else ''}",
            flush=True,
        )
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
