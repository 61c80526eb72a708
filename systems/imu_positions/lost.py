"""Samples that were lost while the case turned, with the times of the later ones closed up: steps of the rate.

    w_k+1 - w_k = s + J,    s = ((w_k - w_k-1) + (w_k+2 - w_k+1))/2,    J = m s of m missing samples

Of a motion that is smooth against the sampling J is small; noise and knocks make it against s as often as along it.
The turns are then read too short, and no residual need show it: where samples are lost evenly, the scale factors take
it.
"""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain

TURNING = 0.1  # least slope, of the largest of the record, of samples that say how large J usually is
LOST, SURE = 0.6, 8.0  # least J, of a slope and of its usual size
MANY = 3  # places of which the report speaks: fewer show in the residuals of their turns


def found(time: Array, rate: Array) -> list[float]:
    """Return the times (s) before which samples are missing; rate (n, 3): of the gyros, in any unit."""
    step, h = np.diff(rate, axis=0), np.diff(time)
    slope = 0.5 * (step[:-2] + step[2:])
    size = np.maximum(np.linalg.norm(slope, axis=1), 1e-300)
    even = np.ptp(np.stack([h[:-2], h[1:-1], h[2:]]), axis=0) < 0.5 * float(np.median(h))
    turning = even & (size > TURNING * float(np.quantile(size, 0.999)))
    along = np.sum((step[1:-1] - slope) * slope, axis=1) / size
    least = np.maximum(LOST * size, SURE * float(np.median(np.abs(along[turning])))) if np.any(turning) else np.inf
    places, back = (np.flatnonzero(turning & (sign * along > least)) for sign in (1.0, -1.0))
    return [float(t) for t in time[places + 2]] if places.size >= max(MANY, 4 * back.size) else []


def doubts(time: Array, rate: Array) -> list[str]:
    """Return why no verdict rests on the turns of a record; [] where no sample is missing."""
    times = found(time, rate)
    if not times:
        return []
    return [
        f"The rate goes on by whole samples more at {len(times)} places while the case turned, the first at t = "
        f"{plain(times[0], 6)} s: samples were lost, and the times of the later ones closed up. Turns are read too "
        "short, the scale factors of the gyros too small by as much. Log the clock of the unit, or every sample."
    ]
