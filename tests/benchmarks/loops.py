"""Coverage of loop measures, counted at length: ``python tests/benchmarks/loops.py [--runs 200] [--draws 1000]``.

The tests count the same on fewer runs: tests/systems/test_stabilizer_power_2dof.py (stiffness, platform angle and drift
of a power gyro stabilizer), tests/reduction/test_margins.py (measured margins under noise) and
tests/systems/test_angle_system.py (harmonics, lags and clocks of an angle reading system).  With ``--table 60`` the
measures of tests/systems/test_servo_loop_of_a_table.py are counted instead, 4 s a run.
"""

from __future__ import annotations

import sys
from pathlib import Path

from asked import asked

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / room) for room in ("support", "systems", "reduction")]


def main() -> None:
    import test_angle_system
    import test_margins
    import test_stabilizer_power_2dof

    given = asked(
        __doc__, runs=(200, "runs of the stabilizer"), draws=(1000, "draws of measured margins"),
        table=(0, "runs of the servo loop of a table, these alone"),
    )  # fmt: skip
    if given.table:
        import test_servo_loop_of_a_table

        for name, (inside, n) in test_servo_loop_of_a_table.covered(given.table).items():
            print(f"{'table_servo_loop':24s} {name:12s} {inside / n:.3f} of {n}")
        return
    for title, counted, n in (
        ("stabilizer_power_2dof", test_stabilizer_power_2dof.covered, given.runs),
        ("measured margins, 2 u", test_margins.covered, given.draws),
    ):
        for name, inside in counted(n).items():
            print(f"{title:24s} {name:10s} {inside / n:.3f} of {n}")
    for name, share in test_angle_system.covered(given.runs).items():
        print(f"{'angle_system_test':24s} {name:13s} {share:.3f} of {given.runs}")


if __name__ == "__main__":
    main()
