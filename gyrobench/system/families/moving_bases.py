"""Base of a stand at a site: at rest, or ground that moves, as parameters of ground_motion in the slot site."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.system.part_values import PartValues

#: tilts about E, N, U and noise of vibration; sizes are our own assumptions of a typical case
BASES: dict[str, dict[str, Any]] = {
    "rest": {},
    "bus": {
        "site.period": [0.67, 0.083], "site.phase": [0.0, 1.0],
        "site.tilt_amplitude": [[2e-5, 1e-5, 1e-5], [5e-6, 5e-6, 2e-6]], "site.local_e": 0.01, "site.local_n": 0.01,
    },
    "ship at pier": {
        "site.period": [6.1, 8.3, 23.0], "site.phase": [0.0, 1.0, 2.0],
        "site.tilt_amplitude": [[1e-3, 0.0, 0.0], [0.0, 4e-3, 0.0], [0.0, 0.0, 5e-4]],
    },
}  # fmt: skip


def velocity(base: str, parts: PartValues, period: float) -> float:
    """Return the rms velocity, m/s, of independent velocities at a period (s) that do what the noise of the ground of a
    base does; of east and north the mean.

    The velocity of a peak has the autocorrelation (rms/w)2 exp(-d w t)(cos q t + d w/q sin q t), q = w sqrt(1 - d2);
    what is slow against the period sees the sum of its samples.
    """

    def value(name: str) -> float:
        own = BASES[base].get(name)
        return float(parts[name] if own is None else parts.given(name, own))

    t, square = period * np.arange(1, 400), 0.0
    for peak in ("local", "seismic"):
        size = math.hypot(value(f"site.{peak}_e"), value(f"site.{peak}_n")) / math.sqrt(2.0)
        if size > 0.0:
            w = 2.0 * math.pi * value(f"site.{peak}_frequency")
            fall = w * value(f"site.{peak}_damping")
            q = math.sqrt(w * w - fall * fall)
            later = np.exp(-fall * t) * (np.cos(q * t) + fall / q * np.sin(q * t))
            square += (size / w) ** 2 * (1.0 + 2.0 * float(np.sum(later)))
    return math.sqrt(square)
