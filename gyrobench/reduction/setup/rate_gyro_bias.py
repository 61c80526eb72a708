"""What parameters of a simulated rate gyro say about its bias."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

#: parameters of rate gyros that make a steady or slow rate beside `bias`; with one of them the bias of a run is not it
BESIDE = (
    "turn_on", "flicker_x", "flicker_y", "walk_x", "walk_y", "g", "g2", "langmuir", "damping_difference",
    "frequency_difference", "drive_angle",
)  # fmt: skip


def bias_is_all(parameters: Mapping[str, Any], slot: str = "gyro") -> bool:
    """Return whether the parameter `bias` is the whole bias at rest and at the temperature of the coefficients.

    Quadrature counts where a phase error lets it through.  Not considered: field and temperature of surroundings.
    """

    def there(name: str) -> bool:
        return bool(np.any(np.asarray(parameters.get(f"{slot}.{name}", 0.0), dtype=float)))

    return not (any(there(n) for n in BESIDE) or (there("quadrature") and there("phase_error")))
