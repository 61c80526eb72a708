"""Gyros of Hu 1981 on a servo table: rates in the polar mounts and an ideal record, from 3-58 and 3-59 alone."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from gyrobench import frames
from gyrobench.attitudes import on_servo_table
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift import servo_regression
from gyrobench.reduction.setup import run_metadata
from gyrobench.system.system import System, load_system

DPH = math.pi / 180.0 / 3600.0
W = frames.EARTH_RATE
NAMES = ("R", "U_z", "U_x", "ΔK", "K_zx", "K_xz", "K_zy", "K_xy")
DEFAULT = dict(zip(NAMES, (0.3, 0.9, -0.7, 0.15, 0.05, 0.04, 0.03, -0.02), strict=True))  # deg/h per g^n


def modules(name: str, *parts: str) -> list[Any]:
    system: System = load_system(name)
    package = type(system).__module__
    __import__(f"{package}.reduction")
    return [sys.modules[f"{package}.{p}"] for p in parts]


CLOSED, REFUSALS = modules("servo_polar", "closed", "refusals")
VL_CLOSED, VL_REFUSALS = modules("servo_vertical_level", "closed", "refusals")


def omega_m(p: dict[str, float], gamma: Any) -> Any:
    """3-58 corrected (E36), gamma = SF/g times g/g0."""
    X, Y, Z = gamma
    linear = p["R"] + p["U_z"] * X - p["U_x"] * Z
    square = p["ΔK"] * X * Z + p["K_zx"] * X * X - p["K_xz"] * Z * Z
    return linear + square + p["K_zy"] * X * Y - p["K_xy"] * Y * Z


def random_gyro(rng: np.random.Generator) -> dict[str, float]:
    return {n: float(rng.uniform(-1.0, 1.0)) * DPH for n in NAMES}


def random_latitude(rng: np.random.Generator) -> float:
    return float(math.radians(rng.uniform(12.0, 78.0)) * rng.choice([-1.0, 1.0]))


def polar_gamma(mount: str, theta: Any, phi: float, g: float) -> tuple[Any, Any, Any]:
    """5.4: S: (s, c sin, c cos), N: minus."""
    m = g if mount == "S" else -g
    return m * math.sin(phi) * np.ones_like(theta), m * math.cos(phi) * np.sin(theta), m * math.cos(phi) * np.cos(theta)


def rate(p: dict[str, float], mount: str, theta: Any, phi: float, g: float = 1.0) -> Any:
    """3-59: theta' = -omega_E,x - omega_M, omega_E,x = -W in S, +W in N."""
    return (W if mount == "S" else -W) - omega_m(p, polar_gamma(mount, theta, phi, g))


def amplitudes(p: dict[str, float], mount: str, phi: float, g: float = 1.0) -> dict[str, float]:
    """Naming of Hu 1981: A sine, B cosine; by exact discrete Fourier sums over a turn."""
    theta = np.arange(360) * math.pi / 180.0
    r = rate(p, mount, theta, phi, g)
    return {
        "A0": float(r.mean()), "A1": float(2 * (r * np.sin(theta)).mean()), "B1": float(2 * (r * np.cos(theta)).mean()),
        "A2": float(2 * (r * np.sin(2 * theta)).mean()), "B2": float(2 * (r * np.cos(2 * theta)).mean()),
    }  # fmt: skip


SEEDS = range(6)


def ideal_record(true: dict[str, float], phi: float, g: float) -> Any:
    """Two short dwells at angle 0 and 28 h in each mount, by integration of 3-59."""
    site = run_metadata.Location(phi, g * frames.G0)
    rows: list[list[float]] = []
    plan = []
    t = 0.0
    book = {symbol: sign * true[n] for n, (symbol, sign) in servo_regression.BOOK.items()}
    for k, name in enumerate(("x east, y up", "x east, y down", "polar S", "polar N"), 1):
        plan.append({"phase": k, "label": name, "mode": "servo", "face": name})
        if name.startswith("polar"):
            at = np.arange(171) * 600.0

            def turn(_: float, y: Any, mount: str = name[-1]) -> list[float]:
                return [float(rate(book, mount, y[0], phi, g) + true["D_O"] * polar_gamma(mount, y[0], phi, g)[1])]

            ends = solve_ivp(turn, (0, at[-1]), [0.0], "DOP853", at, rtol=1e-13, atol=1e-14).y[0]
        else:
            axes = on_servo_table(name, phi)[None]
            still = servo_regression.HeldWindows(np.zeros(1), np.zeros(1), np.zeros(1), np.ones(1), axes)
            omega_d = servo_regression.design(still, site, tuple(true)) @ np.array(list(true.values()))
            at = np.arange(4) * 1e-3
            ends = float(omega_d[0] - W * (axes[0, 0] @ frames.pole(phi))) * at
        rows += [[k, t + at[j], t + at[j + 1], ends[j], ends[j + 1]] for j in range(at.size - 1)]
        t += float(at[-1])
        t += 10.0
    columns = dict(zip(("phase", "t_start", "t_end", "angle_start", "angle_end"), np.array(rows).T, strict=True))
    columns["phase"] = columns["phase"].astype(int)
    options = {"latitude": phi, "gravity": g * frames.G0, "route": "dwells", "terms": 9}
    return Record(columns, {}, RunDocument(plan=plan, options=options, parameters={}, complete=True))
