"""Designs of tests: predicted against counted uncertainty, and the time against the system's own plan.

    python tests/benchmarks/designs.py [CASE ...] [--runs N]

Each case is designed, its plan run N times with seeds of their own.  Printed: time over that of the system's own plan
at equal uncertainty; over all values the root mean square of predicted over mean stated u, and of predicted over
counted rms error, with the standard error that N runs leave to a single value (values of one run are correlated).
"""

from __future__ import annotations

import math
import time

import numpy as np
from asked import asked

from gyrobench.design.shortest_test import design_test
from gyrobench.system.system import load_system

#: a day in fifty of the two-axis servo test: Earth, moves, correlation of the drift so much faster
DAY = {
    "site.earth_rate": "3.646e-3rad/s", "time": "1728s", "window": "12s", "settle": "2s", "cage_x.i_max": "10A",
    "cage_y.i_max": "10A", "outer.index_rate": "0.25rad/s", "inner.index_rate": "0.25rad/s", "gyro.markov_tau": "6s",
    "gyro.pickoff_x": "5e-9V/sqrt(Hz)", "gyro.pickoff_y": "5e-9V/sqrt(Hz)",
}  # fmt: skip
CASES: dict[str, tuple[str, dict[str, str], dict[str, str]]] = {
    "accelerometer, k2": ("accelerometer_multipoint", {"k2": "0.5ug/g2"}, {}),
    "accelerometer, all": ("accelerometer_multipoint", {}, {}),
    "two-axis tumble, D_I and D_F": ("tumble_two_axis", {"D_I": "0.001deg/h/g", "D_F": "0.002deg/h"}, {}),
    "two-axis tumble, all": ("tumble_two_axis", {}, {}),
    "single-axis tumble, D_I and D_F": ("tumble_single_axis", {"D_I": "0.001deg/h/g", "D_F": "0.002deg/h"}, {}),
    "north finder": ("north_finder", {"ψ": "0.2deg"}, {}),
    "four accelerometers": ("accelerometer_four", {}, {}),
    "IMU, bias and scale factors": ("imu_positions", {"bg_x": "0.05deg/h", "Sa_xx": "20ppm", "Sg_zz": "5ppm"}, {}),
    "eight positions, scale factors": ("eight_position", {"k_x": "0.002deg/h/mA", "k_y": "0.002deg/h/mA"}, {}),
    "eight positions, all": ("eight_position", {}, {}),
    "two-axis servo, all": ("servo_two_axis", {}, DAY),
}


def main() -> None:
    given = asked(__doc__, "cases", runs=300)
    for name in given.cases or CASES:
        system, wants, values = CASES[name]
        start = time.perf_counter()
        found = design_test(load_system(system).with_values(values), wants, count=given.runs)
        u, error = ([], [])
        for v in found.values.values():
            counted = found.counted[v.name]
            u.append(v.u / counted[0])
            error.append(v.error / counted[1])
        rms = [math.sqrt(float(np.mean(np.square(x)))) for x in (u, error)]
        print(
            f"{name}: {found.time:.0f} s, {found.time / found.book_time:.2f} of own {found.book_time:.0f} s; "
            f"predicted over stated u {rms[0]:.3f} ({min(u):.3f} to {max(u):.3f}), over rms error {rms[1]:.3f} "
            f"({min(error):.3f} to {max(error):.3f}), +-{1.0 / math.sqrt(2.0 * given.runs):.3f}; "
            f"bound {found.bound:.0f} s; {time.perf_counter() - start:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
