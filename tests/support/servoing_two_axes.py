"""The two-axis servo test on shortened days: values, random gyros, and what the windows must read, by hand."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.reduction.setup import run_metadata
from gyrobench.system.system import load_system

Array = NDArray[np.float64]
NAME = "servo_two_axis"
system = load_system(NAME)
_room = type(system).__module__
geometry: Any = importlib.import_module(".geometry", _room)
windows: Any = importlib.import_module(".windows", _room)
refusals: Any = importlib.import_module(".refusals", _room)
NOISES: tuple[str, ...] = system.noises

DPH = math.pi / 180.0 / 3600.0
NAMES = {c: drift.terms_2dof(c, 9) for c in "xy"}
#: no noise, and what the formulas leave is judged, not explained by set-up effects
QUIET: dict[str, Any] = {**dict.fromkeys(NOISES, 0.0), "nuisances": "none"}
BOTH = ("outer", "inner")


def day(times: float, windows_a_day: int = 144, **more: Any) -> dict[str, Any]:
    """Values of a day in each mount, ``times`` as fast: the Earth rate raised, the cages strong enough for it."""
    length = 86400.0 / times  # whole milliseconds in a window for 50, 200, 500
    return {
        "site.earth_rate": times * frames.EARTH_RATE, "time": length, "window": length / windows_a_day, "settle": 2.0,
        "cage_x.i_max": 10.0, "cage_y.i_max": 10.0, **more,
    }  # fmt: skip


def gyro(rng: np.random.Generator) -> dict[str, float]:
    """Eighteen coefficients of the size of Hu 1981, both signs: values for a system, SI."""
    size = {0: 0.5, 1: 1.0, 2: 0.15}
    return {
        f"gyro.{n}": float(size[drift.order(n)] * rng.uniform(0.1, 1.0) * rng.choice([-1.0, 1.0]) * DPH)
        for c in "xy"
        for n in NAMES[c]
    }


def held(record: Any) -> tuple[Any, run_metadata.Location, Array]:
    """Windows of the held phases as the reduction sees them, the site, and which rows of the record they are."""
    site = run_metadata.Location.of(record.run)
    mounts = {r.phase: int(r.label.split()[1]) for r in record.run.plan if r.mode == "servo"}
    rows = np.isin(record.windows["phase"], list(mounts))
    phase = record.windows["phase"][rows].astype(int)
    columns = {k: np.asarray(v, dtype=float)[rows] for k, v in record.windows.items()}
    base = np.array([geometry.base(mounts[p], site.latitude) for p in phase.tolist()])
    return windows.track(columns, phase, base), site, rows


def left(record: Any) -> Array:
    """Mean inertial rates about x and y less the true drift, of each held window, rad/s (n, 2)."""
    seen, site, _ = held(record)
    p = record.run.parameters
    true = [seen.design(site, NAMES[c]) @ np.array([p[f"gyro.{n}"] for n in NAMES[c]]) for c in "xy"]
    out: Array = seen.inertial(site)[:, :2] - np.column_stack(true)
    return out


def stiffness_effect(record: Any) -> Array:
    """What is left of the equation.  The motor of the outer axis moves the table by M = J x'' and makes that from an
    angle of the rotor against the plate, psi_x = (J / K_T) x'' cos y (the secant gain is in K_T); the inner plate turns
    with the drift alone and needs no torque.  With psi_x' = -omega_x + omega_z psi_y + omega_dx and
    psi_y' = -omega_y - omega_z psi_x + omega_dy of the gyro

        omega_x - omega_dx = -psi_x'        omega_y - omega_dy = -omega_z psi_x

    averaged over each window, rad/s (n, 2); derivatives of the polynomials through the nodes.
    """
    seen, site, _ = held(record)
    p = record.run.parameters
    half = ((seen.t_end - seen.t_start) / 2.0)[:, None]
    V = np.polynomial.polynomial.polyvander(windows.NODES, 7)
    D = np.linalg.solve(V.T, (V[:, :-1] @ np.polynomial.polynomial.polyder(np.eye(8))).T).T

    def slope(v: Array) -> Array:
        out: Array = v @ D.T / half
        return out

    psi_x = p["outer.J"] / stiffness(p, "outer") * slope(seen.rate[..., 0]) * np.cos(seen.angle[..., 1])
    turn = seen.inertial(site)[:, 2]
    return np.column_stack([-windows.average(slope(psi_x)), -turn * windows.average(psi_x)])


def stiffness(p: dict[str, Any], slot: str) -> float:
    """K_T of network 1 (its README), N.m/rad: two leads r = 4, lag-lead of 12 and 60 below the crossover of 50 Hz.

    |L| = K_T C(w) / (J w2 sqrt(1 + (lag w)2)) = 1, of a gyro without lag.
    """
    w = 100.0 * math.pi
    lead = (1.0 + 2.0j) / (1.0 + 0.5j)
    lag_lead = (1.0 + 12.0j) / (1.0 + 60.0j)
    return float(p[f"{slot}.J"] * w * w * abs(1.0 + 1j * p[f"{slot}.lag"] * w) / abs(lead * lead * lag_lead))


def errors(result: Any, values: dict[str, Any]) -> dict[str, float]:
    """Estimate minus truth, deg/h per g^n."""
    return {c.name: c.estimate - values[f"gyro.{c.name}"] / DPH for c in result.coefficients}


def reduced(record: Any, **options: Any) -> Any:
    meta = record.run.replace(options={**record.run.options, **options})
    return load_system(NAME).reduce(type(record)(record.windows, {}, meta))
