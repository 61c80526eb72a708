"""Noise parameters of a gyro of the bench that shows given noise coefficients.  [DRIFT-RANDOM-ALLAN]"""

from __future__ import annotations

from gyrobench.reduction.series.noise_coefficients import Estimate, NoiseCoefficients

FLICKER_TAU = 1e5  # s, or the length of the record: flicker ends at 0.46 / tau, below its first frequency
ANGLE_TAU = 0.2  # of a sample: errors of readings one sample apart are correlated by e^-5 < 1 %
#: noise of the part that is none of the five terms, or that the record has in them already
OFF = ("markov", "pickoff")


def gyro_noise(noise: NoiseCoefficients, interval: float, duration: float) -> dict[str, float]:
    """Return parameters of ``floated_gyro`` by name, SI; interval, duration: s, of a sample and of the record.

    A coefficient that the record does not determine is 0.  The noise of a loop's current reading is not taken off N;
    the angle noise shows in the current where 0.2 interval is above the time constants of the loop.
    """

    def size(e: Estimate) -> float:
        return e.value if e.determined else 0.0

    return {
        "white": size(noise.N),
        "flicker": size(noise.B),
        "flicker_tau": max(FLICKER_TAU, duration),
        "walk": size(noise.K),
        "ramp": size(noise.R),
        "quantization": size(noise.Q),
        "quantization_tau": ANGLE_TAU * interval,
        **dict.fromkeys(OFF, 0.0),
    }
