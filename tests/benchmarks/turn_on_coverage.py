"""How often the 95 % intervals of turn-ons contain the true value, of records written straight from the equations.

    python tests/benchmarks/turn_on_coverage.py [one] [two] [hardly] [turning] [signs] [drawn] [--runs 300]
        [--population]

y = w + b_day + b_on + sum A m(t, tau) + E w m(t, tau_E) + noise, white or of the population for which intervals are
made (gyrobench.reduction.estimation.noise), over 1 to 2 days of 3 to 5 turn-ons of 300 s in
readings of 5 s; no part, no simulation.  one, two: exponentials of 1 to 5 deg/h, tau of 10 to 40 s and four times that;
hardly: the second within +-0.5 deg/h; turning: two, the scale factor with a third, at a rate in both senses; signs:
two of sizes of either sign; drawn: the warm-ups for which intervals are made, one to three exponentials, ln tau even
from a reading to twice a turn-on, one size of 1 to 5 deg/h, the others by chance with it as rms.  Where one is found of
two, A stands for their sum and tau for the time after which 1/e of it is left.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np
from held import Held
from imu_positions import noise_of

from gyrobench.arrays import Array
from systems.turn_on_repeatability.reduction import Reduction, TurnOnSetup
from systems.turn_on_repeatability.warming import Warming, means

DPH = math.pi / 648000.0
KINDS = ("one", "two", "hardly", "turning", "signs", "drawn")
LIMIT, READING, EACH = 0.3, 5.0, 60  # deg/h, s


def written(rng: np.random.Generator, kind: str, population: bool = False) -> tuple[dict[str, Array], dict[str, float]]:
    """Return windows and truth, SI."""
    days, of_day, tau = int(rng.integers(1, 3)), int(rng.integers(3, 6)), rng.uniform(10.0, 40.0)
    second = {"one": 0.0, "two": rng.uniform(1.0, 5.0), "hardly": rng.uniform(-0.5, 0.5)}.get(kind, rng.uniform(1, 5))
    size, taus = np.array([rng.uniform(1.0, 5.0), second]), np.array([tau, 4.0 * tau])
    if kind == "signs":
        size *= rng.choice([-1.0, 1.0], 2)
    if kind == "drawn":
        more = int(rng.integers(0, 3))
        size = rng.permutation(rng.choice([-1.0, 1.0]) * np.append(size[:1], size[0] * rng.normal(size=more)))
        taus = np.sort(np.exp(rng.uniform(math.log(READING), math.log(2.0 * EACH * READING), 1 + more)))
    white = 0.18 / math.sqrt(READING) * rng.uniform(0.2, 5.0)  # 0.003 deg/sqrt(h) = 0.18 deg/h sqrt(s)
    on, between, E = rng.uniform(0.0, 0.5), rng.uniform(0.0, 0.5), rng.uniform(1e-4, 1e-3)
    n = days * of_day
    turn = np.repeat(np.arange(n), EACH)
    since = np.tile(1.0 + READING * (0.5 + np.arange(EACH)), n)
    length = np.full(since.size, READING)
    bias = on * rng.normal(size=n) + between * rng.normal(size=days)[np.arange(n) // of_day]
    rate = 0.02 / DPH * (1.0 - 2.0 * (turn % 2)) if kind == "turning" else np.zeros(since.size)
    curve = means(since, length, taus) @ size + E * rate * means(since, length, np.array([120.0]))[:, 0]
    start = 400.0 * turn + since - 0.5 * READING
    noise = noise_of(rng, start, start + READING, 1.0) if population else rng.normal(size=since.size)
    y = rate + bias[turn] + curve + white * noise
    windows = {"t_start": start, "t_end": start + READING, "turn_on": turn + 1, "day": turn // of_day + 1,
               "since": since, "mean": DPH * y}  # fmt: skip
    there = np.flatnonzero(size)
    warm = Warming(size[there], taus[there])
    truth = {"A": size.sum() * DPH, "τ": warm.time_constant(1e9), "σ_on": on * DPH, "σ_day": between * DPH,
             "t_w": warm.time_until(LIMIT, 1e9)}  # fmt: skip
    truth["b"] = bias.mean() * DPH
    if there.size == 2:
        truth |= {"A_1": size[0] * DPH, "A_2": size[1] * DPH, "τ_1": taus[0], "τ_2": taus[1]}
    if kind == "turning":
        windows["rate"] = DPH * rate
        truth |= {"E": E, "τ_E": 120.0}
    return windows, truth


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="|".join(KINDS), default=list(KINDS))
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--population", action="store_true")
    given = parser.parse_args()
    bad = 0
    if unknown := set(given.kinds) - set(KINDS):
        parser.error(f"{sorted(unknown)}: {KINDS}")
    for kind in given.kinds:
        rng = np.random.default_rng([given.seed, KINDS.index(kind)])
        held = Held()
        for _ in range(given.runs):
            windows, truth = written(rng, kind, given.population)
            for c in Reduction.reduce(windows, TurnOnSetup(limit=LIMIT * DPH, truth=truth)).coefficients:
                held.count(f"{kind:<10}{c.name}", c)
        bad += held.show(18, wide=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
