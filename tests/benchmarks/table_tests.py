"""How often 95 % intervals of the tests of a table hold the truth, over random tables.

python tests/benchmarks/table_tests.py [--runs 300] [--test table_rate_test]

Rate and position tests are campaigns, on all cores, and in a file: campaigns/table_rate_test.toml.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from asked import asked

import gyrobench as gb

sys.path[:0] = [str(Path(__file__).parents[1] / room) for room in ("support", "systems")]
import test_table_motor  # noqa: E402

ARCSEC = math.pi / 648000


def rate_test(seed: int) -> dict[str, Any]:
    """Values of one rate test of a random table: time base, scale errors, inertia, poles and rates drawn."""
    rng = np.random.default_rng(seed)
    rates = " ".join(f"{x:.2f}" for x in 10 ** rng.uniform(0.0, 3.3, 2))
    values: dict[str, Any] = {"rates": rates, "dwell": f"{rng.uniform(5, 15):.2f}", "settle": "1s"}
    values["command.reference_clock"] = rng.normal(0, 1e-5)
    values["body.axis_J"] = rng.uniform(1.0, 6.0)
    values["command.reference_acceleration"] = 0.5
    values["pole"] = rng.uniform(0.4, 0.7)
    for name, size in (("eccentricity", 0.3), ("tilt", 0.15)):
        values[f"reader.encoder_{name}"] = size * ARCSEC * rng.normal()
        values[f"reader.encoder_{name}_phase"] = rng.uniform(0, 2 * math.pi)
    for name in ("pitch", "d0", "de", "e3"):
        values[f"reader.encoder_{name}"] = 0.0
    # twice in a cycle, an amplitude of 0.1 arcsec with any phase: d0 and de are electrical, halved
    cycle = 0.1 * ARCSEC * rng.normal()
    phase = rng.uniform(0, 2 * math.pi)
    values["reader.encoder_de"] = 720 * cycle * math.cos(phase)
    values["reader.encoder_d0"] = 720 * cycle * math.sin(phase)
    return values


def position_test(seed: int) -> dict[str, Any]:
    """Values of one position test of a random table: scale, polygon, wobble, tilt, plate and noise drawn."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {"move_rate": "8deg/s", "settle": "0.5s", "dwell": "0.2s"}
    sizes = {"reader.encoder_eccentricity": 0.5, "reader.encoder_tilt": 0.3, "wobble.amplitude": 0.0}
    for name, size in sizes.items():
        values[name] = size * ARCSEC * rng.normal()
        phase = name.replace("amplitude", "phase") if "wobble" in name else f"{name}_phase"
        values[phase] = rng.uniform(0, 2 * math.pi)
    values["wobble.amplitude"] = rng.uniform(0, 2) * ARCSEC
    for k in range(1, 13):
        values[f"reference.errors[{k}]"] = rng.normal() * ARCSEC
    for name in ("body.tilt", "reference.plate", "reference.level_zero"):
        for k in (1, 2):
            values[f"{name}[{k}]"] = 5 * rng.normal() * ARCSEC
    values["reference.optical"] = 10 ** rng.uniform(-2, -0.5) * ARCSEC
    return values


DRAWN = {"table_rate_test": rate_test, "table_position_test": position_test}
TESTS = [*DRAWN, "table_motor_test"]


def rows(test: str, runs: int, first: int = 1) -> list[dict[str, Any]]:
    """The table of a campaign, as in campaigns/table_rate_test.toml."""
    return [{**DRAWN[test](seed), "seed": seed} for seed in range(first, first + runs)]


def held_in_campaign(test: str, runs: int, first: int) -> list[tuple[str, bool]]:
    """Name of each estimate whose truth is known, and whether its interval holds that."""
    frame = gb.campaign({"system": test, "table": rows(test, runs, first), "keep": "none"})
    assert set(frame["state"]) == {"done"}, frame["reason"].dropna().tolist()[:3]
    found = []
    for name in [c.removesuffix(".truth") for c in frame.columns if c.endswith(".truth")]:
        low, high, truth, estimate = (frame[f"{name}.{k}"] for k in ("lo", "hi", "truth", "estimate"))
        known = truth.notna() & estimate.notna()
        found += [(name, bool(x)) for x in ((low <= truth) & (truth <= high))[known]]
    return found


def held_in_loop(runs: int, first: int) -> list[tuple[str, bool]]:
    """The same of the motor test, whose runs are made by its tests."""
    drawn = (test_table_motor.drawn(seed) for seed in range(first, first + runs))
    known = (c for run in drawn for c in run.result.coefficients if c.truth is not None and not c.no_value)
    return [(c.name, c.interval[0] <= c.truth <= c.interval[1]) for c in known]


def main() -> None:
    given = asked(__doc__, runs=300, first=1, test=["", *TESTS])
    for name in [given.test] if given.test else TESTS:
        held: Counter[str] = Counter()
        all_of: Counter[str] = Counter()
        counted = held_in_campaign(name, given.runs, given.first) if name in DRAWN else None
        for quantity, hit in held_in_loop(given.runs, given.first) if counted is None else counted:
            kind = quantity.rsplit(" ", 1)[0] if quantity[0] == "E" else quantity.split()[0]
            held[kind] += hit
            all_of[kind] += 1
        for kind, n in all_of.items():
            print(f"{name}, {kind}: {held[kind] / n:.3f} of {n}", flush=True)


if __name__ == "__main__":
    main()
