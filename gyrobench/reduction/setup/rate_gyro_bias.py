"""What parameters of a simulated rate gyro say about its bias."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Reason
from gyrobench.units import DPH

#: parameters of rate gyros that make a steady or slow rate beside `bias`; with one of them the bias of a run is not it
BESIDE = (
    "turn_on", "flicker_x", "flicker_y", "walk_x", "walk_y", "g", "g2", "langmuir", "damping_difference",
    "frequency_difference", "drive_angle",
)  # fmt: skip

HARMONICS = 1000  # of the sawtooth: the others make 1e-3 of its square


def bias_is_all(parameters: Mapping[str, Any]) -> bool:
    """Return whether the parameter `bias` is the whole bias at rest and at the temperature of the coefficients.

    Quadrature counts where a phase error lets it through.  Not considered: field and temperature of surroundings.
    """

    def there(name: str) -> bool:
        return bool(np.any(np.asarray(parameters.get(f"gyro.{name}", 0.0), dtype=float)))

    return not (any(there(n) for n in BESIDE) or (there("quadrature") and there("phase_error")))


def word_error(parameters: Mapping[str, Any], slot: str = "gyro") -> float:
    """Return the rms error of a mean of readings in words of a simulated gyro with a filter, rad/s; 0 of others.

    Of words q and a noise of the rms s before them the square is sum over k of (q/(pi k))2/2 exp(-(2 pi k s/q)2): the
    harmonics of the sawtooth of rounding, which the noise smooths; q/sqrt(12) without it.  A white density N leaves
    s2 = 2 N2 f pi/(4 sin(pi/4)) behind a Butterworth filter of second order.  [own derivation]
    """
    q, f = (float(parameters.get(f"{slot}.{n}", 0.0)) for n in ("resolution", "bandwidth"))
    if not q or not f:
        return 0.0
    s = float(parameters.get(f"{slot}.white", 0.0)) * math.sqrt(f * math.pi / math.sqrt(2.0))
    k = np.arange(1, HARMONICS)
    return q * math.sqrt(float(np.sum(np.exp(-((2.0 * math.pi * k * s / q) ** 2)) / (2.0 * (math.pi * k) ** 2))))


def whole_angle(parameters: Mapping[str, Any]) -> bool:
    """Return whether the gyro of a run is a whole-angle one, whose drift goes round with its pattern."""
    return "gyro.readout_mismatch" in parameters


def doubts_at_rest(parameters: Mapping[str, Any]) -> list[Reason]:
    """Return what makes the mean rate of a simulated gyro at rest another one than its residuals show: the angles at
    which the pattern of a whole-angle gyro stood, a dither in the output.
    """
    text = (
        "The drift of a whole-angle gyro goes round with its pattern: what is found at rest is that of the angles at "
        "which the pattern stood, and changes as it turns. rate_table_test turns it."
    )
    pattern = [Reason("gyro.pattern", text, ("pass", "fail"), severity="doubt")] * whole_angle(parameters)
    return pattern + dithered(parameters)


def dithered(parameters: Mapping[str, Any]) -> list[Reason]:
    """Return that the dither of a simulated ring laser is in its output."""
    if not parameters.get("gyro.dither", 0.0) or parameters.get("gyro.stripped", 1.0) > 0.5:
        return []
    text = (
        "The dither is in the output (stripped = 0). What its samples fold down is in the means, and in no residual "
        "where its frequency is near a multiple of theirs: take it off, or change the time between two samples."
    )
    return [Reason("gyro.dithered", text, ("pass", "fail"), severity="doubt")]


def unanswered(parameters: Mapping[str, Any]) -> list[Reason]:
    """Return that a simulated gyro with a dead band or a lock-in does not answer the Earth rate, or less of it."""
    p = {n: float(parameters.get(f"gyro.{n}", 0.0)) for n in ("dead_band", "lock_in", "dither", "closed")}
    locked = 0.0 if p["dither"] else p["lock_in"]
    band = max(locked, p["dead_band"] * (p["closed"] > 0.5)) / DPH
    if not band:
        return []
    text = (
        f"The gyro does not answer rates within ±{plain(band, 3)} °/h (dead band, lock-in), and less of those beyond: "
        "the Earth rate that is taken off was not read, and what is found is off by up to all of it."
    )
    return [Reason("gyro.unanswered", text, ("pass", "fail"), severity="doubt")]


def worded(parameters: Mapping[str, Any], u: float) -> list[Reason]:
    """Return that words of a simulated gyro are not dithered by its noise, where that exceeds u of a bias, rad/s."""
    off = word_error(parameters)
    if not off > u:
        return []
    text = (
        f"The words of the gyro are larger than their noise: a reading is off by {plain(off / DPH, 3)} °/h rms, alike "
        "each time it is taken, which u holds in part."
    )
    return [Reason("gyro.words", text, ("pass", "fail"), severity="doubt")]
