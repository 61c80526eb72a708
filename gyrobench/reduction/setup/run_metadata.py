"""What the run.json of a record says about a test: site, scale factor, truth, phases, sizes of the uncertainties.

site = Site.of(record.run)
k = number(record.run, "k", "gyro.k")             # the option, else the parameter of the part
truth = truth_of(record.run, drift.NAMES)         # None for measured data
return finish(result, record)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gyrobench import frames, units
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow, RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.effects import Remount
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, Result

R = TypeVar("R", bound=Result)
#: estimates that belong to the mean temperature of the record -> their change per kelvin in the gyro, and its sign
WARMED = {
    "D_F": ("D_T", 1.0),
    "ω_d": ("D_T", 1.0),
    "Dx_0": ("Dx_T", 1.0),
    "Dy_0": ("Dy_T", 1.0),
    "R_x": ("Dy_T", 1.0),
    "R_y": ("Dx_T", -1.0),
}
NO_TYPE_B = (
    "Type B is not stated, u is of type A only: give the uncertainties u_... that apply, or declare type_b = none."
)


@dataclass(frozen=True)
class Site:
    """Where the test took place: latitude rad, gravity m/s2, earth_rate rad/s."""

    latitude: float
    gravity: float
    earth_rate: float = frames.EARTH_RATE

    @classmethod
    def of(cls, run: RunDocument) -> Site:
        """From the options latitude, gravity and height and the site part; without gravity: WGS84 normal gravity."""
        options, parameters = run.options, run.parameters
        if "latitude" not in options:
            raise ReductionError("the record does not state the latitude; give the option latitude")
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


def number(run: RunDocument, option: str, parameter: str, what: str = "") -> float:
    """Return the option, where it is given and not 0, else the parameter "slot.name" of a part, SI.

    Raises ReductionError, calling it ``what``, when there is neither.
    """
    value = run.options.get(option) or run.parameters.get(parameter)
    if value is None:
        slot, _, name = parameter.partition(".")
        raise ReductionError(f"{what or option} unknown: the {slot} has no parameter {name}; give the option {option}")
    return float(value)


def truth_of(run: RunDocument, names: Iterable[str], slot: str = "gyro") -> dict[str, float] | None:
    """Return those of ``names`` that are parameters of the part in ``slot``, SI; None where there are none."""
    return {n: float(run.parameters[f"{slot}.{n}"]) for n in names if f"{slot}.{n}" in run.parameters} or None


def sizes(options: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Return the options that are sizes of uncertainties, SI; 0 where not given."""
    return {n: float(options.get(n, 0.0)) for n in names}


def remount_of(run: RunDocument) -> Remount:
    """Return the option u_remount, and whether drift from mount to mount is stated or declared absent.

    Where nothing of type B is stated, :func:`finish` says so, of all sources together.
    """
    size = float(run.options.get("u_remount", 0.0))
    return Remount(size, not run.measured or run.type_b == "none" or size > 0.0 or not run.type_b_stated)


def phases(run: RunDocument, known: Iterable[str], what: str = "mount") -> dict[int, PlanRow]:
    """Return the rows of the plan by number.  Raises ReductionError for a ``face`` that is not one of ``known``."""
    known = list(known)
    unknown = sorted({row.face for row in run.plan} - set(known))
    if unknown:
        raise ReductionError(f"{what} {', '.join(unknown)} unknown; there are {', '.join(known)}")
    return {row.phase: row for row in run.plan}


def finish(result: R, record: Record) -> R:
    """Return ``result`` with the run.json of a record as provenance, and a warning if the run is not complete.

    Measured data without a statement of type B pass nothing: u is of type A alone.  What was left out of measured time
    series is a warning too.
    """
    result.provenance = record.run.as_dict()
    _at_mean_temperature(result, record)
    if record.run.measured:
        result.warnings[:0] = record.run.notes
        if not record.run.type_b_stated:
            uncertainty.withhold(result, [NO_TYPE_B], ["pass"])
    if not record.run.complete:
        stopped = record.run.stopped_at or 0.0
        result.warnings.insert(0, f"The run stopped at {stopped:.6g} s, before the end of its plan.")
    return result


def _at_mean_temperature(result: Result, record: Record) -> None:
    """Say that constant drift belongs to the mean temperature of the record, and take the simulated truth from there.

    The temperatures in a record are weighed as deviations from their mean (gyrobench.reduction.estimation.nuisances).
    """
    read = [np.asarray(v, dtype=float) for n, v in record.windows.items() if n.startswith("temperature")]
    if not read:
        return
    mean = float(np.mean(read))
    simulated = any(name.startswith("surroundings.") for name in record.run.parameters)
    shown = f"{mean:.3g} K above that of the gyro's coefficients" if simulated else f"{mean - 273.15:.2f} °C"
    sentences = getattr(result, "conventions", None)
    if sentences is not None:
        sentences.append(f"Constant drift belongs to the mean temperature of the record, {shown}.")
    if not simulated:
        return
    for c in result.coefficients:
        name, sign = WARMED.get(c.name, ("", 0.0))
        per_kelvin = float(record.run.parameters.get(f"gyro.{name}", 0.0)) * sign
        if c.truth is not None and per_kelvin:
            _set_truth(c, c.truth + per_kelvin * mean / units.factor(c.unit))
        if c.name == "temperature" and "gyro.D_T" in record.run.parameters:
            _set_truth(c, float(record.run.parameters["gyro.D_T"]) / units.factor(c.unit))


def _set_truth(c: Coefficient, truth: float) -> None:
    c.truth = truth
    c.z = (c.estimate - truth) / c.u if c.u > 0.0 else None
