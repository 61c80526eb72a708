"""Records of loops that are not of one loop all along: how often `identify` says so, and how often of whole ones.

    python tests/benchmarks/broken_records.py --runs 40                  # whole records, and each way of breaking them
    python tests/benchmarks/broken_records.py --runs 40 --friction       # whole records of loops with friction

Of each noise: records in which a strange stretch is named, in which the halves are said to differ, of all.  "computed":
the input is recorded as the controller computed it; "measured": with 2 % of noise of its own.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from friction_loops import random_friction
from identification import BAND, PERIOD, UNITS, excitation
from own_loops import PLACES, H, SampledLoop, margins_of, odd_multisine, random_platform

from gyrobench.identification.line_spectrum import find_period
from gyrobench.identification.loop_doubts import halves_of_bands
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.strange_stretch import strange_stretch

MEASURED = 0.02  # rms of the noise of a measured input
MIDDLE = 30_000


def platform(seed: int) -> tuple[np.random.Generator, SampledLoop]:
    """Return the first ordinary loop of a seed."""
    rng = np.random.default_rng(seed)
    while True:
        loop = random_platform(rng)
        if loop.stable() and margins_of(loop, *BAND)["peak S"] < 4.0:
            return rng, loop


def without(record: LoopRecord, first: int, count: int) -> LoopRecord:
    keep = np.r_[0:first, first + count : record.r.size]
    return replace(record, **{n: getattr(record, n)[keep] for n in ("r", "u", "y")})


class Count:
    def __init__(self) -> None:
        self.of: Counter[tuple[str, str]] = Counter()

    def __call__(self, kind: str, record: LoopRecord) -> None:
        self.of[kind, "all"] += 1
        self.of[kind, "strange"] += bool(strange_stretch(record))
        if not find_period(record.r):
            self.of[kind, "halves"] += bool(halves_of_bands(record, *BAND))

    def show(self, title: str) -> None:
        for kind in dict.fromkeys(k for k, _ in self.of):
            strange, halves, every = (self.of[kind, n] for n in ("strange", "halves", "all"))
            print(f"{title}, {kind}: strange {strange}, halves {halves} of {every}", flush=True)


def linear(runs: int, first: int, noise: float) -> None:
    counted = Count()
    for seed in range(first, first + runs):
        rng, loop = platform(seed)
        at, r = PLACES[seed % 3], excitation("random", rng)
        u, y = loop.run(r, at, 0.0 * r, 0.0 * r)
        torque = signal.lfilter([1.0], [1.0, -0.98], rng.standard_normal(r.size))
        torque *= noise * u.std() / torque.std()
        sensor = noise * y.std() * (rng.standard_normal(r.size) + 0.002 * np.cumsum(rng.standard_normal(r.size)))
        u, y = loop.run(r, at, torque, sensor)
        where = int(rng.integers(15_000, 45_000))
        louder = SampledLoop(loop.b, loop.a, 1.3 * loop.m, loop.n)
        for kind, share in (("computed", 0.0), ("measured", MEASURED)):
            own = share * u.std() * rng.standard_normal(u.size)
            whole = LoopRecord("random", H, r, u + own, y, at, UNITS)
            counted(f"{kind}, whole", whole)
            counted(f"{kind}, a second lost", without(whole, where, 1000))
            counted(f"{kind}, 7 samples lost", without(whole, where, 7))
            counted(f"{kind}, two pieces glued", without(whole, 20_000, 15_000))
            if louder.stable():
                other = louder.run(r, at, torque, sensor)
                late = np.arange(r.size) >= MIDDLE
                u_now, y_now = np.where(late, other[0] + own, whole.u), np.where(late, other[1], whole.y)
                counted(f"{kind}, gain 1.3 from the middle", replace(whole, u=u_now, y=y_now))
    counted.show(f"noise {noise:g}")


def friction(runs: int, first: int, noise: float) -> None:
    rng = np.random.default_rng(first)
    loops = random_friction(runs, rng)
    for kind in ("random", "multisine"):
        counted = Count()
        many = [excitation(kind, rng)[:24_000] if kind == "random" else np.tile(odd_multisine(PERIOD, rng, *BAND), 6)
                for _ in range(runs)]  # fmt: skip
        r = np.stack(many, axis=1)
        y = loops.run(r, 0.0 * r, 0.0 * r)[1]
        u, y = loops.run(r, noise * rng.standard_normal(r.shape), noise * y.std(axis=0) * rng.standard_normal(r.shape))
        for k in range(runs):
            counted("whole", LoopRecord("friction", H, r[:, k], u[:, k], y[:, k], PLACES[0], UNITS))
        counted.show(f"friction, {kind}, noise {noise:g}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--friction", action="store_true")
    asked = parser.parse_args()
    for size in (0.003, 0.03) if asked.friction else (0.001, 0.01, 0.1, 0.3):
        (friction if asked.friction else linear)(asked.runs, asked.first, size)
