"""What the run.json of a record says about a test: site, scale factor, truth, phases, sizes of the uncertainties.

site = Site.of(meta)
k = number(meta, "k", "gyro.k")                   # the option, else the parameter of the part
truth = truth_of(meta, drift.NAMES)               # None for measured data
return finish(result, record)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gyrobench import frames
from gyrobench.reduction.result import Result
from gyrobench.reduction.window_checks import ReductionError


@dataclass(frozen=True)
class Site:
    """Where the test took place: latitude rad, gravity m/s2, earth_rate rad/s."""

    latitude: float
    gravity: float
    earth_rate: float = frames.EARTH_RATE

    @classmethod
    def of(cls, meta: Mapping[str, Any]) -> Site:
        """From the options latitude, gravity and height and the site part; without gravity: WGS84 normal gravity."""
        options, parameters = meta.get("options", {}), meta.get("parameters", {})
        if "latitude" not in options:
            raise ReductionError("the record does not say the latitude (option latitude)")
        latitude = float(options["latitude"])
        gravity = float(options.get("gravity") or parameters.get("site.gravity") or 0.0)
        if gravity == 0.0:
            gravity = frames.normal_gravity(latitude, float(options.get("height", 0.0)))
        return cls(latitude, gravity, float(parameters.get("site.earth_rate", frames.EARTH_RATE)))

    @property
    def g(self) -> float:
        """Gravity in multiples of g0."""
        return self.gravity / frames.G0

    def shown(self) -> dict[str, Any]:
        """For Result.site."""
        return {
            "latitude / °": math.degrees(self.latitude),
            "gravity / (m/s²)": self.gravity,
            "Earth rate / (rad/s)": self.earth_rate,
        }


def number(meta: Mapping[str, Any], option: str, parameter: str, what: str = "") -> float:
    """The option, where it is given and not 0, else the parameter "slot.name" of a part, SI.

    Raises ReductionError, calling it ``what``, when there is neither.
    """
    value = meta.get("options", {}).get(option) or meta.get("parameters", {}).get(parameter)
    if value is None:
        slot, _, name = parameter.partition(".")
        raise ReductionError(f"{what or option} unknown: the {slot} has no parameter {name}; give the option {option}")
    return float(value)


def truth_of(meta: Mapping[str, Any], names: Iterable[str], slot: str = "gyro") -> dict[str, float] | None:
    """Those of ``names`` that are parameters of the part in ``slot``, SI; None where there are none."""
    parameters = meta.get("parameters", {})
    return {n: float(parameters[f"{slot}.{n}"]) for n in names if f"{slot}.{n}" in parameters} or None


def sizes(meta: Mapping[str, Any], names: Iterable[str]) -> dict[str, float]:
    """Options that are sizes of uncertainties, SI; 0 where not given."""
    options = meta.get("options", {})
    return {n: float(options.get(n, 0.0)) for n in names}


def phases(meta: Mapping[str, Any], known: Iterable[str], what: str = "mount") -> dict[int, dict[str, Any]]:
    """The rows of the plan by number.  Raises ReductionError for a ``face`` that is none of ``known``."""
    plan = meta.get("plan", [])
    known = list(known)
    unknown = sorted({str(r["face"]) for r in plan} - set(known))
    if unknown:
        raise ReductionError(f"{what} {', '.join(unknown)} unknown; there are {', '.join(known)}")
    return {int(r["phase"]): dict(r) for r in plan}


def finish(result: Result, record: Any) -> Result:
    """``result`` with the run.json of a gyrobench.record.record.Record as provenance, and a word if it is not whole."""
    result.provenance = dict(record.meta)
    if not record.meta.get("complete", True):
        result.warnings.insert(
            0, f"The run stopped at {record.meta.get('stopped_at', 0.0):.6g} s, before its plan was done."
        )
    return result
