"""What a channel of a record at rest reads - a rate or a specific force - and the units in which a report prints it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gyrobench.reduction.series.noise_coefficients_table import TERMS
from gyrobench.units import DPH, G0

UG = 1e-6 * G0  # m/s2
#: coefficient of an accelerometer -> unit of the report, SI of one of it, meaning  [IEEE 952, annex C, of a force]
FORCE_TERMS: Mapping[str, tuple[str, float, str]] = {
    "N": ("m/s/√h", 1.0 / 60.0, "velocity random walk"),
    "B": ("µg", UG, "bias instability: flicker floor 0.664 B"),
    "K": ("µg/√h", UG / 60.0, "acceleration random walk"),
    "R": ("µg/h", UG / 3600.0, "acceleration ramp"),
    "Q": ("mm/s", 1e-3, "velocity noise of a reading"),
}


@dataclass(frozen=True)
class ChannelUnits:
    """Units of a channel: SI unit, unit of deviations and slow drift, of levels, of the density sqrt(S); terms."""

    words: str
    instrument: str
    si_unit: str
    unit: str
    si: float  # of one unit
    level: str
    level_si: float
    density: str
    density_si: float
    terms: Mapping[str, tuple[str, float, str]]


RATE = ChannelUnits("rate", "gyro", "rad/s", "°/h", DPH, "°/h", DPH, "°/h/√Hz", DPH, TERMS)
FORCE = ChannelUnits("specific force", "accelerometer", "m/s2", "µg", UG, "m/s²", 1.0, "µg/√Hz", UG, FORCE_TERMS)


def units_of(si_unit: str) -> ChannelUnits:
    """Return the units of a channel in rad/s or m/s2."""
    return FORCE if si_unit == FORCE.si_unit else RATE
