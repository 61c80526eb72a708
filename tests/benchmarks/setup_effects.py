"""How often 95 % intervals hold the truth where the set-up is not ideal, with and without nuisance model.

    python tests/benchmarks/setup_effects.py [CASE ...] --runs 500 [--seed 1] [--white] [--how auto,stated | --last]

No co-simulation: windows of the single-axis tumble are written from its equations (tests/reduction/coverage.py), with
noise of the population (--white: white noise), a misalignment of the input axis, a ramp, constants from mount to mount,
an encoder that is wrong once a turn, outliers.  The same of the other drift tests (of two channels: x), with
the regressors of their default plans: setup_plans.py.
Standard deviation of a window 0.0022 deg/h; 72 windows a turn of 2.4 h, 10 in a dwell, as the default plan has them.
Prints the coverage of each coefficient, how wide the intervals are over those of clean records without candidates, and
in which share of the records each candidate is reported with the coefficients: of clean records, falsely.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import setup_plans
from asked import asked
from estimation_coverage import plan

from gyrobench import drift, frames
from gyrobench.reduction.estimation import noise, nuisances, outliers, uncertainty
from gyrobench.reduction.estimation.effects import Remount, remounts, standard_changes, with_set_up
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.setup.sources import Effect

SIGMA = 0.0022  # deg/h, of a window
ARCSEC = np.pi / 180.0 / 3600.0
ONCE = (3, 1, 4, 2)
NAMES = drift.terms(9)
#: inertial rate along the output axis, of the Earth's: output axis up or down at 45.75 deg, on the pole at -10 + 1
ALONG = {3: 0.7163, 4: -0.7163, 1: -9.0, 2: 9.0}


@dataclass(frozen=True)
class Case:
    tilt: float = 0.0  # arcsec, of the input axis: where the plan shows it
    ramp: float = 0.0  # deg/h from the start of the record to its end
    remount: float = 0.0  # deg/h, standard deviation from mount to mount
    slow: float = 0.0  # share of the variance of a window in drift with a correlation time of a quarter of the record
    order: tuple[int, ...] = ONCE
    encoder: float = 0.0  # arcsec, standard deviation of each part of an error once a turn
    mounted: float = 0.0  # arcsec, of the mount of the gyro about each of its axes
    outliers: float = 0.0  # share of the windows that are off by thirty standard deviations, either way
    plan: str = "tumble"

    @property
    def table(self) -> bool:
        """True for an error that is stated as type B, whatever the plan."""
        return bool(self.encoder or self.mounted)


OF_ALL = {
    "clean": Case(),
    "tilt of 20 arcsec": Case(tilt=20.0),
    "ramp of 0.02 deg/h": Case(ramp=0.02),
    "remount": Case(remount=SIGMA),
    "encoder 30 arcsec": Case(encoder=30.0),
    "mounted to 20 arcsec": Case(mounted=20.0),
    "outlier 1 in 100": Case(outliers=0.01),
}
CASES = {
    **OF_ALL,
    "tilt of 2 arcsec": Case(tilt=2.0),
    "ramp of 0.006 deg/h": Case(ramp=0.006),
    "tilt and ramp": Case(tilt=20.0, ramp=0.02),
    "slow drift": Case(slow=0.5),
    "remount, mounts repeated": Case(remount=SIGMA, order=ONCE * 3),
    "clean, mounts repeated": Case(order=ONCE * 3),
    **{f"{p}, {name}": replace(case, plan=p) for p in setup_plans.PLANS for name, case in OF_ALL.items()},
}


class Bench:
    """Records of one plan and their reduction."""

    def __init__(self, order: tuple[int, ...] = ONCE, turn: int = 72, dwell: int = 10, of: str = "tumble") -> None:
        self.plan = p = setup_plans.PLANS[of]() if of in setup_plans.PLANS else tumble(order, turn, dwell)
        self.names = p.names
        length, middle = p.t1 - p.t0, (p.t0 + p.t1) / 2.0
        self.time = (middle - np.average(middle, weights=length)) / (p.t1[-1] - p.t0[0])
        _, hidden = nuisances.observable(p.X, p.names, p.candidates)
        self.mounts_once = any(h.candidate.kind == "mount" for h in hidden)

    def has(self, case: Case) -> bool:
        """False where the plan has no such error, or none that it shows."""
        p = self.plan
        lacks = (case.tilt and not p.tilt.any()) or (case.remount and not p.mount.any())
        return not (lacks or (case.encoder and not p.encoder.any()) or (case.mounted and not p.mounted.any()))

    def record(self, case: Case, rng: np.random.Generator, white: bool = False) -> np.ndarray:
        p = self.plan
        tau, share, reading = 1.0, 0.0, 0.0
        if not white:
            tau, share, reading = noise.sample_instrument(rng, p.t0, p.t1, p.readings)
        if case.slow:
            tau, share = 0.25 * (p.t1[-1] - p.t0[0]), case.slow
        unit = noise.process_covariance(p.t0, p.t1, tau)
        C = np.eye(p.t0.size) * (1.0 - share) + share * unit / unit[0, 0]
        e = np.linalg.cholesky(C + 1e-12 * np.eye(p.t0.size)) @ rng.standard_normal(p.t0.size)
        if reading:
            e = math.sqrt(1.0 - reading) * e + math.sqrt(reading / 2.0) * self._between_readings(rng)
        if case.outliers:
            e += 30.0 * (rng.random(e.size) < case.outliers) * rng.choice([-1.0, 1.0], e.size)
        offsets = case.remount * rng.standard_normal(p.mount.max() + 1)
        y = p.X @ p.truth + case.tilt * p.tilt + case.ramp * self.time + offsets[p.mount] + SIGMA * e
        for rows, size in ((p.encoder, case.encoder), (p.mounted, case.mounted)):
            y = y + size * rng.standard_normal(len(rows)) @ rows if size else y
        return np.asarray(y)

    def _between_readings(self, rng: np.random.Generator) -> np.ndarray:
        """Differences of readings with errors of unit variance, which neighbouring windows share."""
        t0, t1 = self.plan.t0, self.plan.t1
        first, last = rng.standard_normal((2, t0.size))
        joint = np.flatnonzero(np.abs(t0[1:] - t1[:-1]) < 1e-6 * (t1 - t0)[1:])
        first[joint + 1] = last[joint]
        return last - first

    def reduce(self, y: np.ndarray, how: str, case: Case) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """Errors and half widths of the coefficients, and which candidates joined; D_F is that of the middle of a ramp.

        how: HOW.
        """
        p, k = self.plan, len(self.names)
        fitted = fit(
            self.names, p.X, y, p.t0, p.t1, [], "rate", "", 1.0, noise="readings" if p.readings else "estimated",
            candidates=p.candidates if how != "none" else (), limit=1e6,
        )  # fmt: skip
        if how == "named" and (odd := outliers.find(fitted)):
            fitted = odd.without
        table = self._of_table(case) if how == "stated" else []
        remount = Remount(case.remount if how == "stated" else 0.0)
        fitted = with_set_up(fitted, lambda _: table, remount=remount)
        stated = [*table, *remounts(fitted, remount)]
        parts = [np.sum(standard_changes(fitted, e) ** 2, axis=0) for e in stated]
        part = np.sum([np.zeros(fitted.value.size), *parts], axis=0)
        half = np.sqrt(fitted.reported.half_width**2 + uncertainty.NORMAL**2 * part)[:k]
        return fitted.est.beta[:k] - p.truth, half, [c.name for c, _ in fitted.joined]

    def _of_table(self, case: Case) -> list[Effect]:
        p = self.plan
        return [
            Effect(n, size, "arcsec", rows) for n, size, rows in
            (("encoder", case.encoder, p.encoder), ("mount", case.mounted, p.mounted)) if size
        ]  # fmt: skip


def tumble(order: tuple[int, ...], turn: int, dwell: int) -> setup_plans.Plan:
    """The single-axis tumble from its equations; the encoder is off by the sine of the table angle."""
    t0, t1, X = plan(turn, dwell, order=order)
    truth = np.linspace(-1.0, 1.0, len(NAMES))
    turned = (plan(turn, dwell, order=order, encoder=ARCSEC)[2] - X) @ truth
    counts = [turn if p < 3 else dwell for p in order]
    role, mount = np.repeat(order, counts), np.repeat(np.arange(len(order)), counts)
    along = np.array([ALONG[int(r)] for r in role]) * frames.EARTH_RATE * np.degrees(1.0) * 3600.0
    tilt = -along * ARCSEC  # deg/h per arcsec
    found = [
        nuisances.Candidate("tilt", "misalignment", "arcsec", 1.0, tilt),
        nuisances.trend(t0, t1),
        nuisances.scatter("mount", mount.tolist()),
    ]
    return setup_plans.Plan(t0, t1, X, NAMES, truth, mount, found, tilt, np.zeros((0, t0.size)), turned[None])


#: without candidates; with them; with them, and without the rows that are named as outliers; with them, and with what
#: the case is made with stated as type B: u_remount, u_angle1, u_mount
HOW = ("none", "auto", "named", "stated")


def count(
    bench: Bench, case: Case, runs: int, seed: int, white: bool = False, how: str = "auto"
) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Coverage of the coefficients, mean half widths, share of the records in which each candidate joined, and any."""
    rng = np.random.default_rng(seed)
    hits, width = np.zeros((2, len(bench.names)))
    joined = Counter({"any": 0})
    for _ in range(runs):
        error, half, there = bench.reduce(bench.record(case, rng, white), how, case)
        hits += np.abs(error) <= half
        width += half
        joined.update([*there, *(["any"] if there else [])])
    return hits / runs, width / runs, {n: v / runs for n, v in joined.items()}


def main() -> int:
    given = asked(
        __doc__, "case", runs=500, seed=1, white=False,
        how=(str, f"of {', '.join(HOW)}, with commas; default: those that the case has"),
        last=(False, "the last of these alone"),
    )  # fmt: skip
    benches: dict[tuple[str, tuple[int, ...]], tuple[Bench, np.ndarray]] = {}
    for name in given.case or CASES:
        case = CASES[name]
        key = case.plan, case.order
        if key not in benches:
            bench = Bench(case.order, of=case.plan)
            benches[key] = bench, count(bench, Case(), max(given.runs // 4, 50), 99, given.white, "none")[1]
            print(f"{'case':<40}{'nuisances':<10}" + " ".join(f"{n[-5:]:>5}" for n in bench.names) + "   width / clean")
        bench, plain = benches[key]
        if not bench.has(case):
            continue
        more = ["named"] * bool(case.outliers) + ["stated"] * bool(case.table or (case.remount and bench.mounts_once))
        ways = given.how.split(",") if given.how else ["none", "auto", *more]
        for how in ways if not given.last else ways[-1:]:
            began = time.process_time()
            held, width, joined = count(bench, case, given.runs, given.seed, given.white, how)
            row = " ".join(f"{v:.3f}" for v in held)
            wide = " ".join(f"{v:.2f}" for v in width / plain)
            took = f"{time.process_time() - began:.0f} s"
            said = ", ".join(f"{n} {v:.3f}" for n, v in joined.items())
            print(f"{name:<40}{how:<10}{row}   {wide}  {took}  {said}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
