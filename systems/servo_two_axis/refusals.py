"""What makes a two-axis servo test impossible, and what its mounts cannot tell.  [SERVO2-LOCK, SERVO2-RANK; d1, 5.6, 8]

Conditions are of the design in coefficients per g, the worse of both channels [SERVO2-RANK].
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression
from gyrobench.system.families.servo_expectation import capture_problems
from gyrobench.units import DPH

from . import geometry
from .geometry import Rates

WARN, MOST, MOST_SINGLE = 100.0, 1e3, 1e4  # of the condition; a single mount is warned of, not refused [SERVO2-RANK]
TILTED = math.cos(math.radians(30.0))  # least cosine of the gyro's x and y axes to those of the plate
STEP_MAX = 1e-3  # s, the largest internal step of table_servo


def designs(mounts: Sequence[int], latitude: float, time: float, terms: int, earth_rate: float) -> dict[str, Array]:
    """Return the regressors of both channels at 241 times in each mount, at 1 g, of a gyro without drift."""
    forces = []
    for m in mounts:
        _, x, y = geometry.path(m, latitude, time, earth_rate=earth_rate)
        forces.append(geometry.force(m, latitude, x, y))
    at = np.concatenate(forces)
    return {c: drift.regressors(at, drift.terms_2dof(c, terms)) for c in "xy"}


def condition(X: Mapping[str, Array]) -> float:
    """Return the worse of both channels; infinite where the rank is short."""
    worst = 1.0
    for x in X.values():
        s = np.linalg.svd(x, compute_uv=False)
        worst = max(worst, s[0] / s[-1] if s[-1] > 1e-9 * s[0] else math.inf)
    return float(worst)


def locked(mount: int, latitude: float, time: float, earth_rate: float, rates: Rates | None = None) -> float:
    """Return the largest inner angle in ``time``, rad."""
    if rates is None and time * earth_rate >= 2.0 * math.pi:
        return geometry.swing(mount, latitude)
    return float(np.max(np.abs(geometry.path(mount, latitude, time, 361, earth_rate, rates)[2])))


def lock_by_drift(
    mount: int, latitude: float, time: float, earth_rate: float, rates: Rates
) -> tuple[float, float, float] | None:
    """Return s, outer and inner angle (rad) at which drift brings a gyro too near to gimbal lock; None: not in
    ``time``.
    """
    t, x, y = geometry.path(mount, latitude, time, 1441, earth_rate, rates)
    near = np.flatnonzero(np.cos(y) < geometry.LEAST)
    return (float(t[near[0]]), float(x[near[0]]), float(y[near[0]])) if near.size else None


def best_pairs(
    latitude: float, time: float, terms: int, earth_rate: float, count: int = 4
) -> list[tuple[float, int, int]]:
    """Return (condition, mount, mount) of the pairs that tell most, best first."""
    most = math.acos(geometry.LEAST)
    free = [m for m in geometry.MOUNTS if locked(m, latitude, time, earth_rate) < most]
    each = {m: designs([m], latitude, time, terms, earth_rate) for m in free}
    pairs = [
        (condition({c: np.vstack([each[a][c], each[b][c]]) for c in "xy"}), a, b)
        for a, b in itertools.combinations(free, 2)
    ]
    return sorted(pairs)[:count]


def _advice(latitude: float, time: float, terms: int, earth_rate: float) -> str:
    pairs = [p for p in best_pairs(latitude, time, terms, earth_rate) if p[0] <= MOST]
    if not pairs:
        return f"no pair of mounts does at latitude {math.degrees(latitude):.4g}° in {time / 3600.0:.3g} h"
    return "best pairs here: " + ", ".join(f"{a} {b} (condition {k:.3g})" for k, a, b in pairs)


def numbers(text: str) -> list[int] | None:
    """Return mounts from "2 4" or "2, 4"; None if one is none of the twelve."""
    words = text.replace(",", " ").split()
    if not words or not all(w in map(str, geometry.MOUNTS) for w in words):
        return None
    return [int(w) for w in words]


def lock_problems(mounts: Sequence[int], latitude: float, time: float, earth_rate: float, terms: int) -> list[str]:
    """Return mounts that come too near to gimbal lock by the Earth's turn alone, and what the others would leave
    unseen.
    """
    bad = {m: a for m in dict.fromkeys(mounts) if math.cos(a := locked(m, latitude, time, earth_rate)) < geometry.LEAST}
    found = []
    for m, a in bad.items():
        rest = [k for k in mounts if k not in bad]
        lost = " and ".join(_lost(rest, latitude, time, terms, earth_rate)) if rest else ""
        found.append(
            f"mount {m}: gimbal lock: at latitude {math.degrees(latitude):.4g}° its inner angle reaches "
            f"{math.degrees(a):.4g}° ({math.degrees(math.acos(geometry.LEAST)):.3g}° allowed), where the outer axis "
            "turns the gyro about its spin axis and the x channel, x' cos y, is lost; "
            f"{'the mounts that are left: ' + lost + '; ' if lost else ''}"
            f"{_advice(latitude, time, terms, earth_rate)}"
        )
    return found


def _lost(mounts: Sequence[int], latitude: float, time: float, terms: int, earth_rate: float) -> list[str]:
    out = []
    for c, X in designs(mounts, latitude, time, terms, earth_rate).items():
        seen = regression.examine(X, drift.terms_2dof(c, terms))
        if seen.short:
            out.append(f"{c} channel, {seen.weakness}")
    return out


def rank_problems(mounts: Sequence[int], latitude: float, time: float, earth_rate: float, terms: int) -> list[str]:
    """Return mounts that do not tell the coefficients apart, with the combinations lost."""
    which = f"mount{'s' if len(set(mounts)) > 1 else ''} {' '.join(map(str, dict.fromkeys(mounts)))}"
    where = f"{which} at latitude {math.degrees(latitude):.4g}° for {time / 3600.0:.3g} h"
    lost = _lost(mounts, latitude, time, terms, earth_rate)
    if lost:
        text = f"{where}: {'; and '.join(lost)}"
    else:
        k = condition(designs(mounts, latitude, time, terms, earth_rate))
        most = MOST_SINGLE if len(set(mounts)) == 1 else MOST
        if k <= most:
            return []
        text = f"{where}: condition {k:.3g}, {most:g} is allowed; {_weakest(mounts, latitude, time, terms, earth_rate)}"
    return [f"{text}; {_advice(latitude, time, terms, earth_rate)}"]


def _weakest(mounts: Sequence[int], latitude: float, time: float, terms: int, earth_rate: float) -> str:
    X = designs(mounts, latitude, time, terms, earth_rate)
    words = [f"{regression.examine(v, drift.terms_2dof(c, terms)).weakest} ({c} channel)" for c, v in X.items()]
    return f"least determined: {' and '.join(words)}"


def cautions(mounts: Sequence[int], latitude: float, time: float, earth_rate: float, terms: int) -> list[str]:
    """Return what is allowed but weak, said before the run."""
    k = condition(designs(mounts, latitude, time, terms, earth_rate))
    if not WARN < k < math.inf:
        return []
    which = f"Mount{'s' if len(set(mounts)) > 1 else ''} {' '.join(map(str, dict.fromkeys(mounts)))}"
    weak = _weakest(mounts, latitude, time, terms, earth_rate)
    return [f"{which}: condition {k:.3g}, {weak}; {_advice(latitude, time, terms, earth_rate)}."]


def option_problems(options: Mapping[str, Any], step: float, earth_rate: float) -> list[str]:
    """Return what is wrong with the options, as sentences."""
    found, mounts = [], numbers(options["mounts"])
    if step > STEP_MAX:
        found.append(f"step = {step:g} s: the servo loops exchange once a step and need at most {STEP_MAX:g} s")
    if options["terms"] not in (8, 9):
        found.append(f"terms = {options['terms']}: there are 8 (Hu 1981) and 9 terms a channel")
    if mounts is None:
        found.append(f"mounts = '{options['mounts']}': numbers 1 to 12 of Hu 1981 in their order, as '2 4'")
    elif len(mounts) > 24:
        found.append(f"mounts: {len(mounts)} are given, the plan has room for 24")
    if 12.0 * options["window"] > options["time"]:
        found.append(f"window = {options['window']:g} s in a time of {options['time']:g} s: too few windows")
    if found or mounts is None or options["levelled"]:
        return found
    turned = options["time"] + options["settle"]  # the table turns while the loops settle
    values = (earth_rate, options["terms"])
    return lock_problems(mounts, options["latitude"], turned, *values) or rank_problems(
        mounts, options["latitude"], options["time"], *values
    )


def model_problems(parameters: Mapping[str, Any], mounts: Sequence[int], options: Mapping[str, Any]) -> list[str]:
    """Return what the parts make impossible: terms that are not seen, gimbal lock by drift, axes that are mixed up."""
    found = []
    for c, square in (("x", "Dx_yy"), ("y", "Dy_xx")):
        value = parameters.get(f"gyro.{square}", 0.0) / DPH
        if value:
            found.append(
                f"gyro.{square} = {value:g} °/h/g² ({c} channel): at constant |g| it cannot be told from the constant "
                "and the other squares, and the model of Hu 1981 has no such term; set it to 0"
            )
    M = np.asarray(parameters.get("gyro.mount", np.eye(3)))
    if not found and min(M[0, 0], M[1, 1]) < TILTED:
        found.append(
            "gyro.mount: x and y of the gyro must lie along x and y of the inner plate to 30° (the x pickoff drives "
            "the outer axis, the y pickoff the inner one): turned further, the loops work against each other"
        )
    for slot, cage, torquer in (("outer", "cage_x", "k_y"), ("inner", "cage_y", "k_x")):
        if parameters.get(f"{slot}.polarity", 1) != 1:
            found.append(f"{slot}.polarity = -1: the gyro's axes lie along those of the plate; it must be 1")
        reach = parameters.get(f"{cage}.i_max", math.inf) * parameters.get(f"gyro.{torquer}", math.inf)
        rate = parameters.get(f"{slot}.index_rate", 0.0)
        if rate > 0.9 * reach:
            found.append(
                f"{slot}.index_rate = {rate:g} rad/s: the cage holds the rotor up to {cage}.i_max gyro.{torquer} = "
                f"{reach:.3g} rad/s; index more slowly"
            )
    names = {c: drift.NAMES_2DOF[c] for c in "xy"}
    if found or options["levelled"] or not all(f"gyro.{n}" in parameters for c in "xy" for n in names[c]):
        return found
    x, y = (drift.at_points({n: parameters[f"gyro.{n}"] for n in names[c]}) for c in "xy")

    def rates(at: tuple[float, float, float]) -> tuple[float, float]:
        return x(at), y(at)

    earth_rate = parameters.get("site.earth_rate", frames.EARTH_RATE)
    for m in dict.fromkeys(mounts):
        lock = lock_by_drift(m, options["latitude"], options["time"] + options["settle"], earth_rate, rates)
        if lock is not None:
            at, outer, inner = lock
            found.append(
                f"mount {m}: gimbal lock: the drift of this gyro brings its inner angle to {math.degrees(inner):.3g}° "
                f"after {at:,.0f} s ({at / 3600.0:.3g} h), the outer one then at {math.degrees(outer):.4g}°; "
                f"±{math.degrees(math.acos(geometry.LEAST)):.3g}° is allowed: take a shorter time, trim the gyro, or "
                "take another mount"
            )
    return found or _capture_problems(parameters, mounts, options["latitude"], earth_rate, rates)


def current_problems(parameters: Mapping[str, Any], currents: Mapping[int, tuple[float, float]]) -> list[str]:
    """Return compensating currents (A, about x and y of each mount) that a cage does not give."""
    found = []
    for axis, cage in enumerate(("cage_x", "cage_y")):
        most, limit = max(abs(i[axis]) for i in currents.values()), parameters.get(f"{cage}.i_max", math.inf)
        if most > 0.9 * limit:
            found.append(f"levelled asks for {most * 1e3:.3g} mA, {cage}.i_max = {limit * 1e3:.3g} mA leaves no room")
    return found


def _capture_problems(
    parameters: Mapping[str, Any], mounts: Sequence[int], latitude: float, earth_rate: float, rates: Rates
) -> list[str]:
    """Return the drift with which the tables would not find the null of their pickoff."""
    at: dict[str, dict[str, tuple[float, float]]] = {"outer": {}, "inner": {}}
    for m in dict.fromkeys(mounts):
        rows = geometry.base(m, latitude)
        drifts, earth = rates(tuple((rows @ -frames.U).tolist())), rows @ frames.earth_rate_local(latitude, earth_rate)
        for k, slot in enumerate(at):
            at[slot][f"mount {m}"] = drifts[k], float(earth[k])
    return [p for slot, where in at.items() for p in capture_problems(parameters, where, slot)]
