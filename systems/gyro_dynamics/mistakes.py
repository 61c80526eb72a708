"""Mistakes in taking the dynamics of a float, named by what they do to the points: senses, rate for angle, units."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gyrobench.result import Reason

from .model import AngleResponse

NEAR = 0.4  # rad, of the phase at low frequency about what it should be
BLOCKED = ("pass", "fail")


def mistakes(r: AngleResponse) -> Iterator[Reason]:
    """Yield why nothing may pass or fail, with the likely mistake."""
    start = -0.5 * math.pi if r.output else 0.0
    low = slice(0, min(4, r.f.size))
    phase = float(np.angle(np.sum(r.value[low] / np.abs(r.value[low])))) - start
    phase = math.remainder(phase, 2.0 * math.pi)
    slope = float(np.polyfit(np.log(r.f[low]), np.log(np.abs(r.value[low])), 1)[0]) - (1.0 if r.output else 0.0)
    right, other = 0.5 * math.pi, "input" if r.output else "output"
    side = -1.0 if r.output else 1.0
    for s, p, given in (
        (-1.0, -right, "the rate of the table in place of its angle"),
        (side, -side * right, f"the {other} axis along that of the table"),
    ):
        if abs(slope - s) < 0.2 and abs(phase - p) < NEAR:
            text = f"At low frequency gain and phase are those of {given}. Check the columns and axis."
            yield _doubt("response.angle", text)
            return
    if abs(phase) > math.pi - NEAR:
        text = (
            "The phase at low frequency is reversed. The sense of the pickoff or of the table is the other one. Check "
            "which is positive."
        )
        yield _doubt("response.sense", text)
        return
    late = np.unwrap(np.angle(r.value))
    if late[-1] - late[0] > 0.2:
        text = (
            "The float leads the case more and more with frequency, which none does. Are the phases given with the "
            "opposite sign? A lag is negative."
        )
        yield _doubt("response.lead", text)


def _doubt(id: str, text: str) -> Reason:
    return Reason(id, text, BLOCKED, severity="doubt")
