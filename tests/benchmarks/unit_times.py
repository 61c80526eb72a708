"""Times of the tests of units: command to report, and a lot of 100 units on two cores.

    python tests/benchmarks/unit_times.py [--lot] [--write]

imu_positions (12 positions and turns), the same over temperature, coning_test, sculling_test and turn_on_repeatability
from the command to the report, the best of three; --lot: `sweep imu_positions` with 100 seeds, site included.  Goals:
10 s and 2 min.  The machine may be shared: CPU time of all processes stands beside.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

import quoted
from asked import asked

COMMANDS = {
    "imu_positions": ("run", "imu_positions"),
    "imu_thermal": ("run", "imu_positions", "--part", "chamber=thermal_chamber"),
    "coning_test": ("run", "coning_test"),
    "sculling_test": ("run", "sculling_test"),
    "turn_on": ("run", "turn_on_repeatability"),
}
LOT = ("sweep", "imu_positions", "--seeds", "100", "--workers", "2")
ROUNDS = 3
SCRIPT = "tests/benchmarks/unit_times.py"


def seconds(command: tuple[str, ...]) -> tuple[float, float]:
    """Return wall and CPU time of a command, s."""
    with tempfile.TemporaryDirectory() as folder:
        wall, cpu = time.perf_counter(), sum(os.times()[2:4])
        out = ("--out", f"{folder}/run")
        subprocess.run([sys.executable, "-m", "gyrobench", *command, *out], check=True, capture_output=True)
        return time.perf_counter() - wall, sum(os.times()[2:4]) - cpu


def main() -> None:
    given = asked(__doc__, lot=False, write=False)
    for name, command in COMMANDS.items():
        wall, cpu = min(seconds(command) for _ in range(ROUNDS))
        print(f"{' '.join(command)}: {wall:.1f} s, {cpu:.1f} s of CPU", flush=True)
        if given.write:
            quoted.record(f"speed.{name}", f"{wall:.1f}", "s from the command to the report", SCRIPT)
    if given.lot:
        wall, cpu = seconds(LOT)
        print(f"{' '.join(LOT)}: {wall:.0f} s, {cpu:.0f} s of CPU", flush=True)
        if given.write:
            quoted.record("speed.imu_lot", f"{wall:.0f}", "s, 100 units on two cores, with their site", SCRIPT, "--lot")


if __name__ == "__main__":
    main()
