"""How often 95 % intervals hold the truth where the set-up is not ideal, with and without nuisance model.

    python tests/benchmarks/setup_effects.py [CASE ...] --runs 500 [--seed 1] [--white]

No co-simulation: windows of the single-axis tumble are written from its equations (tests/reduction/coverage.py), with
noise of the population (--white: white noise), a misalignment of the input axis, a ramp, constants from mount to mount,
an encoder that is wrong once a turn, outliers.  The same of the servo tests, of the eight positions (their x
current) and of tests in one attitude: default plans, setup_plans.py.
Standard deviation of a window 0.0022 deg/h; 72 windows a turn of 2.4 h, 10 in a dwell, as the default plan has them.
Prints the coverage of each coefficient, how wide the intervals are over those of clean records without candidates, and
in which share of the records each candidate is reported with the coefficients: of clean records, falsely.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "reduction"))
import setup_plans
from coverage import plan

from gyrobench import drift, frames
from gyrobench.reduction.estimation import noise, noise_mixture_fit, nuisances, outliers, uncertainty
from gyrobench.reduction.estimation.effects import Remount, remounts, standard_changes
from gyrobench.reduction.estimation.linear_fit import fit

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
    encoder: float = 0.0  # arcsec, times the sine of the table angle
    outliers: float = 0.0  # share of the windows that are off by thirty standard deviations, either way
    plan: str = "tumble"


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
    "encoder 30 arcsec": Case(encoder=30.0),
    "outlier 1 in 100": Case(outliers=0.01),
    **{
        f"{plan}, {name}": replace(case, plan=plan)
        for plan in setup_plans.PLANS
        for name, case in {
            "clean": Case(),
            "tilt of 20 arcsec": Case(tilt=20.0),
            "tilt of 100 arcsec": Case(tilt=100.0),
            "ramp of 0.02 deg/h": Case(ramp=0.02),
            "remount": Case(remount=SIGMA),
        }.items()
        if not (case.remount and not plan.startswith("servo")) and not (case.tilt and plan in setup_plans.STILL)
    },
}


class Bench:
    """Records of one plan and their reduction."""

    def __init__(self, order: tuple[int, ...] = ONCE, turn: int = 72, dwell: int = 10, of: str = "tumble") -> None:
        self.readings, self.names = False, NAMES
        if of in setup_plans.PLANS:
            p = setup_plans.PLANS[of]()
            self.t0, self.t1, self.X, self.names, self.readings = p.t0, p.t1, p.X, p.names, p.readings
            self.turned = None
            self._finish(p.tilt, p.mount, p.candidates)
            return
        self.t0, self.t1, self.X = plan(turn, dwell, order=order)
        self.turned = plan(turn, dwell, order=order, encoder=ARCSEC)[2] - self.X  # for 1 arcsec
        counts = [turn if p < 3 else dwell for p in order]
        role, mount = np.repeat(order, counts), np.repeat(np.arange(len(order)), counts)
        along = np.array([ALONG[int(r)] for r in role]) * frames.EARTH_RATE * np.degrees(1.0) * 3600.0
        tilt = -along * ARCSEC  # deg/h per arcsec
        found = [
            nuisances.Candidate("tilt", "misalignment", "arcsec", 1.0, tilt),
            nuisances.trend(self.t0, self.t1),
            nuisances.scatter("mount", nuisances.MOUNTS, mount.tolist()),
        ]
        self._finish(tilt, mount, found)

    def _finish(self, tilt: np.ndarray, mount: np.ndarray, candidates: list[nuisances.Candidate]) -> None:
        self.tilt, self.mount = tilt, mount
        self.time = ((self.t0 + self.t1) / 2.0 - self.t0[0]) / (self.t1[-1] - self.t0[0])
        self.truth = np.linspace(-1.0, 1.0, len(self.names))
        self.seen, self.hidden = nuisances.observable(self.X, self.names, candidates)

    def record(self, case: Case, rng: np.random.Generator, white: bool = False) -> np.ndarray:
        tau, share, reading = 1.0, 0.0, 0.0
        if not white:
            tau, share, reading = noise.sample_instrument(rng, self.t0, self.t1, self.readings)
        if case.slow:
            tau, share = 0.25 * (self.t1[-1] - self.t0[0]), case.slow
        unit = noise.process_covariance(self.t0, self.t1, tau)
        C = np.eye(self.t0.size) * (1.0 - share) + share * unit / unit[0, 0]
        e = np.linalg.cholesky(C + 1e-12 * np.eye(self.t0.size)) @ rng.standard_normal(self.t0.size)
        if reading:
            e = math.sqrt(1.0 - reading) * e + math.sqrt(reading / 2.0) * self._between_readings(rng)
        if case.outliers:
            e += 30.0 * (rng.random(e.size) < case.outliers) * rng.choice([-1.0, 1.0], e.size)
        offsets = case.remount * rng.standard_normal(self.mount.max() + 1)
        y = self.X @ self.truth + case.tilt * self.tilt + case.ramp * self.time + offsets[self.mount] + SIGMA * e
        return y if self.turned is None else y + case.encoder * self.turned @ self.truth

    def _between_readings(self, rng: np.random.Generator) -> np.ndarray:
        """Differences of readings with errors of unit variance, which neighbouring windows share."""
        first, last = rng.standard_normal((2, self.t0.size))
        joint = np.flatnonzero(np.abs(self.t0[1:] - self.t1[:-1]) < 1e-6 * (self.t1 - self.t0)[1:])
        first[joint + 1] = last[joint]
        return last - first

    def reduce(self, y: np.ndarray, how: bool | str = True, remount: float = 0.0) -> tuple[np.ndarray, ...]:
        """Errors and half widths of the coefficients, and which candidates joined; D_F is that of the middle of a ramp.

        how: with the nuisance model, or not; "named": with it, without the rows that are named as outliers; "stated":
        with it, the scatter from mount to mount stated as u_remount and in u (effects.remounts).
        """
        p = len(self.names)
        if how == "named":
            fitted = fit(self.names, self.X, y, self.t0, self.t1, [], "rate", "", 1.0, candidates=self.seen)
            odd = outliers.find(fitted)
            best = (odd.without if odd else fitted).est
            return best.beta[:p] - self.truth, best.half_width[:p], np.array([e.joined for e in best.evidence])
        blocks = [c.block for c in self.seen] if how else []
        if how == "stated":
            fitted = fit(
                self.names, self.X, y, self.t0, self.t1, [], "rate", "", 1.0,
                noise="readings" if self.readings else "estimated",
                candidates=[*self.seen, *(h.candidate for h in self.hidden)],
            )  # fmt: skip
            parts = [np.sum(standard_changes(fitted, e) ** 2, axis=0) for e in remounts(fitted, Remount(remount))]
            part = np.sum([np.zeros(fitted.value.size), *parts], axis=0)
            half = np.sqrt(fitted.reported.half_width**2 + (uncertainty.NORMAL**2) * part)[:p]
            return fitted.est.beta[:p] - self.truth, half, np.array([e.joined for e in fitted.est.evidence])
        found = noise_mixture_fit.fit(self.X, y, self.names, self.t0, self.t1, 1e3, self.readings, blocks)
        return found.beta[:p] - self.truth, found.half_width[:p], np.array([e.joined for e in found.evidence], bool)


def count(
    bench: Bench, case: Case, runs: int, seed: int, white: bool = False, candidates: bool | str = True
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coverage of the coefficients, mean half widths, share of the records in which each candidate joined and, last,
    any of them; candidates: see Bench.reduce.
    """
    rng = np.random.default_rng(seed)
    middle = case.ramp * np.mean(bench.time)
    hits, width = np.zeros((2, len(bench.names)))
    joined = np.zeros((len(bench.seen) if candidates else 0) + 1)
    for _ in range(runs):
        error, half, there = bench.reduce(bench.record(case, rng, white) - middle, candidates, case.remount)
        hits += np.abs(error) <= half
        width += half
        joined += np.append(there, there.any())
    return hits / runs, width / runs, joined / runs


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="*", help=", ".join(CASES))
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--white", action="store_true")
    given = parser.parse_args()
    benches: dict[tuple[str, tuple[int, ...]], tuple[Bench, np.ndarray]] = {}
    for name in given.case or CASES:
        case, began = CASES[name], time.monotonic()
        key = case.plan, case.order
        if key not in benches:
            bench = Bench(case.order, of=case.plan)
            benches[key] = bench, count(bench, Case(), given.runs // 2, 99, given.white, False)[1]
            print(f"{'case':<40}{'nuisances':<10}" + " ".join(f"{n[-5:]:>5}" for n in bench.names) + "   width / clean")
        bench, plain = benches[key]
        more = (["named"] if case.outliers else []) + (["stated"] if case.remount and bench.hidden else [])
        for candidates in (False, True, *more):
            held, width, joined = count(bench, case, given.runs, given.seed, given.white, candidates)
            row = " ".join(f"{v:.3f}" for v in held)
            wide = " ".join(f"{v:.2f}" for v in width / plain)
            took = f"{time.monotonic() - began:.0f} s"
            shown = candidates if isinstance(candidates, str) else "auto" if candidates else "none"
            names = [c.name for c in bench.seen] + ["any"]
            said = ", ".join(f"{n} {v:.3f}" for n, v in zip(names, joined, strict=False)) if candidates else ""
            print(f"{name:<40}{shown:<10}{row}   {wide}  {took}  {said}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
