"""Mistakes that multiply all readings of a rate or a force alike: senses and units, named by the factor they make."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gyrobench.units import G0

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

#: reading of an accelerometer over the specific force -> what makes it
FORCES = {
    -1.0: "up and down, or the sense of the accelerometer, are reversed",
    G0: "the reading is in m/s² and was given as g",
    1.0 / G0: "the reading is in g and was given as m/s²",
    1000.0: "the reading is in mg and was given as g",
    1.0e-3: "the reading is in g and was given as mg",
}


def factor_sentence(ratio: float) -> str:
    """Return that a gyro reads so many times the rate, with the mistake that makes such a factor where one is known."""
    hint = _hint(ratio, FACTORS)
    return f"The gyro reads {ratio:.4g} times the rate{hint} Check the senses and units of rates and readings."


def force_sentence(ratio: float) -> str:
    """Return the same of an accelerometer and the specific force."""
    hint = _hint(ratio, FORCES)
    return f"The accelerometer reads {ratio:.4g} times the force{hint} Check the senses and units of its readings."


def _hint(ratio: float, known: Mapping[float, str]) -> str:
    found = [text for f, text in known.items() if abs(ratio / f - 1.0) < NEAR]
    return f": {found[0]}?" if found else "."
