"""How often the intervals of an optical loop outside of the three loops hold (platform_three_axis, loops=optical).

    python tests/benchmarks/optical_loop.py ride|loops [--runs 1000] [--workers 2] [--seed 1]

ride: the target moves; mean and rms of the tracking error, constants of error; each platform is run with 25 seeds.
loops: crossovers and margins of the tracking loops by test sines; each platform once.  Each platform is drawn: joint
angles, crossovers, images, motion of the target, drift and noises of the gyros.  What has a closed form (linear model)
is held against it, what has none (an rms error is that of signal and noise) against the other seeds' mean square.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing as mp
import sys
from collections import defaultdict
from typing import Any

import numpy as np

from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.uncertainty import clopper_pearson
from gyrobench.system.system import load_system

EACH = {"ride": 25, "loops": 1}
#: s: the largest that the current loops allow, and that of the system, for held images lead by half of one
STEP = {"ride": 2e-4, "loops": 1e-4}
DEG, DPH = math.pi / 180.0, math.pi / 648000.0
LOWEST, HIGHEST = 0.93, 0.97
Row = tuple[str, float, float, float, float]  # name, estimate, ends of the interval, closed form


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Return a platform, its target and its noises."""
    crossover = float(rng.uniform(15.0, 30.0))
    track = crossover * float(rng.uniform(0.1, 0.2))
    noise = 10.0 ** float(rng.uniform(-6.0, -4.5))
    frame = float(rng.choice([2e-3, 5e-3, 1e-2]))
    motion = {
        f"target.{name}[{k}]": size * float(rng.uniform(-1.0, 1.0))
        for name, size in (("rate", 5e-3), ("amplitude", 5e-3))
        for k in (1, 2)
    }
    gyros = {}
    for gyro in ("gyro_x", "gyro_y", "gyro_z"):
        size = 10.0 ** float(rng.uniform(-1.0, 1.0))
        gyros |= {
            f"{gyro}.D_F": float(rng.uniform(-3.0, 3.0)) * DPH,
            f"{gyro}.pickoff": 5e-8 * size,
            f"{gyro}.white": 1e-7 * size,
            f"{gyro}.markov": 0.02 * size * DPH,
        }
    return {
        **motion, **gyros,
        "pitch": float(rng.uniform(-40.0, 40.0)) * DEG, "azimuth": float(rng.uniform(-60.0, 60.0)) * DEG,
        "crossover": crossover, "track": track, "hold": max(5.0, float(rng.uniform(20.0, 60.0)) / track),
        "target.frequency": track * 10.0 ** float(rng.uniform(-2.0, -0.8)), "target.lead": float(rng.uniform(0.0, 6.0)),
        "tracker.image_noise": noise, "tracker.pixel": noise * float(rng.choice([0.0, rng.uniform(0.0, 2.0)])),
        "tracker.period": frame, "tracker.exposure": 0.4 * frame, "tracker.processing": frame,
    }  # fmt: skip


def counted(job: tuple[str, int, int]) -> list[list[Row]]:
    """Return the measures of a platform, a list for each seed."""
    plan, seed, platform = job
    system: Any = load_system("platform_three_axis")
    system.set("loops", "optical")
    system.set("sweeps", plan == "loops")
    values, found = drawn(np.random.default_rng([seed, platform])), []
    with Session(system) as session:
        for k in range(EACH[plan]):
            record = session.run(values, seed=1 + k + 25 * (platform + 100_000 * seed), step=STEP[plan])
            result = system.with_values(record.run.options).reduce(record)
            lost = [r.id for r in result.reasons if r.id in ("target.lost", "unstable")]
            if lost:
                print(f"platform {platform}: {lost[0]}", file=sys.stderr, flush=True)
                return []
            rows = []
            for c in result.coefficients:
                if not c.no_value and c.u and ("track" in c.name or plan == "ride"):
                    rows.append((c.name, c.estimate, *c.interval, math.nan if c.closed is None else c.closed))
            found.append(rows)
    return found


def held(platform: list[list[Row]]) -> dict[str, list[tuple[bool, float]]]:
    """Return whether each interval of a platform holds, and by how many half widths it misses, by name."""
    by_name: dict[str, list[tuple[float, float, float, float]]] = defaultdict(list)
    for rows in platform:
        for name, *numbers in rows:
            by_name[name].append(tuple(numbers))  # type: ignore[arg-type]
    found = {}
    for name, several in by_name.items():
        x, low, high, closed = np.array(several).T
        if np.isnan(closed).any():
            others = (np.sum(x**2) - x**2) / (x.size - 1)
            closed = np.sqrt(others)
        half = 0.5 * (high - low)
        found[name] = list(zip((low <= closed) & (closed <= high), (x - closed) / half, strict=True))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", choices=("ride", "loops"))
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    every: dict[str, list[tuple[bool, float]]] = defaultdict(list)
    jobs = [(given.plan, given.seed, k) for k in range(math.ceil(given.runs / EACH[given.plan]))]
    with mp.get_context("spawn").Pool(given.workers) as pool:
        for k, platform in enumerate(pool.imap_unordered(counted, jobs)):
            for name, rows in held(platform).items():
                every[name] += rows
            print(f"{k + 1} of {len(jobs)} platforms", file=sys.stderr, flush=True)
    outside = []
    for name, rows in every.items():
        hits = sum(bool(hit) for hit, _ in rows)
        low, high = clopper_pearson(hits, len(rows))
        errors = np.array([z for _, z in rows])
        bad = high < LOWEST or low > HIGHEST
        outside += [name] if bad else []
        words = f"{name:<18}{hits / len(rows):.3f} of {len(rows):>5} ({low:.3f} to {high:.3f})"
        words += f"  mean {errors.mean():6.2f} rms {np.sqrt(np.mean(errors**2)):.2f} of U"
        print(words + ("  OUTSIDE" if bad else ""))
    return int(bool(outside))


if __name__ == "__main__":
    sys.exit(main())
