"""What a stand at a site is on: rest, or ground that moves, as parameters of ground_motion in the slot site."""

from __future__ import annotations

from typing import Any

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
