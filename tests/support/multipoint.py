"""The multi-position test of an accelerometer: made records by the polynomial, written out by hand here."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from stated import with_sizes

from gyrobench.system.system import System, load_system

NAME = "accelerometer_multipoint"
G0 = 9.80665
KS = ("k0", "k1", "k2", "k3", "k4", "k5")


def load() -> System:
    return load_system(NAME)


def module(name: str) -> Any:
    return importlib.import_module(f".{name}", type(load()).__module__)


def quiet(system: System) -> dict[str, Any]:
    return dict.fromkeys(system.noises, 0.0)


def polynomial(rng: np.random.Generator) -> dict[str, float]:
    """Random k0 ... k5: k1 within 1 % of 1, the others up to 200 ug."""
    k = {n: float(rng.uniform(-2e-4, 2e-4)) for n in KS}
    return {**k, "k1": float(rng.uniform(0.99, 1.01))}


def reading(k: dict[str, float], mount: str, angle: float, zero: float, gamma: float) -> float:
    """lambda i/g0 of eq. 3-38 at X = -gamma sin, Z = -gamma cos (mount a) or Y = gamma cos (mount b)."""
    x, c = -gamma * math.sin(angle + zero), gamma * math.cos(angle + zero)
    y, z = (0.0, -c) if mount == "a" else (c, 0.0)
    return k["k0"] + k["k1"] * x + k["k2"] * x**2 + k["k3"] * x**3 + k["k4"] * x * y + k["k5"] * x * z


def windows(
    k: dict[str, float], zeros: dict[str, float], gamma: float, points: int, turns: int = 1, scale: float = 9806.65,
    sigma: float = 0.0, rng: np.random.Generator | None = None, angles: list[float] | None = None,
    off: list[float] | None = None,
) -> dict[str, np.ndarray[Any, Any]]:  # fmt: skip
    """A record of the mounts in ``zeros``, phases 1 and 2, white noise of sigma (g0); off: errors of the positions."""
    rows, t = [], 0.0
    places = angles or [2.0 * math.pi * j / points for j in range(points * turns)]
    for phase, (mount, zero) in enumerate(zeros.items(), 1):
        for j, angle in enumerate(places):
            error = off[j % len(off)] if off else 0.0
            y = reading(k, mount, angle + error, zero, gamma) + (sigma * rng.normal() if rng is not None else 0.0)
            rows.append((phase, t, t + 10.0, angle, angle, y * G0 / scale))
            t += 13.0
    columns = np.array(rows).T
    return dict(zip(("phase", "t_start", "t_end", "angle_start", "angle_end", "mean"), columns, strict=True))


def reduced(data: dict[str, Any], gamma: float, mounted: dict[str, float], scale: float = 9806.65, **more: Any) -> Any:
    R = module("reduction")
    mounts = dict(enumerate(mounted, 1))
    return R.Reduction.reduce(
        data, R.MultipointSetup(gravity=gamma * G0, scale=scale, mounts=mounts, **with_sizes(more))
    )


def estimates(result: Any) -> dict[str, float]:
    """SI: multiples of g0, rad."""
    size = {"µg": 1e-6, "µg/g²": 1e-6, "µg/g³": 1e-6, "g/g": 1.0, "″": math.pi / 648000.0}
    return {c.name: c.estimate * size[c.unit] for c in result.coefficients}
