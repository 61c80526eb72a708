"""How often the tumble's 95 % intervals hold the truth where the set-up is not ideal, with and without nuisance model.

    python tests/benchmarks/setup_effects.py [CASE ...] --runs 500 [--seed 1] [--white]

No co-simulation: windows of the single-axis tumble are written from its equations (tests/reduction/coverage.py), with
noise of the population (--white: white noise), a misalignment of the input axis, a ramp, constants from mount to mount.
Standard deviation of a window 0.0022 deg/h; 72 windows a turn of 2.4 h, 10 in a dwell, as the default plan has them.
Prints the coverage of each coefficient, and how wide the intervals are over those of clean records without candidates.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "reduction"))
from coverage import plan

from gyrobench import drift, frames
from gyrobench.reduction.estimation import noise, noise_mixture_fit, nuisances

SIGMA = 0.0022  # deg/h, of a window
ARCSEC = np.pi / 180.0 / 3600.0
ONCE = (3, 1, 4, 2)
NAMES = drift.terms(9)
#: inertial rate along the output axis, of the Earth's: output axis up or down at 45.75 deg, on the pole at -10 + 1
ALONG = {3: 0.7163, 4: -0.7163, 1: -9.0, 2: 9.0}


@dataclass(frozen=True)
class Case:
    tilt: float = 0.0  # arcsec
    ramp: float = 0.0  # deg/h from the start of the record to its end
    remount: float = 0.0  # deg/h, standard deviation from mount to mount
    slow: float = 0.0  # share of the variance of a window in drift with a correlation time of a quarter of the record
    order: tuple[int, ...] = ONCE


CASES = {
    "clean": Case(),
    "tilt of 20 arcsec": Case(tilt=20.0),
    "tilt of 2 arcsec": Case(tilt=2.0),
    "ramp of 0.02 deg/h": Case(ramp=0.02),
    "ramp of 0.006 deg/h": Case(ramp=0.006),
    "tilt and ramp": Case(tilt=20.0, ramp=0.02),
    "slow drift": Case(slow=0.5),
    "remount, mounts repeated": Case(remount=SIGMA, order=ONCE * 3),
    "remount, mounts once": Case(remount=SIGMA),
    "clean, mounts repeated": Case(order=ONCE * 3),
}


class Bench:
    """Records of one plan and their reduction."""

    def __init__(self, order: tuple[int, ...] = ONCE, turn: int = 72, dwell: int = 10) -> None:
        self.t0, self.t1, self.X = plan(turn, dwell, order=order)
        counts = [turn if p < 3 else dwell for p in order]
        role, self.mount = np.repeat(order, counts), np.repeat(np.arange(len(order)), counts)
        along = np.array([ALONG[int(r)] for r in role]) * frames.EARTH_RATE * np.degrees(1.0) * 3600.0
        self.tilt = -along * ARCSEC  # deg/h per arcsec
        self.time = ((self.t0 + self.t1) / 2.0 - self.t0[0]) / (self.t1[-1] - self.t0[0])
        self.truth = np.linspace(-1.0, 1.0, 9)
        found = [
            nuisances.Candidate("tilt", "misalignment", "arcsec", 1.0, self.tilt),
            nuisances.trend(self.t0, self.t1),
            nuisances.scatter("mount", "remount", self.mount.tolist()),
        ]
        self.seen, self.hidden = nuisances.observable(self.X, NAMES, found)

    def record(self, case: Case, rng: np.random.Generator, white: bool = False) -> np.ndarray:
        tau, share, _ = (1.0, 0.0, 0.0) if white else noise.sample_instrument(rng, self.t0, self.t1)
        if case.slow:
            tau, share = 0.25 * (self.t1[-1] - self.t0[0]), case.slow
        unit = noise.process_covariance(self.t0, self.t1, tau)
        C = np.eye(self.t0.size) * (1.0 - share) + share * unit / unit[0, 0]
        e = SIGMA * np.linalg.cholesky(C + 1e-12 * np.eye(self.t0.size)) @ rng.standard_normal(self.t0.size)
        offsets = case.remount * rng.standard_normal(self.mount.max() + 1)
        return self.X @ self.truth + case.tilt * self.tilt + case.ramp * self.time + offsets[self.mount] + e

    def reduce(self, y: np.ndarray, candidates: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Errors and half widths of the nine coefficients; D_F is that of the middle of a ramp."""
        blocks = [c.block for c in self.seen] if candidates else []
        found = noise_mixture_fit.fit(self.X, y, NAMES, self.t0, self.t1, blocks=blocks)
        return found.beta[:9] - self.truth, found.half_width[:9]


def count(
    bench: Bench, case: Case, runs: int, seed: int, white: bool = False, candidates: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Coverage of the nine coefficients, and mean half widths."""
    rng = np.random.default_rng(seed)
    middle = case.ramp * np.mean(bench.time)
    hits, width = np.zeros(9), np.zeros(9)
    for _ in range(runs):
        error, half = bench.reduce(bench.record(case, rng, white) - middle, candidates)
        hits += np.abs(error) <= half
        width += half
    return hits / runs, width / runs


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="*", help=", ".join(CASES))
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--white", action="store_true")
    given = parser.parse_args()
    print(f"{'case':<28}{'nuisances':<10}" + " ".join(f"{n[2:]:>5}" for n in NAMES) + "   width over clean, plain")
    benches: dict[tuple[int, ...], tuple[Bench, np.ndarray]] = {}
    for name in given.case or CASES:
        case, began = CASES[name], time.monotonic()
        if case.order not in benches:
            bench = Bench(case.order)
            benches[case.order] = bench, count(bench, Case(), given.runs // 2, 99, given.white, False)[1]
        bench, plain = benches[case.order]
        for candidates in (False, True):
            held, width = count(bench, case, given.runs, given.seed, given.white, candidates)
            row = " ".join(f"{v:.3f}" for v in held)
            wide = " ".join(f"{v:.2f}" for v in width / plain)
            took = f"{time.monotonic() - began:.0f} s"
            print(f"{name:<28}{'auto' if candidates else 'none':<10}{row}   {wide}  {took}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
