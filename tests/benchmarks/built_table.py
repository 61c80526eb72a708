"""Processor time of a tumble on the table as it is built with pulse-width rebalance, against the kinematic one.

    python tests/benchmarks/built_table.py [--rounds 3] [--turns 1] [--write]

Both run the default tumble (5.5 hours at 1 ms) in turn; the servo inside the table at 0.1 ms, the saw at 1 kHz.
Budget: 6 times the kinematic run.  The least of the rounds counts; other work on the machine lengthens both.
"""

from __future__ import annotations

import sys
import time

import quoted
from asked import asked

from gyrobench.engine.session import Session

BUDGET = 6.0
BUILT = {"table": "table_dynamic", "rebalance": "rebalance_pwm"}


def main() -> int:
    given = asked(__doc__, rounds=3, turns=1, write=(False, "write the ratio into docs/figures.toml"))
    values = {"turns": given.turns}
    least: dict[str, float] = {}
    with Session("tumble_single_axis") as kinematic, Session("tumble_single_axis", BUILT) as built:
        for k in range(given.rounds):
            for name, session in (("kinematic", kinematic), ("as built", built)):
                start = time.process_time()
                session.run(values, seed=k)
                least[name] = min(least.get(name, 1e9), time.process_time() - start)
    ratio = least["as built"] / least["kinematic"]
    for name, seconds in least.items():
        print(f"{name:<10} {seconds:.2f} s of processor time")
    print(f"ratio      {ratio:.2f} (budget {BUDGET:g})")
    if given.write:
        words = ("tests/benchmarks/built_table.py", "--rounds", str(given.rounds))
        quoted.record("speed.built_table", f"{ratio:.1f}", "times the CPU of the kinematic table", *words)
    return 0 if ratio <= BUDGET else 1


if __name__ == "__main__":
    sys.exit(main())
