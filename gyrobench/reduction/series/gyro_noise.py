"""Noise parameters of a gyro of the bench from noise coefficients, and their spectrum.  [DRIFT-RANDOM-ALLAN]"""

from __future__ import annotations

import math
from collections.abc import Mapping

from gyrobench.arrays import Array

FLICKER_TAU = 1e5  # s, or the length of the record: flicker begins at 0.46 / tau, below its first frequency
FLICKER_LOW, FLICKER_HIGH = 0.46, 0.055 * 4.0**11  # over tau: from and to where the PSD is that of flicker
ANGLE_TAU = 0.2  # of a sample: errors of readings one sample apart are correlated by e^-5 < 1 %


def gyro_noise(
    noise: Mapping[str, float], interval: float, duration: float, markov: tuple[float, float] = (0.0, 0.0)
) -> dict[str, float]:
    """Return parameters of ``floated_gyro`` by name, SI; noise: N, B, K, R, Q, SI, 0 where there is none.

    interval, duration: s, of a sample and of the record.  markov: rms (rad/s) and correlation time (s) of its
    Gauss-Markov process, 0: none.

    Flicker goes to half the sampling rate or, of more samples
    than 460,000, from the length of the record as far as the gyro has it, 5.7 decades.  The noise of a loop's current
    reading is not taken off N; the angle noise shows in the current where 0.2 interval is above the time constants of
    the loop.
    """

    return {
        "white": noise["N"],
        "flicker": noise["B"],
        "flicker_tau": max(duration, min(FLICKER_TAU, FLICKER_HIGH * 2.0 * interval)),
        "walk": noise["K"],
        "ramp": noise["R"],
        "quantization": noise["Q"],
        "quantization_tau": ANGLE_TAU * interval,
        "markov": markov[0],
        **({"markov_tau": markov[1]} if markov[0] else {}),
        "pickoff": 0.0,  # the record has it in N and Q
    }


def slow_density(noise: Mapping[str, float], f: Array) -> Array:
    """Return the two-sided PSD of a gyro's random drift but for its white part, at frequencies f above 0 (Hz).

    noise: parameters of the gyro by name, SI; one that is missing is 0.  A ramp has no PSD.
    """

    def process(rms: float, tau: float) -> Array:
        out: Array = 2.0 * rms**2 * tau / (1.0 + (2.0 * math.pi * f * tau) ** 2)
        return out

    found = process(noise.get("markov", 0.0), noise.get("markov_tau", 0.0))
    size, longest = noise.get("flicker", 0.0), noise.get("flicker_tau", 0.0)
    for j in range(12 if size else 0):  # Flicker of gyrobench.component.blocks.random_drift
        share = math.log(4.0) / math.pi * (4.0 / 3.0 if j in (0, 11) else 1.0)
        found = found + process(size * math.sqrt(share), longest / 4.0**j)
    angle = process(noise.get("quantization", 0.0), noise.get("quantization_tau", 0.0))
    w = 2.0 * math.pi * f
    return found + (noise.get("walk", 0.0) / w) ** 2 + w**2 * angle
