"""Jitter of the line of sight by source, from the linear model of the run.

Every way to the line of sight is a response of the closed linear model: of the base's angle, of a torque at a motor, of
a test signal where a loop is opened.

    vibration of the base     |T_base / s|^2 S_rate           friction-free joints
    noise of the gyro         |T_test F_gyro / cos|^2 S_gyro   F_gyro its filter; 1/cos of the outer axis alone
    dry friction, cogging,    |T_torque|^2 S_M                 S_M of the torque that the joint angles of the ride make
    cables
    acceleration              |T_torque u x|^2 S_a             unbalance u, at the joint angles of the start

The linear model takes a contact for a spring and cogging for its slope.  Where the joints of the ride move by more
than presliding, these stiffnesses K are taken out, T (1 - K Theta)^-1 with the joints' response Theta, and the torques
come from the joint angles; where they do not, friction is part of the way of the base.

Not modelled: limits; correlation between friction and vibration; unbalance turned by gravity beyond the linear model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gyrobench.arrays import Array
from gyrobench.record.vibration_spectrum import VibrationSpectrum
from gyrobench.reduction.loops.jitter import Spectra, spectra
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.margins import excitation_response

Complex = np.ndarray[Any, np.dtype[np.complex128]]
PAIR = (0, 1)  # pitch, yaw
EXCITED = (1, 3)  # their elements of the exciter
LOS = ("platform.los[1]", "platform.los[2]")
THETA = ("platform.theta[1]", "platform.theta[2]")
TORQUES = ("cogging", "cogging_order", "cable", "friction", "stiction")
GEOMETRY = ("I_outer", "I_inner", "J_motor", *TORQUES)


@dataclass(frozen=True)
class Ride:
    """What was measured in the ride: spectra of the line of sight, torques at the joints, whether the joints slide."""

    los: tuple[Spectra, Spectra]
    torques: Mapping[str, tuple[Array, Array]]  # source -> densities of the torques of both joints, N2.m2/Hz
    slides: bool
    angles: tuple[float, float]  # mean joint angles, rad


def read_ride(gate: Gate, p: Mapping[str, Any], lowest: float) -> Ride | None:
    """Return what the ride shows; None where it is too short for its lowest frequency, Hz."""
    dt = float(gate.t[1] - gate.t[0])
    los = [spectra(dt, gate[name], lowest) for name in LOS]
    if los[0] is None or los[1] is None:
        return None
    theta = [gate[name] for name in THETA]
    slides = any(float(np.ptp(x)) > 2.0 * float(p["platform.presliding"]) for x in theta)
    none: Array = np.zeros(gate.t.size)
    made: dict[str, list[Array]] = {}
    for k in PAIR:
        of = {n: float(np.asarray(p[f"platform.{n}"], float)[k]) for n in TORQUES}
        most = max(of["friction"], of["stiction"])
        if most and slides:
            slip = float(p["platform.presliding"])
            made.setdefault("dry friction", [none, none])[k] = contact(theta[k], of, slip)
        if of["cogging"]:
            wave = -of["cogging"] * np.sin(of["cogging_order"] * theta[k])
            made.setdefault("cogging", [none, none])[k] = wave
        if of["cable"]:
            made.setdefault("cables", [none, none])[k] = -of["cable"] * theta[k]

    def density(m: Array) -> Array:
        found = spectra(dt, m, lowest)
        assert found is not None
        return found.mean

    torques = {name: (density(pair[0]), density(pair[1])) for name, pair in made.items()}
    return Ride((los[0], los[1]), torques, slides, (float(theta[0].mean()), float(theta[1].mean())))


def contact(theta: Array, of: Mapping[str, float], presliding: float) -> Array:
    """Return the torque of a contact that sticks up to its stiction and slips with its friction, without damping."""
    most = max(of["friction"], of["stiction"])
    reach = presliding * of["friction"] / most
    spring, anchor, sense = most / presliding, float(theta[0]), 0.0
    found = np.zeros(theta.size)
    for k, x in enumerate(theta.tolist()):
        if sense == 0.0 and abs(x - anchor) > presliding:
            sense = math.copysign(1.0, x - anchor)
        if sense:
            if (x - anchor) * sense >= reach:
                anchor = x - sense * reach
            else:
                sense = 0.0
        found[k] = -spring * (x - anchor)
    return found


class Ways:
    """Responses of the line of sight (rows pitch, yaw) in the closed linear model.

    Raises LookupError where the model lacks one.
    """

    def __init__(self, found: LoopFindings, f: Array, slides: bool) -> None:
        model = found.linear.closed.discrete
        if model is None:
            raise LookupError("no linear model")
        p = found.record.run.parameters

        def to(names: tuple[str, ...], kind: str, axes: tuple[int, ...]) -> Complex:
            rows = [[excitation_response(model, kind, k, name, f) for k in axes] for name in names]
            return np.asarray(np.moveaxis(np.array(rows), 2, 0))

        self.f = f
        self.torque = to(LOS, "torque", EXCITED)
        self.test = to(LOS, "test", EXCITED)
        self.base = to(LOS, "motion", (1, 2, 3))
        stiff = stiffness(p, f, slides)
        if not np.any(stiff):
            return
        joints = to(THETA, "torque", EXCITED)
        back = self.torque @ stiff @ np.linalg.inv(np.eye(2) - joints @ stiff)
        self.test = self.test + back @ to(THETA, "test", EXCITED)
        self.base = self.base + back @ to(THETA, "motion", (1, 2, 3))
        self.torque = self.torque + back @ joints


def stiffness(p: Mapping[str, Any], f: Array, slides: bool) -> Complex:
    """Return (frequency, 2, 2): what the linear model has of cables, cogging and, where they slide, the contacts."""
    q = {n: np.asarray(p[f"platform.{n}"], float) for n in (*GEOMETRY, "bending", "theta_0")}
    inner = int(p["platform.form"])
    axis = (0, 2)
    load = [
        q["I_inner"][axis[k], axis[k]] + (0.0 if k == inner else q["I_outer"][axis[k], axis[k]]) for k in PAIR
    ]
    least = np.where(q["bending"] > 0.0, q["J_motor"], np.array(load) + q["J_motor"])
    found = np.zeros((f.size, 2, 2), complex)
    spring = np.maximum(q["friction"], q["stiction"]) / float(p["platform.presliding"])
    for k in PAIR:
        still = q["cable"][k] + q["cogging"][k] * q["cogging_order"][k] * math.cos(
            q["cogging_order"][k] * q["theta_0"][k]
        )
        slips = spring[k] + 2j * np.pi * f * math.sqrt(spring[k] * least[k]) if slides else 0.0
        found[:, k, k] = still + slips
    return found


def by_unbalance(p: Mapping[str, Any], angles: tuple[float, float]) -> Array:
    """Return the torques about pitch and yaw (rows) for an acceleration along x, y, z of the base: kg.m."""
    u = np.asarray(p["platform.unbalance"], float)
    turns = [Rotation.from_euler("x", angles[0]).inv().as_matrix(), Rotation.from_euler("z", angles[1]).inv().as_matrix()]
    inner = int(p["platform.form"])
    first, second = turns[1 - inner], turns[inner]
    axes = np.eye(3)[[0, 2]]
    found = np.zeros((2, 3))
    for j, a in enumerate(np.eye(3)):
        of_inner = np.cross(u[1], second @ first @ a)
        found[inner, j] = -axes[inner] @ of_inner
        found[1 - inner, j] = -axes[1 - inner] @ (np.cross(u[0], first @ a) + second.T @ of_inner)
    return found


def by_source(
    found: LoopFindings, ride: Ride, f: Array, spectrum: VibrationSpectrum | None
) -> dict[str, tuple[Array, Array]]:
    """Return source -> one-sided densities of the line of sight about x and z at f, rad2/Hz.

    Raises LookupError without a linear model of the parts that is needed.
    """
    p = found.record.run.parameters
    ways = Ways(found, f, ride.slides)
    s = 2j * np.pi * f
    made: dict[str, tuple[Array, Array]] = {}

    def add(name: str, way: Complex, density: Array) -> None:
        """way: (frequency, line of sight) of one input."""
        power = np.abs(way) ** 2 * density[:, None]
        before = made.get(name, (np.zeros(f.size), np.zeros(f.size)))
        made[name] = (before[0] + power[:, 0], before[1] + power[:, 1])

    scale = float(p.get("vibration.scale", 1.0)) ** 2
    if spectrum is not None:
        for k, name in enumerate("xyz"):
            if np.any(spectrum.rate[k]):
                add(f"vibration about {name}", ways.base[:, :, k] / s[:, None], scale * spectrum.density("rate", k, f))
        lever = by_unbalance(p, ride.angles)
        for k in range(3):
            if np.any(spectrum.acceleration[k]) and np.any(lever[:, k]):
                add("acceleration by unbalance", ways.torque @ lever[:, k], scale * spectrum.density("acceleration", k, f))
    white = float(p.get("gyro.white") or 0.0)
    if white and "gyro.bandwidth" in p:
        ratio = 1j * f / float(p["gyro.bandwidth"])
        low_pass = 1.0 / (1.0 + math.sqrt(2.0) * ratio + ratio**2)
        inner = int(p["platform.form"])
        for k in PAIR:
            secant = 1.0 / math.cos(ride.angles[inner]) if k != inner else 1.0
            gain = float(p.get("decoupler.K", 1.0)) * secant
            add("noise of the gyro", gain * low_pass[:, None] * ways.test[:, :, k], np.full(f.size, 2.0 * white**2))
    for name, pair in ride.torques.items():
        for k in PAIR:
            add(name, ways.torque[:, :, k], pair[k][-f.size :])  # the lines from the lowest on
    return made
