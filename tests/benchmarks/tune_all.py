"""Every loop of every system that `tune` takes: what was promised and what the co-simulation has, at the worse point.

    python tests/benchmarks/tune_all.py [SYSTEM ...]     # all, some minutes

The wishes are 40 degrees, 6 dB and half of the system's own crossover as bandwidth, over +-20 % of the inertia where
there is one number for it.  Ends with exit code 1 where a loop is not tuned, where a wish does not hold in
co-simulation or a promised figure is another one there, or where a loop takes more than 20 s.  Systems that have a
loop and are not taken are named.
"""

from __future__ import annotations

import sys
import time

from gyrobench.bench import Bench
from gyrobench.errors import GyrobenchError
from gyrobench.system.system import System, load_system
from gyrobench.tuning.loop_ports import loops_of
from gyrobench.tuning.proof import ProvenWish
from gyrobench.tuning.tune_loop import tunable, tune

BUDGET = 20.0  # s
INERTIA = {  # one number of it
    **dict.fromkeys(("platform_single_axis", "stabilizer_floated_2dof", "stabilizer_sdf"), "platform.J"),
    "stabilizer_power_2dof": "gyro.J_x", "stabilizer_power_two_axis": "platform.J_x", "table_servo_loop": "table.J",
}  # fmt: skip
STRUCTURES = {"gimbal_stabilization": "pi+lead+notch"}  # others: what tune chooses


def with_loops() -> list[str]:
    """Return the systems of the bench that name a loop."""
    found = []
    for name in sorted(Bench.find().systems()):
        try:
            system = load_system(name)
        except GyrobenchError:  # a suite of tests
            continue
        if isinstance(system, System) and system.loops:
            found.append(name)
    return found


def one(name: str, loop: str) -> bool:
    """Tune a loop, print its row; return whether all is as it should be."""
    system = load_system(name)
    wanted = system.crossovers().get(loop) or 1.0
    wishes = ["phase margin=40deg", "gain margin=6dB", f"bandwidth>{0.5 * wanted:.3g}Hz"]
    over = [f"{INERTIA[name]}=±20%"] if name in INERTIA else []
    began = time.perf_counter()
    try:
        tuned = tune(system, wishes, over, STRUCTURES.get(name, ""), loop=loop)
    except GyrobenchError as error:
        print(f"| {name} | {loop} | refused: {error} | | | |", flush=True)
        return False
    seconds = time.perf_counter() - began
    cells = []
    for w in tuned.wishes:
        at = [p for proof in tuned.proofs for p in proof.wishes if p.wish.name == w.wish.name]
        worst = min(at, key=lambda p: p.wish.ratio(p.value), default=None)
        cells.append(_cell(worst) if worst else "not measured")
    agree = all(w.agrees for p in tuned.proofs for w in p.wishes)
    good = tuned.proven and agree and seconds < BUDGET
    print(f"| {name} | {loop} | {' | '.join(cells)} | {seconds:.1f}{'' if good else '  FAILED'} |", flush=True)
    for line in (*tuned.reasons, *tuned.notes, *(p.why_not for p in tuned.proofs if p.why_not)):
        print(f"    {line}")
    return good


def _cell(w: ProvenWish) -> str:
    """Return what was promised and what was measured, with "or more" where noise hides what is beyond."""
    text = f"{w.wish.shown(w.expected)}, {w.wish.shown(w.value)}{' or more' if w.bound else ''}"
    return text + ("" if w.agrees else "  DIFFERS")


def main() -> int:
    names = sys.argv[1:] or with_loops()
    able = tunable()
    print("| system | loop | phase margin: promised, measured | gain margin | bandwidth | s |")
    print("|---|---|---|---|---|---|")
    good = [one(name, loop) for name in names if name in able for loop in loops_of(load_system(name))]
    for name in names:
        if name not in able:
            print(f"not taken: {name}")
    return int(not all(good))


if __name__ == "__main__":
    sys.exit(main())
