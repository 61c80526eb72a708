"""The quantities that set the sources of a jitter budget, as they are in a run: what an allowance is stated of."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.motion_profile import RECORDED
from gyrobench.reduction.loops.sight_budget import BY_UNBALANCE, FRICTION, NOISE_OF_GYRO, OF_BASE, JitterBudget
from gyrobench.result import Limit, SetBy, VarianceShare

COUNTS = 0.1  # of the square: dry friction of less does not count
SLIPPING = 2.0  # factor on a source, either way, with which dry friction that slips makes the torques that it made
TIMES = "times as it is"
VIBRATION = "vibration of the base, all of it"
PARAMETERS = {
    BY_UNBALANCE: ("platform.unbalance",),
    "cogging": ("platform.cogging",),
    FRICTION: ("platform.stiction", "platform.friction"),
}
UNITS = {"platform.unbalance": "kg.m"}


def of_parameter(p: Mapping[str, Any], name: str, unit: str, holds: Limit = (None, None)) -> SetBy:
    """Return the value of a parameter in a printed unit; of one with elements that differ their common factor.

    holds: of the value, SI.
    """
    values = np.asarray(p[name], float)
    sizes = np.unique(np.abs(values[values != 0.0]))
    if sizes.size != 1:
        return SetBy(name, 1.0, TIMES)
    si = units.factor(unit)
    low, high = (None if x is None else x / si for x in holds)
    return SetBy(name, float(sizes[0]) / si, units.display(unit), holds=(low, high))


def set_by(source: str, p: Mapping[str, Any]) -> list[SetBy]:
    """Return the quantities that set a source; p: parameters of the parts."""
    if source in PARAMETERS:
        names = [n for n in PARAMETERS[source] if np.any(np.asarray(p.get(n, 0.0), float))]
        return [of_parameter(p, n, UNITS.get(n, "N.m")) for n in names]
    if source == NOISE_OF_GYRO:
        density = math.sqrt(2.0) * float(p["gyro.white"]) / units.factor("deg/s/sqrt(Hz)")
        return [SetBy("gyro_noise", density, units.display("deg/s/sqrt(Hz)"))]
    if source in OF_BASE and psd_scale(p):
        return [SetBy(f"psd, rate_{source[-1]}", 1.0, TIMES, 2.0)]
    return [SetBy("amplitude", 1.0, TIMES)]


def shares(
    budget: JitterBudget, df: Array, p: Mapping[str, Any], quantities: Callable[[str, Mapping[str, Any]], list[SetBy]]
) -> list[VarianceShare]:
    """Return how the squares of the jitters, µrad2, go with the amplitude of each source; df: widths of the lines, Hz.

    Other motion makes other torques of dry friction that slips: where these count, no more than SLIPPING is stated.
    """
    found, whole = [], psd_scale(p)
    for name, axes in (("jitter", [0, 1]), ("jitter pitch", [0]), ("jitter yaw", [1])):

        def square(density: Array, axes: list[int] = axes) -> float:
            return 1e12 * float(np.sum(density[axes] @ df))

        sources = {source: (square(x.alone), square(x.part)) for source, x in budget.sources.items()}
        total = sum(part for _, part in sources.values())
        of = {
            source: ([total + alone - 2.0 * part, 2.0 * (part - alone), alone], quantities(source, p))
            for source, (alone, part) in sources.items()
        }
        if whole and budget.base:
            of[VIBRATION] = [square(x) for x in budget.base], whole
        slips = sources.get(FRICTION, (0.0, 0.0))[0] > COUNTS * total
        for source, (powers, set_by) in of.items():
            most = [replace(s, holds=(s.now / SLIPPING**s.power, s.now * SLIPPING**s.power)) for s in set_by]
            found.append(VarianceShare(name, source, powers, most if slips else set_by))
    return found


def psd_scale(p: Mapping[str, Any]) -> list[SetBy]:
    """Return the factor on the vibration, where that is all that moves the base."""
    if int(p.get("motion.preset", 0)) == RECORDED or not p.get("vibration.points"):
        return []
    return [SetBy("psd_scale", float(p.get("vibration.scale", 1.0)), "1")]


def coarse(p: Mapping[str, Any]) -> bool:
    """Return whether the noise of the gyro does not cover its resolution, which is no noise then.

    2 white^2 through a filter of second order has 1.11 times its bandwidth; below 0.3 of a step its rounding is uneven.
    """
    white, band, step = (float(p.get(f"gyro.{n}", 0.0)) for n in ("white", "bandwidth", "resolution"))
    return white * math.sqrt(2.22 * band) < 0.3 * step
