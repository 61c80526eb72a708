"""The servo tests on shortened plans: values, random gyros, and what every window must read, by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.attitudes import on_servo_table
from gyrobench.reduction.drift import servo_regression
from gyrobench.reduction.setup import run_metadata
from gyrobench.system.families.servo_test import ServoTest
from gyrobench.system.system import System, load_system

Array = NDArray[np.float64]
DPH = math.pi / 180.0 / 3600.0  # 1 deg/h in rad/s
NAMES = drift.terms(9)
W50 = 50.0 * frames.EARTH_RATE
#: A day of the polar test in 1723 s: fifty times the Earth rate; the cage must then hold the float against more.
DAY50: dict[str, Any] = {
    "site.earth_rate": W50, "time": 86164.0 / 50.0, "window": 12.0, "dwell": 36.0, "settle": 2.0, "cage.i_max": 1.0,
}  # fmt: skip
#: and in 172 s
DAY500: dict[str, Any] = {
    **DAY50, "site.earth_rate": 10.0 * W50, "time": 172.4, "window": 4.8, "dwell": 48.0,
}  # fmt: skip
#: no noise, and what the formulas leave is judged, not explained by set-up effects
QUIET: dict[str, Any] = {**dict.fromkeys(ServoTest.noises, 0.0), "nuisances": "none"}
#: Ranges of the coefficients in Hu 1981 (ch. 2), deg/h per g^n; signs are drawn.
RANGES = {"D_F": (0.05, 0.55), "D_I": (0.5, 1.3), "D_O": (0.1, 0.5), "D_S": (0.5, 1.3), "D_IS": (0.1, 0.2)}


def polar_at_2_ms() -> System:
    """The polar test in steps of 2 ms, with which the servo as it is set is stable and a run takes half the time."""
    system = load_system("servo_polar")
    system.step = 2e-3
    return system


def gyro(rng: np.random.Generator) -> dict[str, Any]:
    """Nine true coefficients in the range of Hu 1981, both signs: values for a system, SI."""
    sizes = {n: rng.uniform(*RANGES.get(n, (0.01, 0.06))) for n in NAMES}
    return {f"gyro.{n}": float(size * rng.choice([-1.0, 1.0]) * DPH) for n, size in sizes.items()}


def latitude(rng: np.random.Generator) -> float:
    """rad, 12 to 78 degrees north or south."""
    return float(math.radians(rng.uniform(12.0, 78.0)) * rng.choice([-1.0, 1.0]))


def held(record: Any) -> tuple[servo_regression.HeldWindows, Array]:
    """Windows of the held phases and which rows of the record they are."""
    labels = {r.phase: r.label for r in record.run.plan if r.mode == "servo"}
    w = record.windows
    rows = np.isin(w["phase"], list(labels))
    axes = np.array([on_servo_table(labels[p], record.run.options["latitude"]) for p in w["phase"][rows].tolist()])
    return servo_regression.HeldWindows(
        *(w[c][rows] for c in ("angle_start", "angle_end", "t_start", "t_end")), axes
    ), rows


def expected_rate(record: Any) -> Array:
    """Mean table rate of each held window, rad/s, of the measurement equation 3-59 with the one effect it leaves out:

        theta' = omega_d - omega_E,x + (J/H) alpha_O,     alpha_O = theta' (c omega_E,z - s omega_E,y)

    The gyro turns in the base that turns with the Earth; what the Earth gives along its output axis changes with theta.
    """
    windows, _ = held(record)
    site, parameters = run_metadata.Location.of(record.run), record.run.parameters
    true = np.array([parameters[f"gyro.{n}"] for n in NAMES])
    omega_d = servo_regression.design(windows, site, NAMES) @ true
    earth = windows.axes @ frames.earth_rate_local(site.latitude, site.earth_rate)
    middle = (windows.angle_start + windows.angle_end) / 2.0
    along = np.cos(middle) * earth[:, 2] - np.sin(middle) * earth[:, 1]
    tau = parameters["gyro.J"] / parameters["gyro.H"]
    rate: Array = (omega_d - earth[:, 0]) / (1.0 - tau * along)
    return rate


def polar_harmonics(record: Any, mount: str) -> dict[str, float]:
    """True drift over the angle in a polar mount, rad/s: A0 + A1 cos + B1 sin + A2 cos 2 + B2 sin 2.

    X = s, Y = c sin, Z = c cos of the angle, with s, c = g sin, g cos of the latitude in mount S, negative in N.
    """
    latitude, D = record.run.options["latitude"], {n: record.run.parameters[f"gyro.{n}"] for n in NAMES}
    g = frames.normal_gravity(latitude) / frames.G0 * (1.0 if mount == "polar S" else -1.0)
    s, c = g * math.sin(latitude), g * math.cos(latitude)
    return {
        "A0": D["D_F"] + D["D_I"] * s + D["D_II"] * s * s + D["D_SS"] * c * c / 2.0,
        "A1": D["D_S"] * c + D["D_IS"] * s * c,
        "B1": D["D_O"] * c + D["D_IO"] * s * c,
        "A2": D["D_SS"] * c * c / 2.0,
        "B2": D["D_OS"] * c * c / 2.0,
    }


def errors(result: Any, values: dict[str, Any]) -> dict[str, float]:
    """Estimate minus truth, deg/h per g^n."""
    return {c.name: c.estimate - values[f"gyro.{c.name}"] / DPH for c in result.coefficients}
