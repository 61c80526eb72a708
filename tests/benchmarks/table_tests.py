"""How often 95 % intervals of the tests of a table hold the truth, over random tables.

python tests/benchmarks/table_tests.py [--runs 300] [--test table_rate_test]
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np

import gyrobench as gb

sys.path.append(str(Path(__file__).parents[1] / "systems"))
import test_table_motor

ARCSEC = math.pi / 648000


def rate_test(seed: int) -> gb.Run:
    """One rate test of a random table: time base, scale errors, inertia, poles and rates drawn."""
    rng = np.random.default_rng(seed)
    rates = " ".join(f"{x:.2f}" for x in 10 ** rng.uniform(0.0, 3.3, 2))
    test = gb.load("table_rate_test", rates=rates, dwell=f"{rng.uniform(5, 15):.2f}", settle="1s")
    test.set("command.reference_clock", rng.normal(0, 1e-5))
    test.set("body.axis_J", rng.uniform(1.0, 6.0))
    test.set("command.reference_acceleration", 0.5)
    test.set("pole", rng.uniform(0.4, 0.7))
    for name, size in (("eccentricity", 0.3), ("tilt", 0.15)):
        test.set(f"reader.encoder_{name}", size * ARCSEC * rng.normal())
        test.set(f"reader.encoder_{name}_phase", rng.uniform(0, 2 * math.pi))
    for name in ("pitch", "d0", "de", "e3"):
        test.set(f"reader.encoder_{name}", 0.0)
    # twice in a cycle, an amplitude of 0.1 arcsec with any phase: d0 and de are electrical, halved
    cycle = 0.1 * ARCSEC * rng.normal()
    phase = rng.uniform(0, 2 * math.pi)
    test.set("reader.encoder_de", 720 * cycle * math.cos(phase))
    test.set("reader.encoder_d0", 720 * cycle * math.sin(phase))
    return test.run(seed=seed)


def position_test(seed: int) -> gb.Run:
    """One position test of a random table: scale, polygon, wobble, tilt, plate and noise drawn."""
    rng = np.random.default_rng(seed)
    test = gb.load("table_position_test", move_rate="8deg/s", settle="0.5s", dwell="0.2s")
    sizes = {"reader.encoder_eccentricity": 0.5, "reader.encoder_tilt": 0.3, "wobble.amplitude": 0.0}
    for name, size in sizes.items():
        test.set(name, size * ARCSEC * rng.normal())
        phase = name.replace("amplitude", "phase") if "wobble" in name else f"{name}_phase"
        test.set(phase, rng.uniform(0, 2 * math.pi))
    test.set("wobble.amplitude", rng.uniform(0, 2) * ARCSEC)
    for k in range(1, 13):
        test.set(f"reference.errors[{k}]", rng.normal() * ARCSEC)
    for name in ("body.tilt", "reference.plate", "reference.level_zero"):
        for k in (1, 2):
            test.set(f"{name}[{k}]", 5 * rng.normal() * ARCSEC)
    test.set("reference.optical", 10 ** rng.uniform(-2, -0.5) * ARCSEC)
    return test.run(seed=seed)


TESTS = {
    "table_rate_test": rate_test,
    "table_position_test": position_test,
    "table_motor_test": test_table_motor.drawn,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--test", choices=TESTS, default=None)
    given = parser.parse_args()
    for name in [given.test] if given.test else TESTS:
        held: Counter[str] = Counter()
        all_of: Counter[str] = Counter()
        for seed in range(given.first, given.first + given.runs):
            for c in TESTS[name](seed).result.coefficients:
                if c.truth is not None and not c.no_value:
                    kind = c.name.rsplit(" ", 1)[0] if c.name[0] == "E" else c.name.split()[0]
                    held[kind] += c.interval[0] <= c.truth <= c.interval[1]
                    all_of[kind] += 1
        for kind, n in all_of.items():
            print(f"{name}, {kind}: {held[kind] / n:.3f} of {n}", flush=True)


if __name__ == "__main__":
    main()
