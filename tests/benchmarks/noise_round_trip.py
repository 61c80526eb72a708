"""Round trip of the noise of an instrument: record -> coefficients -> simulated gyro -> record -> coefficients.

    python tests/benchmarks/noise_round_trip.py [--runs 200] [--samples 1000] [--seed 1]

The first record is written from the equations (noise_coefficients.py beside this).  What is found in it goes into the
gyro of a fixed-position test, whose record is analysed again.  Printed: how often the interval of 95 % of the second
analysis holds the value that the gyro was given, and the mean over the runs of the Allan variance of the second record
over that of the model of the first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from asked import asked
from noise_coefficients import record
from numpy.typing import NDArray

from gyrobench.engine.session import Session
from gyrobench.reduction.series.deviations import deviations
from gyrobench.reduction.series.gyro_noise import gyro_noise
from gyrobench.reduction.series.noise_coefficients import fit
from gyrobench.system.system import load_system

Array = NDArray[np.float64]
DPH = math.pi / 648000.0
PARAMETERS = {"N": "white", "B": "flicker", "K": "walk", "R": "ramp", "Q": "quantization"}
#: deg/h and s, means over 1 s: 0.0002 deg/sqrt(h), 0.004 deg/h, 0.02 deg/h/sqrt(h), 0.01 deg/h in 1000 s, 0.02 arcsec
TRUE = {"N": 0.012, "B": 0.004, "K": 0.02 / 60.0, "R": 1e-5, "Q": 0.02}


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
    ratios = []
    gyro = Gyro(given.samples)
    rng = np.random.default_rng(given.seed)
    for run in range(given.runs):
        measured = fit(DPH * record(given.samples, TRUE, False, rng), 1.0)
        noise = gyro_noise(measured, 1.0, given.samples)
        simulated = gyro.rate(noise, seed=1000 * given.seed + run)
        again = fit(simulated, 1.0)
        for name, parameter in PARAMETERS.items():
            e, m = getattr(again, name), getattr(measured, name)
            first[name] += m.low <= TRUE[name] * DPH <= m.high
            second[name] += e.low <= noise[parameter] <= e.high
            shown[name] += m.determined
        d = deviations(simulated, 1.0, ("allan",))["allan"]
        ratios.append((d.deviation / measured.allan(d.tau)) ** 2)
    print(f"{given.runs} records of {given.samples} samples: intervals of 95 % that hold the truth")
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
