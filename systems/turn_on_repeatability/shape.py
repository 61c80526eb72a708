"""What a warm-up says of the exponentials that it is taken for: of another shape, of a turn-on, not over in time."""

from __future__ import annotations

import numpy as np

from gyrobench.reduction.toolkit import Array, Reason, plain
from gyrobench.units import DPH

ALIKE = (
    "the warm-up differs from turn-on to turn-on: some began before the gyro was cold, or at another temperature",
    "the warm-up of all turn-ons is the same",
)
OTHER = (
    "the warm-up is not one or two exponentials: the bias when warm, sizes and times are those of another curve",
    "the warm-up has the shape of the exponentials found",
)
HIDDEN = (
    "Intervals of the warm-up allow for a second exponential that the record does not exclude; of two, those of the "
    "bias when warm and of the time until it is warm for a third. Slow ones of opposite sign that cancel within the "
    "readings are in none."
)
BANDS = 12  # of the time since the turn-on, even in its logarithm


def bands(since: Array) -> Array:
    """Return columns (n, 12) of readings at like times since a turn-on: what all turn-ons have beside the model."""
    edges = np.geomspace(np.min(since), np.max(since), BANDS + 1)[1:-1]
    return np.asarray(np.searchsorted(edges, since)[:, None] == np.arange(BANDS), dtype=float)


def extrapolated(left: Array, read: float, limit: float) -> list[Reason]:
    """Return that the gyro was not warm when a turn-on ended: all that comes later is by the exponentials alone.

    left: bias then less that in the end, of the warm-ups that the record allows; limit: both rad/s; read: s.
    """
    most = float(np.quantile(np.abs(left), 0.975))
    if most <= limit:
        return []
    text = (
        f"When the readings of a turn-on end, after {plain(read, 4)} s, the bias may still be off by "
        f"{plain(most / DPH, 3)} °/h, more than the limit of {plain(limit / DPH, 4)} °/h. The bias when warm and the "
        "time until then are continued along exponentials; a slower part would change them. Read longer."
    )
    return [Reason("warm_up.extrapolated", text, severity="warning")]
