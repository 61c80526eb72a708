"""Ideal and noisy records of a single-axis tumble, made from the measurement equation alone."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
from stated import with_sizes

from gyrobench import drift, frames
from gyrobench.system.system import load_system

system = load_system("tumble_single_axis")
reduction: Any = importlib.import_module(".reduction", type(system).__module__)
closed: Any = importlib.import_module(".closed", type(system).__module__)
refusals: Any = importlib.import_module(".refusals", type(system).__module__)

DPH = math.pi / 180.0 / 3600.0
K = 17.2 * DPH / 1e-3
NAMES = drift.terms(9)
PHASES = {1: "static 3", 2: "mount 1", 3: "static 4", 4: "mount 2"}


def random_truth(seed: int, names: tuple[str, ...] = NAMES) -> dict[str, float]:
    return dict(zip(names, np.random.default_rng(seed).uniform(0.1, 1.0, len(names)) * DPH, strict=True))


def white(size: float, seed: int = 1) -> Any:
    """Noise of ``size`` deg/h in every window."""
    rng = np.random.default_rng(seed)
    return lambda t0, t1: rng.normal(size=t0.size) * size * DPH


def setup(latitude: float = 45.75, **changes: Any) -> Any:
    """TumbleSetup at ``latitude`` (deg) with the four attitudes of Hu 1981; one model, without nuisances."""
    phi = math.radians(latitude)
    faces = frames.tumble_faces(phi)
    values: dict[str, Any] = {
        "latitude": phi, "gravity": 9.8, "k": K, "faces": {p: faces[n] for p, n in PHASES.items()},
        "nuisances": False,
        "labels": PHASES, "modes": {p: "rate" if n.startswith("mount") else "dwell" for p, n in PHASES.items()},
    }  # fmt: skip
    return reduction.TumbleSetup(**with_sizes({**values, **changes}))


def in_face(local: np.ndarray, s: Any, phase: int, angle: np.ndarray) -> np.ndarray:
    """A local vector in the face axes of ``phase`` at table angles (m,): (m, 3)."""
    x, y, z = s.base @ local
    c, n = np.cos(angle), np.sin(angle)
    return np.stack([c * x + n * y, c * y - n * x, np.full_like(c, z)], axis=1) @ s.faces[phase].T


def record(
    s: Any, truth: dict[str, float], turn: int = 72, dwell: int = 10, turns: int = 1, rate: float = -10.0,
    noise: Any = None, window: float = 119.67,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Windows of an ideal tumble: exact window means of the current by fine Simpson sums over the angle.

    rate: in Earth rates.  noise(t0, t1) -> rad/s is added to the drift.
    """
    rows: list[list[float]] = []
    t, angle = 0.0, 0.0
    table = rate * frames.EARTH_RATE
    for p, name in PHASES.items():
        t += 60.0
        for _ in range(turn * turns if name.startswith("mount") else dwell):
            length = 2.0 * math.pi / turn / abs(table) if name.startswith("mount") else window
            end = angle + table * length if name.startswith("mount") else angle
            a = np.linspace(angle, end, 201)
            w = np.ones(201)
            w[1:-1:2], w[2:-1:2] = 4.0, 2.0
            xyz = in_face(-frames.U * s.gravity / frames.G0, s, p, a)
            omega_ia = (
                in_face(frames.earth_rate_local(s.latitude), s, p, a)[:, 0] + s.faces[p][0, 2] * (end - angle) / length
            )
            i = (omega_ia - drift.drift(xyz, truth)) / s.k
            rows.append([p, t, t + length, angle, end, float(w @ i / w.sum()), 0.0, 1000, 0])
            t, angle = t + length, end
        if name == "mount 1":
            angle = round(angle / (2 * math.pi)) * 2 * math.pi
    names = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean", "std", "n", "flagged")
    w = {n: np.array([r[j] for r in rows]) for j, n in enumerate(names)}
    w["phase"], w["flagged"] = w["phase"].astype(int), w["flagged"].astype(int)
    if noise is not None:
        w["mean"] = w["mean"] - noise(w["t_start"], w["t_end"]) / s.k
    return w
