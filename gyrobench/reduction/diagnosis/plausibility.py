"""Coefficients of the size of the Earth rate, which a mistaken latitude, attitude or sense of rotation leaves behind.

Such mistakes change the estimates and leave the residuals as they are: with the latitude of the other sign the constant
drift of a gyro with its input axis up is wrong by 2 omega sin(latitude).  A drift of that size may be real, so this is
a warning and withholds nothing.  Of a gyro whose other coefficients are of that size, too, it is real: one of them in
six would lie near one of the rates by chance.
"""

from __future__ import annotations

import math

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.result import DriftTestResult, Reason
from gyrobench.units import DPH

NEAR = 0.03  # relative distance
RATES = ("°/h", "°/h/g", "°/h/g²")
ALONE = 3.0  # times the others, where there are others: a mistake stands out from the drift of the gyro
LEAST = 3.0  # deg/h: smaller multiples (near the pole, at the equator) are the size of drifts


def earth_rate_warnings(result: DriftTestResult, site: Location) -> list[Reason]:
    """Return which coefficients (deg/h, deg/h/g ...) are close to a component of the Earth rate or to twice of it."""
    whole = site.earth_rate / DPH
    rates = {
        "vertical component of the Earth rate": whole * abs(math.sin(site.latitude)),
        "horizontal component of the Earth rate": whole * abs(math.cos(site.latitude)),
        "Earth rate": whole,
    }
    found, others = [], []
    for c in (c for c in result.coefficients if c.unit in RATES and math.isfinite(c.estimate)):
        near = [
            (abs(abs(c.estimate) / (m * rate) - 1.0), f"{words} {name}, {plain(m * rate, 4)} °/h")
            for m, words in ((1.0, "the"), (2.0, "twice the"))
            for name, rate in rates.items()
            if m * rate > LEAST
        ]
        distance, words = min(near, default=(1.0, ""))
        if distance < NEAR:
            text = f"{c.name} = {plain(c.estimate, 4)} {c.unit} is close to {words}".replace("-", "−")
            found.append((abs(c.estimate), text))
        else:
            others.append(abs(c.estimate))
    said = [text for size, text in found if size > ALONE * max(others, default=0.0)]
    if not said:
        return []
    text = f"{'; '.join(said)}. Check the sign of the latitude, the attitudes and the sense of rotation."
    return [Reason("plausibility.earth_rate", text)]
