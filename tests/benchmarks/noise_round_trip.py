"""Round trip of the noise of an instrument: record -> coefficients -> simulated gyro -> record -> coefficients.

    python tests/benchmarks/noise_round_trip.py [--runs 200] [--samples 1000] [--seed 1]

The first record is written from the equations.  What its noise model says goes into the gyro of a fixed-position test,
whose record is analysed again.  Printed: how often the interval of 95 % of the second analysis holds the value that the
gyro was given, and the mean over the runs of the Allan variance of the second record over that of the model of the
first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from asked import asked
from numpy.typing import NDArray
from scipy.signal import lfilter

from gyrobench.engine.session import Session
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.deviations import deviations
from gyrobench.reduction.series.gyro_noise import gyro_noise
from gyrobench.system.system import load_system

Array = NDArray[np.float64]
DPH = math.pi / 648000.0
PARAMETERS = {"N": "white", "B": "flicker", "K": "walk", "R": "ramp", "Q": "quantization"}
#: deg/h and s, means over 1 s: 0.0002 deg/sqrt(h), 0.004 deg/h, 0.02 deg/h/sqrt(h), 0.01 deg/h in 1000 s, 0.02 arcsec
TRUE = {"N": 0.012, "B": 0.004, "K": 0.02 / 60.0, "R": 1e-5, "Q": 0.02}


def flicker(n: int, rng: np.random.Generator) -> Array:
    """Means over unit time of S = 1/(2 pi f), f from 1e-2/n up: relaxations of variance h/pi, tau spaced by h."""
    h = math.log(10.0) / 2.0
    out = np.zeros(n)
    for tau in 10.0 ** np.arange(-4.0, math.log10(n) + 2.01, 0.5):
        p, variance = math.exp(-1.0 / tau), h / math.pi
        gain = -tau * math.expm1(-1.0 / tau)
        step = variance * -math.expm1(-2.0 / tau)
        mean = variance * (2.0 * tau * (1.0 - gain) - gain**2) if tau < 1e3 else variance * 2.0 / (3.0 * tau)
        both = variance * tau * math.expm1(-1.0 / tau) ** 2 / math.sqrt(step)
        a, b = rng.standard_normal((2, n))
        first = math.sqrt(variance) * rng.standard_normal()
        x = lfilter([1.0], [1.0, -p], math.sqrt(step) * a, zi=[p * first])[0]
        out += gain * np.append(first, x[:-1]) + both * a + math.sqrt(max(mean - both**2, 0.0)) * b
    return out


def record(n: int, rng: np.random.Generator) -> Array:
    """Rates (n,) over unit time, deg/h."""
    step, bridge = TRUE["K"] * rng.standard_normal((2, n))
    walk = np.cumsum(step) - step / 2.0 + bridge / math.sqrt(12.0)
    angle = np.diff(TRUE["Q"] * rng.standard_normal(n + 1))
    rate: Array = TRUE["N"] * rng.standard_normal(n) + TRUE["R"] * np.arange(n) + TRUE["B"] * flicker(n, rng)
    return rate + walk + angle


class Gyro:
    """A gyro at rest in its rebalance loop; k i less the Earth rate along the input axis is its drift rate."""

    def __init__(self, samples: int) -> None:
        self.session = Session(load_system("fixed_position").with_values({"readings": samples, "dwell": samples}))

    def rate(self, noise: Mapping[str, float], seed: int) -> Array:
        """Return the rate, less its mean, with parameters of the gyro."""
        values = {f"gyro.{name}": x for name, x in noise.items()} | {"rebalance.meter": 0.0}
        record = self.session.run(values, seed=seed)
        rate: Array = -float(record.run.parameters["gyro.k"]) * np.asarray(record.windows["mean"], dtype=float)
        return rate - rate.mean()


def main() -> None:
    given = asked(__doc__, runs=200, samples=1000, seed=1)
    first, second, shown = (dict.fromkeys(TRUE, 0) for _ in range(3))
    ratios, agreed = [], [0, 0]
    gyro = Gyro(given.samples)
    rng = np.random.default_rng(given.seed)
    for run in range(given.runs):
        measured = fit_noise(DPH * record(given.samples, rng), 1.0)
        drift = max(((g.sigma.value, g.tau.value) for g in measured.processes), default=(0.0, 0.0))
        noise = gyro_noise(measured.terms, 1.0, given.samples, drift)
        simulated = gyro.rate(noise, seed=1000 * given.seed + run)
        again = fit_noise(simulated, 1.0)
        agreed[0] += measured.agrees
        agreed[1] += again.agrees
        for name, parameter in PARAMETERS.items():
            e, m = again[name], measured[name]
            first[name] += m.low <= TRUE[name] * DPH <= m.high
            second[name] += e.low <= noise[parameter] <= e.high
            shown[name] += m.determined
        d = deviations(simulated, 1.0, ("allan",))["allan"]
        ratios.append((d.deviation / measured.allan(d.tau)) ** 2)
    print(f"{given.runs} records of {given.samples} samples: intervals of 95 % that hold the truth")
    print(f"records that their model describes: {agreed[0]}, of the simulated gyro {agreed[1]}")
    print(f"{'':28}" + "".join(f"{n:>8}" for n in TRUE))
    for title, count in (("the written record", first), ("that of the simulated gyro", second)):
        print(f"{title:28}" + "".join(f"{count[n] / given.runs:8.3f}" for n in TRUE))
    print(f"{'determined in the first':28}" + "".join(f"{shown[n] / given.runs:8.3f}" for n in TRUE))
    mean, error = np.mean(ratios, axis=0), np.std(ratios, axis=0) / math.sqrt(given.runs)
    print("Allan variance of the simulated record over the model of the written one")
    for tau, m, s in zip(d.tau, mean, error, strict=True):
        print(f"{tau:8.0f} s {m:8.3f} +- {s:.3f}")


if __name__ == "__main__":
    main()
