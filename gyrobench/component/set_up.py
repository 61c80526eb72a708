"""Errors of the set-up that values of a part simulate, under the ids of gyrobench.reduction.setup.sources.

    class MyTable(AxisTable):
        simulates = (each("tilt", ("table.axis.vertical.east",), ("table.axis.vertical.north",)),)

A report of a simulated test then says beforehand by how much each estimate is off.  Declarations of bases and mixins
come along; each is a function of the part's values that returns id -> error, SI, or id -> part of it -> error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.units import G0

if TYPE_CHECKING:
    from gyrobench.component.component import Component

Errors = dict[str, float | dict[str, float]]
Simulated = Callable[[Mapping[str, Any]], Errors]
GYRO_MOUNT = ("mount.1", "mount.2", "mount.3")  # about input, output and spin reference axis; x, y and z
#: turned about its output axis, a gyro leans its input axis away from the spin axis
LEANS = {"mount.input_to_spin": ("mount.2", -1.0)}
SINES = ("sine", "cosine")  # of an error that is harmonic in an angle


SCALE = ("scale_eccentricity", "scale_tilt")  # amplitudes of the orders 1 and 2 of a scale that is a block
SCALE_PHASE = ("scale_eccentricity_phase", "scale_tilt_phase")


def each(parameter: str, *ids: Sequence[str]) -> Simulated:
    """Declare a number, or the elements of a vector: each is the error of all its ids."""

    def errors(p: Mapping[str, Any]) -> Errors:
        values = np.ravel(p[parameter]).tolist()
        return {i: float(x) for names, x in zip(ids, values, strict=False) for i in names}

    return errors


def turned(parameter: str, ids: Sequence[str]) -> Simulated:
    """Declare a mount, its axes in rows: the small angles about its own axes by which the instrument is turned."""

    def errors(p: Mapping[str, Any]) -> Errors:
        m = np.reshape(p[parameter], (3, 3))
        # rows are the axes of the instrument: the transpose turns them
        angles = 0.5 * np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
        found = dict(zip(ids, angles.tolist(), strict=True))
        return found | {lean: sign * found[i] for lean, (i, sign) in LEANS.items() if i in found}

    return errors


def harmonic(amplitudes: Sequence[str], phases: Sequence[str], ids: Sequence[str], row: int | None = None) -> Simulated:
    """Declare a reading too large by a sin(n q + f) = a cos f sin n q + a sin f cos n q, an id for each order n.

    amplitudes, phases: a parameter for each order, or one with all of them; row: of a matrix.
    """

    def numbers(p: Mapping[str, Any], names: Sequence[str]) -> list[float]:
        values = [np.atleast_1d(p[n] if row is None else np.asarray(p[n])[row]) for n in names]
        return list(map(float, np.concatenate(values)))

    def errors(p: Mapping[str, Any]) -> Errors:
        orders = zip(ids, numbers(p, amplitudes), numbers(p, phases), strict=False)
        return {i: dict(zip(SINES, (a * math.cos(f), a * math.sin(f)), strict=True)) for i, a, f in orders}

    return errors


def places(p: Mapping[str, Any]) -> Errors:
    """Return the errors of a head with a horizontal axis, whose positions are nominal angles."""
    n = int(p["positions"])
    each_place = {f"{round(360.0 * k / n, 2):g}°": float(p["error"][k]) for k in range(n)}
    # turned about the first of its axes, which is level, the third goes down
    return {"head.positions": each_place, "head.axis": -float(p["tilt"][0])}


def unbalanced(mass: str) -> Simulated:
    """Declare the unbalance of a table that its gyro holds: the angle by which it turns the table against its servo."""

    def errors(p: Mapping[str, Any]) -> Errors:
        stiffness = static_stiffness(p)
        if stiffness is None or np.size(p[mass]) != 2:
            return {}
        along = {f"mass along {n}": float(m) * G0 / stiffness for n, m in zip("yz", p[mass], strict=True)}
        return {"servo.unbalance": along}

    return errors


def static_stiffness(p: Mapping[str, Any]) -> float | None:
    """Return the static stiffness (N.m/rad) of a servo, of its parameter or of a sampled one's law; None where unknown.

    Sampled, all poles at p:  K_T = (2 J / T2)(g - a) / (1 - b), b = (p3 + 3 p2 + 3 p - 3) / 4, g = 2 + b - 3 p,
    a = p3 - b.  [CTRL-SAMPLED]
    """
    if given := p.get("stiffness"):
        return float(given)
    if any(n not in p for n in ("law_J", "law_p", "period", "H_g")):
        return None
    J, pole, period = (float(p[n]) for n in ("law_J", "law_p", "period"))
    b = (pole**3 + 3.0 * pole**2 + 3.0 * pole - 3.0) / 4.0
    return 2.0 * J / period**2 * (2.0 + 2.0 * b - 3.0 * pole - pole**3) / (1.0 - b)


def set_up_errors(part: type[Component], values: Mapping[str, Any]) -> Errors:
    """Return the errors that a part with these values simulates: id -> error, or id -> part of it -> error."""
    found: Errors = {}
    for klass in reversed(part.__mro__):
        for errors in vars(klass).get("simulates", ()):
            found |= errors(values)
    return found
