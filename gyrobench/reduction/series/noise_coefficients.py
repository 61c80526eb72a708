"""Noise coefficients N, B, K, R, Q of a rate record: estimates, and what the slopes of its Allan deviation say of them.

Model of the rate [IEEE 952, annex C], S two-sided: sigma_A^2(tau) = 4 int_0^inf S sin^4(pi f tau)/(pi f tau)^2 df,

    term                      S(f)                            sigma_A^2(tau)        unit
    N  angle random walk      N^2                             N^2/tau               rad/s/sqrt(Hz) = rad/sqrt(s)
    B  bias instability       B^2/(2 pi f)                    2 ln 2 B^2/pi         rad/s
    K  rate random walk       K^2/(2 pi f)^2                  K^2 tau/3             rad/s^2/sqrt(Hz)
    Q  quantization           (2 pi f)^2 tau0 Q^2, f << 1/tau0   3 Q^2/tau^2        rad
    R  rate ramp              (deterministic, R t)            R^2 tau^2/2           rad/s^2

B is flicker at every frequency of the record, no cutoff.  A sample is the mean of the rate over tau0, a difference of
angles; Q is the standard deviation of the error of an angle, independent from reading to reading.  Those of a
record are found with its noise model, :mod:`gyrobench.reduction.noise_model.fit`.  [DRIFT-COEFFICIENTS]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.reduction.series.deviations import Deviation


@dataclass(frozen=True)
class Estimate:
    """One coefficient; not determined: the interval of 95 % holds zero, the coefficient is below ``high``."""

    value: float
    low: float
    high: float
    determined: bool


#: Slope of the Allan deviation and what its value at tau is multiplied by: coefficient = factor * sigma * tau^-slope.
SLOPES = {
    "Q": (-1.0, 1.0 / math.sqrt(3.0)),
    "N": (-0.5, 1.0),
    "B": (0.0, math.sqrt(math.pi / (2.0 * math.log(2.0)))),
    "K": (0.5, math.sqrt(3.0)),
    "R": (1.0, math.sqrt(2.0)),
}


def slopes(deviation: Deviation) -> dict[str, Estimate]:
    """Return the coefficients as they are read from an Allan deviation, [IEEE 952, annex C]; R without its sign.

    A straight line of the slope of the term through the pair of neighbouring tau (edf of 5 or more) whose slope is
    nearest; its interval is that of the deviation there.  No pair within 0.25 of the slope: not determined, below the
    lowest line over the upper ends of the deviation.  Terms are read as if alone: where two are of like size, the
    reading is high by up to the square root of two, and the interval does not cover.
    """
    usable = (deviation.edf >= 5.0) & (deviation.deviation > 0.0)
    tau, dev = deviation.tau[usable], deviation.deviation[usable]
    low, high = deviation.low[usable], deviation.high[usable]
    local = np.diff(np.log(dev)) / np.diff(np.log(tau))
    found = {}
    for name, (slope, factor) in SLOPES.items():
        line = factor * tau**-slope
        top = float(np.min(line * high, initial=math.inf))
        i = int(np.argmin(np.abs(local - slope))) if local.size else 0
        if not local.size or abs(local[i] - slope) > 0.25:
            found[name] = Estimate(0.0, 0.0, top, False)
            continue
        value, least, most = (math.sqrt(float(y[i] * y[i + 1])) for y in (line * dev, line * low, line * high))
        found[name] = Estimate(value, least, most, True)
    return found
