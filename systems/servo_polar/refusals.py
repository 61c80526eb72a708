"""What makes a polar servo test impossible, and what it cannot see.  [SERVO-C3-SING, SERVO-C3-RANK, INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.attitudes import POLAR, on_servo_table
from gyrobench.reduction.drift import channels, servo_regression
from gyrobench.reduction.estimation import regression
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.system.families.servo_channel import own_name
from gyrobench.units import DPH

from .model import ROUTES, PolarModel


def held(
    latitude: float, phases: Sequence[str], points: int = 36
) -> tuple[servo_regression.HeldWindows, NDArray[np.int_]]:
    """Return ideal windows of ``points`` angles over a turn in polar mounts, of one at angle 0 in dwells; phase
    numbers.
    """
    angles = [np.arange(points) * 2.0 * math.pi / points if p in POLAR else np.zeros(1) for p in phases]
    axes = np.concatenate(
        [np.repeat(on_servo_table(p, latitude)[None], a.size, axis=0) for p, a in zip(phases, angles, strict=True)]
    )
    phase = np.repeat(np.arange(len(phases)), [a.size for a in angles])
    a, t = np.concatenate(angles), np.arange(phase.size, dtype=float)
    return servo_regression.HeldWindows(a, a, t, t + 1.0, axes), phase


def examine(latitude: float, phases: Sequence[str], names: tuple[str, ...], g: float = 1.0) -> regression.Design:
    """Return what phases at a latitude can tell apart: rank, condition, lost combinations."""
    windows, _ = held(latitude, phases)
    return regression.examine(servo_regression.design(windows, Location(latitude, g * 9.80665), names), names)


def latitude_problems(latitude: float) -> list[str]:
    """Return that below 10 and above 80 degrees the coefficients run together; what is lost, in their names."""
    if problems := frames.latitude_problems(latitude):
        return problems
    if 10.0 <= abs(math.degrees(latitude)) <= 80.0:
        return []
    names = drift.terms(8)
    phases = ("x east, y up", "x east, y down", *POLAR)
    found = examine(latitude, phases, names)
    where = f"latitude {math.degrees(latitude):.4g}° (10° to 80° north or south is possible): "
    if found.short:
        return [f"{where}{found.weakness}"]
    X = servo_regression.design(held(latitude, phases)[0], Location(latitude, 9.80665), names)
    return [f"{where}condition {np.linalg.cond(X):.3g}, least determined: {found.weakest}"]


def option_problems(options: Mapping[str, Any]) -> list[str]:
    """Return what is wrong with the options, as sentences."""
    found = latitude_problems(options["latitude"])
    mounts = options["mounts"].replace(",", " ").split()
    if not mounts or any(m not in ("S", "N") for m in mounts):
        found.append(f"mounts = '{options['mounts']}': the mounts S and N in their order, as 'S N' or 'S N S'")
    if options["route"] not in ROUTES:
        found.append(f"route = '{options['route']}': one of {', '.join(ROUTES)}")
    if options["terms"] not in (4, 8, 9):
        found.append(f"terms = {options['terms']}: there are 4 (low grades), 8 and 9 terms")
    if 4.0 * options["window"] > options["time"]:
        found.append(f"window = {options['window']:g} s in a time of {options['time']:g} s: too few windows")
    if not options["wanted"] > 0.0:
        found.append("wanted = 0: no estimate reaches a standard deviation of 0; give the one that is wanted")
    if options["route"] == "dwells" and not options["dwell"] > 0.0:
        found.append("dwell = 0: the route 'dwells' needs two dwells with the input axis east")
    return found


def model_problems(parameters: Mapping[str, Any], channel: str = "") -> list[str]:
    """Return what the simulated gyro has and the model has not."""
    own = own_name(channel, "D_OO")
    square = parameters.get(f"gyro.{own}", 0.0) / DPH
    if square:
        others = channels.words("D_F, D_II and D_SS", channel)
        return [
            f"gyro.{own} = {square:g} °/h/g²: at constant |g| it cannot be told from {others}, and the "
            "model of Hu 1981 has no such term; set it to 0"
        ]
    return []


def unseen(route: str, mounts: Sequence[str], which: int, channel: str = "") -> list[str]:
    """Return what the plan cannot see, said before the run; channel: of a two-degree-of-freedom gyro."""
    found = []
    F, II, SS = ("R", "K_zx", "K_xz") if not channel else (own_name(channel, n) for n in ("D_F", "D_II", "D_SS"))
    if which == 4:
        constant = own_name(channel, "D_F")
        found.append(f"Four terms: the other coefficients stay in the residuals and bias {constant} (low grades only).")
    model = PolarModel.of(route, mounts, which)
    together = [channels.words(model.words(n), channel) for n in model.fitted if model.mixed[n]]
    if len(set(mounts)) == 1:
        found.append(
            f"One mount ({mounts[0]}) tells only combinations: {'; '.join(together)}. Both mounts separate them."
        )
    elif together:
        found.append(
            f"{F} and {II} appear only as {F} + γ² sin²φ {II}: two dwells with the input axis east separate them."
        )
    elif model.equal:
        same = "−" if channel else ""  # K_zx = -D_II, K_xz = +D_SS
        found.append(f"{F} and {II} are told apart by assuming {II} = {same}{SS}; an error of that goes into both.")
    return found


def turned(start: Array, end: Array) -> float:
    """Return the degrees turned by the windows of a mount, rad, in their order."""
    return math.degrees(abs(float(end[-1] - start[0])))
