"""Differences of readings: what intervals of a mean drift do where errors of the readings hide the drift.

    python tests/benchmarks/reading_noise.py [--runs 1000] [--largest 100]

31 readings of an angle a minute apart, the sum of white drift, a Gauss-Markov drift and the error of each reading, all
drawn step by step.  The mean drift is zero.  --largest: of the population's variance of reading errors over the rest
(noise.READING), to see what another prior would do.
"""

from __future__ import annotations

import math

import numpy as np
from asked import asked

from gyrobench.reduction.estimation import noise, noise_mixture_fit

READINGS, MINUTE, STEPS = 31, 60.0, 20
#: error of a reading ("), density of the white drift ("/sqrt(s)), correlation time (s) and rms ("/s) of the other one
RECORDS = {
    "white drift": (0.0, 1.0, 1.0, 0.0),
    "errors of the readings alone": (100.0, 0.0, 1.0, 0.0),
    "errors ten times as large as white drift makes of a minute": (77.0, 1.0, 1.0, 0.0),
    "as large": (7.7, 1.0, 1.0, 0.0),
    "fast drift, a window long": (0.0, 0.0, 60.0, 0.2),
    "slow drift, a third of the record long, below the errors": (20.0, 0.0, 600.0, 0.13),
    "the same with white drift": (20.0, 1.0, 600.0, 0.13),
}


def differences(rng: np.random.Generator, error: float, white: float, tau: float, rms: float) -> np.ndarray:
    """Return the drifts (30,) between readings, arcsec/s."""
    h = MINUTE / STEPS
    n = (READINGS - 1) * STEPS
    rate = white / math.sqrt(h) * rng.standard_normal(n)
    x, keep = rng.standard_normal(), math.exp(-h / tau)
    for k, kick in enumerate(rng.standard_normal(n)):
        rate[k] += rms * x
        x = keep * x + math.sqrt(1.0 - keep * keep) * kick
    angle = np.concatenate([[0.0], np.cumsum(rate * h)])[::STEPS] + error * rng.standard_normal(READINGS)
    return np.asarray(np.diff(angle) / MINUTE)


def main() -> None:
    given = asked(__doc__, runs=1000, largest=noise.READING[1])
    noise.READING = (noise.READING[0], given.largest)
    t = MINUTE * np.arange(READINGS - 1)
    ones = np.ones((t.size, 1))
    for name, record in RECORDS.items():
        rng = np.random.default_rng(3)
        held, z = [], []
        for _ in range(given.runs):
            found = noise_mixture_fit.fit(ones, differences(rng, *record), ["d"], t, t + MINUTE, readings=True)
            held.append(abs(found.beta[0]) <= found.half_width[0])
            z.append(found.beta[0] / found.u[0])
        print(f"{name}: {np.mean(held):.3f} of {given.runs}, rms z {np.sqrt(np.mean(np.square(z))):.2f}", flush=True)


if __name__ == "__main__":
    main()
