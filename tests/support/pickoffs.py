"""The pickoff test: its reduction, and ideal readings."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np

from gyrobench.system.system import System, load_system

NAME = "pickoff_scale_factor"
DPH, ARCMIN = math.pi / 648000.0, math.pi / 10800.0


def load() -> System:
    return load_system(NAME)


R: Any = importlib.import_module(".reduction", type(load()).__module__)


def made(
    slope: float = 12.0,
    gain: float = 1.0,
    drift: float = 0.7,
    both: bool = True,
    bend: float = 0.0,
    n: int = 11,
    every: float = 0.4,
) -> dict[str, Any]:
    """Ideal readings ``every`` s, zero 3 mV: u = 3 mV + slope (gd(gain a)/gain - drift t), bend per rad^3."""
    a = np.linspace(-20.0, 20.0, n) * ARCMIN
    a = np.concatenate([a, a[-2::-1]]) if both else a
    t = every * np.arange(a.size)
    seen = np.arctan(np.sinh(gain * a)) / gain  # the Gudermannian
    u = 3e-3 + slope * (seen - drift * DPH * (t - t.mean())) + bend * a**3
    return {
        "phase": np.arange(a.size) + 1.0,
        "t_start": t,
        "t_end": t + 0.1,
        "angle_start": a,
        "angle_end": a,
        "mean": u,
    }
