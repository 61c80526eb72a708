"""Mistakes that multiply all readings of a rate alike: senses and units, named by the factor that they make."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gyrobench.frames import G0
from gyrobench.reduction.estimation.sentences import plain

NEAR = 0.1  # of a factor that a mistake has
#: reading over rate -> what makes it
FACTORS = {
    -1.0: "the sense of the table or of the gyro is reversed",
    180.0 / math.pi: "the reading is in °/s and was given as rad/s, or the rate the other way",
    math.pi / 180.0: "the reading is in rad/s and was given as °/s, or the rate the other way",
    3600.0: "the reading is in °/h and was given as °/s",
    1.0 / 3600.0: "the reading is in °/s and was given as °/h",
    60.0: "a unit of the reading or of the rate is per minute",
    1.0 / 60.0: "a unit of the reading or of the rate is per minute",
    1000.0: "the reading is in a thousandth of its unit",
    1.0e-3: "the reading is in a thousand of its unit",
}


AMPLITUDES = FACTORS | {
    2.0: "the reading is peak to peak, or the rate half of that",
    0.5: "the rate is peak to peak, or the reading half of that",
    math.sqrt(2.0): "the rate is an rms value and the reading an amplitude",
    math.sqrt(0.5): "the reading is an rms value and the rate an amplitude",
}
FORCES = {
    -1.0: "up and down are reversed",
    G0: "the reading is in m/s² and was given as g",
    1.0 / G0: "the reading is in g and was given as m/s²",
    1000.0: FACTORS[1000.0],
    1.0e-3: FACTORS[1.0e-3],
}


def factor_sentence(ratio: float, factors: Mapping[float, str] = FACTORS) -> str:
    """Return that an instrument reads so many times what acts on it, with the mistake that makes such a factor where
    one is known.  factors: of a rate (FACTORS), its amplitudes (AMPLITUDES) or of specific force (FORCES).
    """
    nearest = min(factors, key=lambda f: abs(ratio / f - 1.0))  # 57.3 and 60 are not far apart
    hint = f": {factors[nearest]}?" if abs(ratio / nearest - 1.0) < NEAR else "."
    times = plain(ratio, 4)
    if factors is FORCES:
        return f"The accelerometer reads {times} times gravity{hint} Check the senses and units of the readings."
    return f"The gyro reads {times} times the rate{hint} Check the senses and units of rates and readings."
