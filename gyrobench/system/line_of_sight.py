"""Sources of the jitter of a line of sight, as a system states them for a jitter that is wanted of a loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gyrobench.arrays import Array

#: one-sided power spectral density over frequencies in Hz
Density = Callable[[Array], Array]


@dataclass(frozen=True)
class LineOfSight:
    """Sources of the jitter of a line of sight, from ``lowest`` Hz on.

    rates: densities of the angular rate of the base about x, y, z, rad2/s2/Hz.  noise: loop -> density of the sensor's
    noise in the signal at which the loop is opened.  ride: label of the phase of the plan in which the base vibrates.
    free: parameters of parts without the dry friction that slips in the ride, for margins; slipping: with the viscous
    friction that makes torques as large, for the jitter.  {}: as they are.
    """

    lowest: float
    rates: tuple[Density, Density, Density]
    noise: Mapping[str, Density]
    ride: str = "ride"
    free: Mapping[str, Any] = field(default_factory=dict)
    slipping: Mapping[str, Any] = field(default_factory=dict)
