"""What the run.json of a record says about a test: site, scale factor, truth, phases, sizes of the uncertainties.

site = Location.of(record.run)
k = number(record.run, "k", "gyro.k")             # the option, else the parameter of the part
truth = truth_of(record.run, drift.NAMES)         # None for measured data
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gyrobench import frames
from gyrobench.arrays import AnyArray
from gyrobench.record.record import Record
from gyrobench.record.run_document import PlanRow, RunDocument
from gyrobench.reduction.setup.window_checks import ReductionError


class Remount(NamedTuple):
    """Standard uncertainty (rad/s) of the drift from mount to mount; stated: given, declared absent, or simulated."""

    size: float = 0.0
    stated: bool = True


@dataclass(frozen=True)
class Location:
    """Where the test took place: latitude rad, gravity m/s2, earth_rate rad/s."""

    latitude: float
    gravity: float
    earth_rate: float = frames.EARTH_RATE

    @classmethod
    def of(cls, run: RunDocument) -> Location:
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


def reads_rate(run: RunDocument) -> bool:
    """Return whether the mean of a window is a rate of a rate gyro, not a current of a torquer."""
    return bool(run.options.get("reading") == "rate")


def rate_per_reading(run: RunDocument) -> float:
    """Return k of omega_d = omega_IA - k mean: 1 of a rate gyro, else the torquer scale factor, rad/s/A.

    Raises ReductionError where that is not known.
    """
    return 1.0 if reads_rate(run) else number(run, "k", "gyro.k", "torquer scale factor")


def truth_of(run: RunDocument, names: Iterable[str], slot: str = "gyro") -> dict[str, float] | None:
    """Return those of ``names`` that are parameters of the part in ``slot``, SI; None where there are none."""
    return {n: float(run.parameters[f"{slot}.{n}"]) for n in names if f"{slot}.{n}" in run.parameters} or None


def sizes(options: Mapping[str, Any]) -> dict[str, float]:
    """Return the options that are sizes of uncertainties of type B, u_NAME, SI."""
    return {n: float(v) for n, v in options.items() if n.startswith("u_") and isinstance(v, int | float)}


def remount_of(run: RunDocument) -> Remount:
    """Return the option u_remount, and whether drift from mount to mount is stated or declared absent.

    Where nothing of type B is stated, conditions.py says so, of all sources together.
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


def with_plan(record: Record, **fields: str) -> dict[str, AnyArray]:
    """Return the windows of a record; those of a run with columns from fields of the plan: ``frequency="target"``."""
    if record.run.measured:
        return dict(record.windows)
    rows = {row.phase: row for row in record.run.plan}
    of = [rows[p] for p in np.asarray(record.windows["phase"]).astype(int).tolist()]
    return {**record.windows, **{name: np.array([getattr(row, f) for row in of]) for name, f in fields.items()}}
