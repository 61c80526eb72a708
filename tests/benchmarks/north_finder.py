"""North finding, counted: is the heading unbiased, is sigma right, do the intervals hold; how long ten thousand take.

    python tests/benchmarks/north_finder.py [METHOD ...] [--runs 3000] [--time 300] [--trend] [--population] [--drift N]

Each run draws heading, latitude (to 70 deg), bias of the gyro and, for tilt and strapdown, the attitude (tilt: 10 mrad,
strapdown: 0.5 rad), and is a co-simulation at 1 kHz.  Printed: mean error of the finder over its sigma, and rms over
sigma, both with the standard error they have by chance, and how often the 95 % interval of the reduction holds the
heading.  The noise is white; --trend leaves the nuisance model in (a linear drift of the bias may be there).
--population: noise of the same variance of a window from the population that intervals are made for (README): how often
they hold, no more, as the sigma of the finder is that of white noise.
--drift: a linear and a quadratic drift of the bias are drawn and estimated up to the order N (several: there and back).
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))
from gyrobench import units
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation import noise
from gyrobench.system.system import load_system
from systems.north_finder import plans
from systems.north_finder.reduction import Reduction

DPH = units.factor("deg/h")


def drawn(method: str, rng: np.random.Generator) -> dict[str, Any]:
    heading = rng.uniform(0.6, math.pi - 0.6) if method in plans.SIDED else rng.uniform(-math.pi, math.pi)
    values: dict[str, Any] = {"method": method, "heading": float(heading), "latitude": float(rng.uniform(-1.22, 1.22))}
    tilt = {"tilt": 0.01}.get(method, 0.5 if method.startswith("strapdown") else 0.0)
    values |= {"pitch": float(rng.uniform(-tilt, tilt)), "roll": float(rng.uniform(-tilt, tilt))}
    values["gyro.bias"] = [0.0, 0.0] if method == "strapdown" else rng.normal(0.0, 5e-7, 2).tolist()
    return values


def coloured(windows: dict[str, Any], rng: np.random.Generator) -> dict[str, float]:
    """Noise of an instrument of the population, of the variance that the white noise of the part leaves in a window."""
    t0, t1 = (np.unique(np.asarray(windows[n], dtype=float)) for n in ("t_start", "t_end"))
    tau, share, _ = noise.sample_instrument(rng, t0, t1)
    window = float(np.median(t1 - t0))
    white = 0.3 * DPH
    drift = white * math.sqrt(share / window / float(noise.mean_variance(np.array(window / tau))))
    return {
        f"gyro.{name}_{axis}": value for axis in "xy"
        for name, value in (("white", white * math.sqrt(1.0 - share)), ("markov", drift))
    } | {f"gyro.markov_{axis}_tau": tau for axis in "xy"}  # fmt: skip


def counted(job: tuple[str, int, int, float, bool, bool, int]) -> list[tuple[float, float, bool]]:
    """Errors of the finder over its sigma, and whether the interval of the reduction holds."""
    method, first, runs, total, trend, population, order = job
    windows: dict[str, Any] = {}
    system = load_system("north_finder")
    system.set("method", method)
    found = []
    with Session(system) as session:
        for k in range(first, first + runs):
            rng = np.random.default_rng(k)
            values = drawn(method, rng) | {"time": total}
            if order:
                ramp, curve = (float(rng.normal()) * DPH / total**power for power in (1, 2))
                values |= {"drift_order": order, "gyro.ramp": [0.0, ramp], "gyro.curve": [0.0, curve * (order > 1)]}
                values |= {"back": method in ("four", "several")}
            if population:
                windows = windows or session.run(values, seed=k).windows
                values |= coloured(windows, rng)
            record = session.run(values | {"nuisances": "auto" if trend else "none"}, seed=k)
            error = math.remainder(float(record.channels["finder.heading"][-1]) - values["heading"], 2.0 * math.pi)
            psi = Reduction.from_record(record)["ψ"]
            held = psi.interval[0] <= float(psi.truth or 0.0) <= psi.interval[1]
            found.append((error, float(record.channels["finder.sigma"][-1]), held))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("method", nargs="*", default=list(plans.PARTS))
    parser.add_argument("--runs", type=int, default=3000)
    parser.add_argument("--time", type=float, default=300.0)
    parser.add_argument("--trend", action="store_true")
    parser.add_argument("--population", action="store_true")
    parser.add_argument("--drift", type=int, default=0, choices=range(4))
    given = parser.parse_args()
    begun = time.perf_counter()
    for method in given.method:
        n = 50
        jobs = [
            (method, k, min(n, given.runs - k), given.time, given.trend, given.population, given.drift)
            for k in range(0, given.runs, n)
        ]
        with Pool(2) as pool:
            rows = [row for part in pool.imap(counted, jobs) for row in part]
        z = np.array([e / s for e, s, _ in rows])
        rms = float(np.sqrt(np.mean(z**2)))
        held = float(np.mean([h for *_, h in rows]))
        size = len(rows)
        moments = (
            f"mean {np.mean(z):+.3f} ± {1 / math.sqrt(size):.3f} sigma, rms {rms:.3f} ± "
            f"{1 / math.sqrt(2 * size):.3f} sigma, "
        )
        print(
            f"{method:<15}{size} runs: {'' if given.population else moments}held {held:.3f} ± "
            f"{math.sqrt(0.95 * 0.05 / size):.3f}",
            flush=True,
        )
    total = given.runs * len(given.method)
    print(f"{total} north findings of {given.time:g} s in {time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
