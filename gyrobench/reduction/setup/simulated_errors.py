"""Errors of the set-up that a simulated run has, under the names of the sources of its budget.

With them the report says beforehand, from the sensitivities of the budget, by how much each estimate is off
(gyrobench.reduction.estimation.effects.simulated_table).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.frames import G0
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import SINES

OFTEN = ("once", "twice")
#: parameters of a table whose scale is a block of its own: amplitudes of the orders 1 and 2
SCALE = ("eccentricity", "tilt")


def simulated_errors(run: RunDocument) -> dict[str, float]:
    """Return source -> error, SI, of what is set in the table and in the mount of the gyro; nothing of measured data.

    Angle readings of the orders 1 and 2 (positive where too much is read), the axis off the pole, the gyro turned on
    the table, the axes of a table with two out of the right angle; of a table that a gyro holds, its axis in each phase
    and its unbalance over the stiffness of its servo; of a head with a horizontal axis, that axis, its positions and
    the accelerometer turned in its mount.
    """
    if run.measured:
        return {}
    p = run.parameters
    found = _angles(p) | _axis(p) | _mount(p) | _unbalance(p) | _square(p) | _bias(p) | _head(p)
    for row in run.plan:
        if row.mode == "servo":
            found |= _servo_axis(p, row.phase)
    return {name: x for name, x in found.items() if x}


def _angles(p: Mapping[str, Any]) -> dict[str, float]:
    out = {}
    for name, row in {"": 0, "outer ": 0, "inner ": 1}.items():
        scale = f"table.{name.strip()}{'_' if name else ''}scale_"
        if f"{scale}{SCALE[0]}" in p:
            amplitude, phase = ([p[f"{scale}{n}{end}"] for n in SCALE] for end in ("", "_phase"))
        elif np.ndim(given := p.get("table.encoder_amplitude", [])) == (2 if name else 1):
            amplitude, phase = (np.atleast_2d(x)[row] for x in (given, p.get("table.encoder_phase", [])))
        elif name and f"{name.strip()}.encoder_amplitude" in p:  # one table on another
            amplitude, phase = (p[f"{name.strip()}.encoder_{n}"] for n in ("amplitude", "phase"))
        else:
            continue
        for a, f, often in zip(amplitude, phase, OFTEN, strict=False):
            # a sin(n q + f) = a cos f sin n q + a sin f cos n q
            for part, x in zip(SINES, (math.cos(f), math.sin(f)), strict=True):
                out[f"{name}angle error, {often} a turn ({part})"] = float(a) * x
    return out


def _square(p: Mapping[str, Any]) -> dict[str, float]:
    """Return the turn of the inner axis out of the right angle: of a table with two axes, of one table on another."""
    return {
        "table axes out of the right angle": float(p.get("table.squareness", 0.0)),
        "right angle of the table axes": float(p.get("inner.tilt", (0.0, 0.0))[0]),
    }


def _bias(p: Mapping[str, Any]) -> dict[str, float]:
    """Return the biases of a rate gyro, which a heading from one position holds."""
    bias = p.get("gyro.bias", ())
    return {f"bias of the gyro along {n}": x for n, x in zip("xy", bias, strict=False)} if np.ndim(bias) else {}


def _axis(p: Mapping[str, Any]) -> dict[str, float]:
    tilt = p.get("table.tilt", (0.0, 0.0))
    # the last: of an axis that lies east, with the first axis of the table on the pole
    about = ("off the pole, about east", "off the pole, about p × east", "off the vertical, about east",
             "off the vertical, about north", "towards the pole")  # fmt: skip
    return {f"table axis {where}": x for where, x in zip(about, (*tilt, *tilt, tilt[1]), strict=True)}


def _servo_axis(p: Mapping[str, Any], phase: int) -> dict[str, float]:
    """Return the turn of the axis x about y and z of the attitude, along which the first two axes of the table lie."""
    tilt = p.get("table.tilt", (0.0, 0.0))
    return {f"table axis about {n} (phase {phase})": x for n, x in zip("yz", tilt, strict=True)}


def _unbalance(p: Mapping[str, Any]) -> dict[str, float]:
    """Return the angles by which the unbalance, across the axis at 1 g, turns a table against its servo."""
    stiffness = servo_stiffness(p)
    mass = p.get("table.axis_unbalance", p.get("table.unbalance"))
    if stiffness is None or mass is None or np.size(mass) != 2:
        return {}
    return {
        f"unbalance over stiffness (mass along {n})": float(m) * G0 / stiffness for n, m in zip("yz", mass, strict=True)
    }


def servo_stiffness(p: Mapping[str, Any]) -> float | None:
    """Return the static stiffness (N.m/rad) of a servo, of its parameter or of a sampled one's law; None where unknown.

    Sampled, all poles at p:  K_T = (2 J / T2)(g - a) / (1 - b), b = (p3 + 3 p2 + 3 p - 3) / 4, g = 2 + b - 3 p,
    a = p3 - b.  [CTRL-SAMPLED]
    """
    if given := p.get("table.stiffness"):
        return float(given)
    if any(f"table.{n}" not in p for n in ("law_J", "law_p", "period", "H_g")):
        return None
    J, pole, period = (float(p[f"table.{n}"]) for n in ("law_J", "law_p", "period"))
    b = (pole**3 + 3.0 * pole**2 + 3.0 * pole - 3.0) / 4.0
    return 2.0 * J / period**2 * (2.0 + 2.0 * b - 3.0 * pole - pole**3) / (1.0 - b)


def _turned(mount: Any) -> tuple[float, float, float]:
    """Return the small angles about its own axes by which an instrument is turned; mount: its axes in rows."""
    m = np.reshape(mount, (3, 3))
    # rows are the axes of the instrument: the transpose turns them
    x, y, z = 0.5 * np.array([m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]])
    return x, y, z


def _mount(p: Mapping[str, Any]) -> dict[str, float]:
    if "gyro.mount" not in p:
        return {}
    x, y, z = _turned(p["gyro.mount"])
    turned = {f"gyro turned about its {n} axis": v for n, v in zip(("input", "output", "spin"), (x, y, z), strict=True)}
    turned |= {f"gyro turned about its {n} axis": v for n, v in zip("xyz", (x, y, z), strict=True)}
    return turned | {"input axis towards output axis": z, "input axis towards spin axis": -y}


def _head(p: Mapping[str, Any]) -> dict[str, float]:
    """Return the errors of a head with a horizontal axis, whose positions are nominal angles, and of what it turns."""
    if "accelerometer.mount" not in p or "table.error" not in p:
        return {}
    names = ("input", "output", "pendulum")
    turned = {
        f"accelerometer turned about its {n} axis": x
        for n, x in zip(names, _turned(p["accelerometer.mount"]), strict=True)
    }
    n = int(p["table.positions"])
    places = {f"positions of the head ({round(360.0 * k / n, 2):g}°)": float(p["table.error"][k]) for k in range(n)}
    # turned about the first of its axes, which is level, the third goes down
    return turned | places | {"axis of the head above the horizon": -float(p.get("table.tilt", (0.0, 0.0))[0])}
