"""The two-channel tumble on shortened plans: values, random gyros, and the error of the loops by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.record.record import Record
from gyrobench.system.system import System, load_system

NAME = "tumble_two_channel"
DPH = math.pi / 180.0 / 3600.0  # 1 deg/h in rad/s
RATE = 0.015  # rad/s, 206 times Earth rate: a turn takes 419 s instead of 8616 s
NAMES = {"simple": [], "nine": [n for c in "xy" for n in drift.terms_2dof(c, 9)]}
NAMES["simple"] = [n for n in NAMES["nine"] if n.split("_")[1] in ("0", "z", n[1], f"{n[1]}z")]

#: A whole tumble in some 900 s.  The loops' slowest pole, -11.3 1/s, leaves exp(-34) = 2e-15 after 3 s.
SHORT: dict[str, Any] = {"rate": RATE, "windows": 36, "dwell": 20.0, "settle": 3.0, "table.acceleration": 20.0}

RANGES = {0: (0.05, 0.55), 1: (0.5, 1.3), 2: (0.01, 0.06)}  # deg/h per g^n, ranges of Hu 1981; signs are drawn
LOOP = 1e-3  # s2: 1/(K_sg k K_i) at k = 17.2 deg/h/mA


def load() -> System:
    return load_system(NAME)


def quiet(system: System) -> dict[str, Any]:
    """All noise off."""
    return {name: 0.0 for name in system.noises}


def gyro(rng: np.random.Generator, model: str = "nine") -> dict[str, Any]:
    """True coefficients of both channels in the range of Hu 1981, both signs; those outside the model are 0."""
    values = {f"gyro.{n}": 0.0 for n in NAMES["nine"]}
    for n in NAMES[model]:
        values[f"gyro.{n}"] = float(rng.uniform(*RANGES[drift.order(n)]) * rng.choice([-1.0, 1.0]) * DPH)
    return values


def latitude(rng: np.random.Generator) -> float:
    """rad, 20 to 70 degrees north or south."""
    return float(math.radians(rng.uniform(20.0, 70.0)) * rng.choice([-1.0, 1.0]))


def faces(model: str, phi: float) -> dict[str, np.ndarray]:
    """Mounts written down again: rows x, y, z in the table axes E, p x E, p."""
    x, y, z = np.eye(3)
    if model == "simple":
        return {"mount 1": np.array([y, -x, z]), "mount 2": np.array([y, x, -z])}
    base = frames.polar_base(phi)
    up, down = (np.array([frames.E, v, np.cross(frames.E, v)]) @ base.T for v in (frames.U, -frames.U))
    return {"mount 1": np.array([-x, -y, z]), "mount 2": np.array([-x, y, -z]), "static 3": up, "static 4": down}


def quasi_static(record: Record, values: dict[str, Any], lag: bool) -> Record:
    """The record with currents from the measurement equation alone, with the lag of the loops or without.

    psi_x' = -w_x + k_y i_y + omega_z psi_y (and -omega_z psi_x for y), with w = omega_IA - omega_d and the loop k i =
    -K_sg k (K_p psi + K_i integral of psi) =: -(a psi + b integral): for slow w, psi = -w'/b, and so the currents read

        k_y i_y = w_x - w_x''/b + omega_z w_y'/b        k_x i_x = w_y - w_y''/b - omega_z w_x'/b

    to the next order (1e-2 of it at RATE).  In the turns w = -omega_d(angle), w' = table rate times its derivative.
    """
    run, w = record.run, record.windows
    phi, model = run.options["latitude"], run.options["model"]
    g = frames.normal_gravity(phi)
    p = run.parameters
    b = {c: p[f"gyro.K_sg_{c}"] * p[f"gyro.k_{o}"] * p[f"rebalance_{o}.K_i"] for c, o in (("x", "y"), ("y", "x"))}
    base, mounts = frames.polar_base(phi), faces(model, phi)
    face = {row.phase: mounts[row.face] for row in run.plan}
    truth = {c: {n: values[f"gyro.{n}"] for n in NAMES["nine"] if n[1] == c} for c in "xy"}
    nodes, weights = np.polynomial.legendre.leggauss(8)
    d = 1e-3  # rad, of the numerical derivatives

    def imbalance(phase: int, angles: np.ndarray) -> np.ndarray:
        """w_x, w_y (2, m) at table angles."""
        f = face[phase]
        xyz = np.array([frames.to_face(-frames.U * g / frames.G0, f, base, a) for a in angles])
        rate = np.array([frames.to_face(frames.earth_rate_local(phi), f, base, a) for a in angles])
        return np.array([rate[:, k] - drift.drift(xyz, truth[c]) for k, c in enumerate("xy")])

    mean = np.empty((2, len(w["phase"])))
    for j, phase in enumerate(w["phase"].tolist()):
        low, high = w["angle_start"][j], w["angle_end"][j]
        turn = (high - low) / (w["t_end"][j] - w["t_start"][j])
        a = (low + high) / 2 + (high - low) / 2 * nodes
        seen = imbalance(phase, a)
        if lag and turn:
            before, after = imbalance(phase, a - d), imbalance(phase, a + d)
            first, second = turn * (after - before) / (2 * d), turn**2 * (after - 2 * seen + before) / d**2
            omega_z = face[phase][2, 2] * (frames.EARTH_RATE + turn)
            sizes = np.array([[b["x"]], [b["y"]]])
            seen = seen - second / sizes + omega_z * np.array([first[1] / b["y"], -first[0] / b["x"]])
        mean[:, j] = seen @ weights / 2
    currents = {"mean_y": mean[0] / p["gyro.k_y"], "mean_x": mean[1] / p["gyro.k_x"]}
    return type(record)({**w, **currents}, {}, run)
