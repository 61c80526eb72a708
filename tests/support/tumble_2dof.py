"""Ideal and noisy records of a two-channel tumble, made from the measurement equation alone."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from stated import with_sizes

from gyrobench import drift, frames
from gyrobench.system.system import load_system

system = load_system("tumble_two_channel")
_room = type(system).__module__
reduction: Any = importlib.import_module(".reduction", _room)
closed: Any = importlib.import_module(".closed", _room)
geometry: Any = importlib.import_module(".geometry", _room)

DPH = math.pi / 180.0 / 3600.0
K = {"x": 17.227 * DPH / 1e-3, "y": 17.18 * DPH / 1e-3}
PHASES = {"simple": {1: "mount 1", 2: "mount 2"}, "nine": {1: "static 3", 2: "mount 1", 3: "static 4", 4: "mount 2"}}


def setup(latitude: float = 45.75, model: str = "nine", **changes: Any) -> Any:
    """TwoChannelSetup at ``latitude`` (deg) with the attitudes of Hu 1981; one model, without nuisances."""
    phi = math.radians(latitude)
    faces, phases = geometry.faces(model, phi), PHASES[model]
    values: dict[str, Any] = {
        "nuisances": False,
        "latitude": phi, "gravity": 9.8, "k": K, "model": model, "faces": {p: faces[n] for p, n in phases.items()},
        "labels": phases, "modes": {p: "rate" if n.startswith("mount") else "dwell" for p, n in phases.items()},
    }  # fmt: skip
    return reduction.TwoChannelSetup(**with_sizes({**values, **changes}))


def in_face(local: np.ndarray, s: Any, phase: int, angle: np.ndarray) -> np.ndarray:
    """A local vector in the face axes of ``phase`` at table angles (m,): (m, 3)."""
    x, y, z = frames.polar_base(s.latitude) @ local
    c, n = np.cos(angle), np.sin(angle)
    return np.stack([c * x + n * y, c * y - n * x, np.full_like(c, z)], axis=1) @ s.faces[phase].T


def channel(truth: dict[str, float], name: str) -> dict[str, float]:
    return {n: v for n, v in truth.items() if n.startswith(f"D{name}_")}


def record(
    s: Any, truth: dict[str, float], turn: int = 72, dwell: int = 10, rates: tuple[float, ...] = (-10.0,),
    noise: Any = None, tilt: tuple[float, float] = (0.0, 0.0), window: float = 119.67,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Windows of an ideal tumble: exact window means of the currents by fine Simpson sums over the angle.

    rates: in Earth rates, one turn in each mount at each.  noise() -> two drifts (rad/s).  tilt: of x and y towards z.
    """
    rows: list[list[float]] = []
    t, angle = 0.0, 0.0
    w = np.ones(201)
    w[1:-1:2], w[2:-1:2] = 4.0, 2.0
    w /= w.sum()
    for p, name in PHASES[s.model].items():
        for r in rates if name.startswith("mount") else (0.0,):
            t += 60.0
            table = r * frames.EARTH_RATE
            for _ in range(turn if r else dwell):
                length = 2.0 * math.pi / turn / abs(table) if r else window
                end = angle + table * length
                a = np.linspace(angle, end, 201)
                xyz = in_face(-frames.U * s.gravity / frames.G0, s, p, a)
                omega = in_face(frames.earth_rate_local(s.latitude), s, p, a) + s.faces[p][:, 2] * table
                rest = [float(w @ drift.drift(xyz, channel(truth, c))) for c in "xy"]
                rate = [float(w @ (omega[:, k] + tilt[k] * omega[:, 2])) for k in (0, 1)]
                extra = noise() if noise is not None else (0.0, 0.0)
                i_y, i_x = ((rate[k] - rest[k] - extra[k]) / s.k["yx"[k]] for k in (0, 1))
                rows.append([p, t, t + length, angle, end, i_x, i_y, 0])
                t, angle = t + length, end
        angle = round(angle / (2 * math.pi)) * 2 * math.pi
    names = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean_x", "mean_y", "flagged")
    out = {n: np.array([r[j] for r in rows]) for j, n in enumerate(names)}
    out["phase"], out["flagged"] = out["phase"].astype(int), out["flagged"].astype(int)
    return out
