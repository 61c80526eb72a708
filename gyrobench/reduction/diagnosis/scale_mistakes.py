"""Mistakes that multiply all readings of a rate alike: senses and units, named by the factor that they make."""

from __future__ import annotations

import math

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


def factor_sentence(ratio: float) -> str:
    """Return that a gyro reads so many times the rate, with the mistake that makes such a factor where one is known."""
    known = [text for f, text in FACTORS.items() if abs(ratio / f - 1.0) < NEAR]
    hint = f": {known[0]}?" if known else ""
    return f"The gyro reads {ratio:.4g} times the rate{hint} Check the senses and units of rates and readings."
