"""Jitter of the line of sight by source, from the linear model of the run and what was recorded in the ride.

Every way to the line of sight is a response of the closed linear model: of the base's angle, of a torque at a motor, of
a test signal where a loop is opened.

    motion of the base        T_base / s       on its rates that were recorded: vibration, a recorded ride
    acceleration              T_torque u x     on its acceleration; unbalance u, at the mean joint angles
    dry friction, cogging     T_torque         on the torques that the recorded joint angles make
    roll times joint angle    S / s, T_torque  on the rate and the torque of second order (sight_roll)
    noise of the gyro         T_test F / cos   F its filter; 1/cos of the outer axis alone; by its density

The linear model takes a contact for a spring and cogging for its slope.  Where the joints move by more than
presliding, these stiffnesses K are taken out, T (1 - K Theta)^-1 with the joints' response Theta, and the torques
come from the joint angles; where they do not, friction is part of the way of the base.  What a ride moves at once is
not independent: sources add segment by segment with their phases, and each has its share of the sum; a negative share
cancels part of the others.  The noise of the gyro adds by squares.

Not modelled: limits; third order in the angles.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.jitter import Complex, Spectra, segments, spectra
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.margins import excitation_responses
from gyrobench.reduction.loops.sight_roll import as_at_the_start, roll_coupling

PAIR = (0, 1)  # pitch, yaw
EXCITED = (1, 3)  # their elements of the exciter
LOS = ("platform.los[1]", "platform.los[2]")
THETA = ("platform.theta[1]", "platform.theta[2]")
BASE = ("vibration.omega[1]", "vibration.omega[2]", "vibration.omega[3]")
OF_BASE = tuple(f"motion of the base about {axis}" for axis in "xyz")  # sources of the budget
BY_UNBALANCE = "acceleration by unbalance"
NOISE_OF_GYRO = "noise of the gyro"
FRICTION = "dry friction"
ROLL = "roll times joint angle"
INSIDE = ("pitch.e", "yaw.e")  # behind the summing points of the loops
TORQUES = ("cogging", "cogging_order", "friction", "stiction")
GEOMETRY = ("I_outer", "I_inner", "J_motor", *TORQUES)


@dataclass(frozen=True)
class Ride:
    """What was recorded in the ride: spectra of the line of sight, transforms of what moves it, whether joints slide.

    base, force: (axis x, y, z) of (segments, frequencies), rates and accelerations; torques: source -> of pitch, yaw;
    second: rate of the line of sight and torque at the outer gimbal, of second order.
    """

    los: tuple[Spectra, Spectra]
    base: list[Complex]
    force: list[Complex]
    torques: Mapping[str, list[Complex]]
    second: tuple[Complex, Complex]
    slides: bool
    angles: tuple[float, float]  # mean joint angles, rad


def read_ride(gate: Gate, p: Mapping[str, Any], lowest: float, sight: tuple[str, str] = LOS) -> Ride | None:
    """Return what the ride shows; None where it is too short for its lowest frequency, Hz.

    sight: channels of the angles whose jitter it is.
    """
    dt = float(gate.t[1] - gate.t[0])
    los = [spectra(dt, gate[name], lowest) for name in sight]
    if los[0] is None or los[1] is None:
        return None

    def cut(y: Array) -> Complex:
        found = segments(dt, y, lowest)
        assert found is not None
        return found

    theta = [gate[name] for name in THETA]
    slides = any(float(np.ptp(x)) > 2.0 * float(p["platform.presliding"]) for x in theta)
    none: Array = np.zeros(gate.t.size)
    made: dict[str, list[Array]] = {}
    for k in PAIR:
        of = {n: float(np.asarray(p[f"platform.{n}"], float)[k]) for n in TORQUES}
        if max(of["friction"], of["stiction"]) and slides:
            made.setdefault(FRICTION, [none, none])[k] = contact(theta[k], of, float(p["platform.presliding"]))
        if of["cogging"]:
            wave = -of["cogging"] * np.sin(of["cogging_order"] * theta[k])
            made.setdefault("cogging", [none, none])[k] = wave
    second = roll_coupling(gate, p, BASE, THETA)
    return Ride(
        (los[0], los[1]),
        [cut(y) for y in as_at_the_start(gate, p, BASE, THETA)],
        [cut(gate[f"vibration.f[{k}]"]) for k in (1, 2, 3)],
        {name: [cut(m) for m in pair] for name, pair in made.items()},
        (cut(second.rate), cut(second.torque)),
        slides,
        (float(theta[0].mean()), float(theta[1].mean())),
    )


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


def closed_model(found: LoopFindings) -> LinearModel:
    """Return the closed linear model with the step.  Raises LookupError where there is none."""
    model = found.linear.closed.discrete
    if model is None:
        raise LookupError("no linear model")
    return model


class Ways:
    """Responses of the line of sight (rows pitch, yaw) in the closed linear model.

    Raises LookupError where the model lacks one.
    """

    def __init__(self, found: LoopFindings, f: Array, slides: bool) -> None:
        model = closed_model(found)
        p = found.record.run.parameters

        def to(names: tuple[str, ...], kind: str, axes: tuple[int, ...]) -> Complex:
            return excitation_responses(model, kind, axes, names, f)

        self.f = f
        stiff = stiffness(p, f, slides)
        free = np.any(stiff)
        back = stiff @ np.linalg.inv(np.eye(2) - to(THETA, "torque", EXCITED) @ stiff) if free else stiff

        def way(names: tuple[str, ...], kind: str, axes: tuple[int, ...]) -> Complex:
            """Return responses without these stiffnesses."""
            found = to(names, kind, axes)
            return found + to(names, "torque", EXCITED) @ back @ to(THETA, kind, axes) if free else found

        self.torque = way(LOS, "torque", EXCITED)
        self.test = way(LOS, "test", EXCITED)
        self.base = way(LOS, "motion", (1, 2, 3))
        # a rate of the line of sight that no torque makes: the loop leaves S of it, its angle is S / s
        self.rate = np.diagonal(way(INSIDE, "test", EXCITED), axis1=1, axis2=2) / (2j * np.pi * f[:, None])


def stiffness(p: Mapping[str, Any], f: Array, slides: bool) -> Complex:
    """Return (frequency, 2, 2): what the linear model has of cogging and, where they slide, of the contacts."""
    q = {n: np.asarray(p[f"platform.{n}"], float) for n in (*GEOMETRY, "bending", "theta_0")}
    least = np.where(q["bending"] > 0.0, q["J_motor"], bodies(p) + q["J_motor"])
    found = np.zeros((f.size, 2, 2), complex)
    spring = np.maximum(q["friction"], q["stiction"]) / float(p["platform.presliding"])
    for k in PAIR:
        still = q["cogging"][k] * q["cogging_order"][k] * math.cos(q["cogging_order"][k] * q["theta_0"][k])
        slips = spring[k] + 2j * np.pi * f * math.sqrt(spring[k] * least[k]) if slides else 0.0
        found[:, k, k] = still + slips
    return found


def bodies(p: Mapping[str, Any]) -> Array:
    """Return what the gimbals have about pitch and yaw at joint angles 0, without the motors: kg.m2."""
    inner, outer = (np.asarray(p[f"platform.{n}"], float).diagonal()[[0, 2]] for n in ("I_inner", "I_outer"))
    return np.asarray(inner + np.where(np.arange(2) == int(p["platform.form"]), 0.0, outer))


def at_the_body(p: Mapping[str, Any], f: Array) -> Complex:
    """Return (frequency, joint): response to a torque on the gimbal over that to one at its motor.

    1 + J s2/(c s + k) of the motor behind the spring, whatever the loop: both act before the same plant and sensor.
    """
    s = 2j * np.pi * f[:, None]
    w = 2.0 * np.pi * np.asarray(p["platform.bending"], float)
    motor, zeta = (np.asarray(p[f"platform.{n}"], float) for n in ("J_motor", "bending_damping"))
    springs = np.where(w > 0.0, w * w + 2.0 * zeta * w * s, np.inf)
    return np.asarray(1.0 + s * s * (1.0 + motor / bodies(p)) / springs)


def by_unbalance(p: Mapping[str, Any], angles: tuple[float, float]) -> Array:
    """Return the torques about pitch and yaw (rows) for an acceleration along x, y, z of the base: kg.m."""
    u = np.asarray(p["platform.unbalance"], float)
    turns = [
        Rotation.from_euler("x", angles[0]).inv().as_matrix(),
        Rotation.from_euler("z", angles[1]).inv().as_matrix(),
    ]
    inner = int(p["platform.form"])
    first, second = turns[1 - inner], turns[inner]
    axes = np.eye(3)[[0, 2]]
    found = np.zeros((2, 3))
    for j, a in enumerate(np.eye(3)):
        of_inner = np.cross(u[1], second @ first @ a)
        found[inner, j] = -axes[inner] @ of_inner
        found[1 - inner, j] = -axes[1 - inner] @ (np.cross(u[0], first @ a) + second.T @ of_inner)
    return found


@dataclass(frozen=True)
class JitterSource:
    """Of a source, for pitch and yaw: the density alone, and its part of the whole, rad2/Hz; (2, frequencies)."""

    alone: Array
    part: Array


@dataclass(frozen=True)
class JitterBudget:
    """Sources of the line of sight; base: its density, (2, frequencies), by powers 0 to 4 of a factor on the vibration.

    The acceleration and the rates of the base go with the factor, roll times joint angle with its square; the torques
    that the joint angles of the ride make and noise stay.  (): a target turns the joints, too.
    """

    sources: dict[str, JitterSource]
    base: tuple[Array, ...] = ()


@dataclass(frozen=True)
class MoreSources:
    """Sources beside those of the gimbal: what they move, with phases (line of sight, segments, frequencies), and
    densities of independent ones (line of sight, frequencies).
    """

    moved: Mapping[str, Complex]
    noise: Mapping[str, Array]


def by_source(found: LoopFindings, ride: Ride, use: NDArray[np.bool_], more: MoreSources | None = None) -> JitterBudget:
    """Return the sources of the line of sight at the frequencies of its spectra that are used.

    Raises LookupError without a linear model of the parts that is needed.
    """
    p = found.record.run.parameters
    f = ride.los[0].f[use]
    ways = Ways(found, f, ride.slides)
    moved: dict[str, Complex] = {}  # source -> (line of sight, segments, frequencies)

    def add(name: str, way: Complex, signal: Complex) -> None:
        """way: (frequency, line of sight)."""
        moved[name] = moved.get(name, np.zeros((), complex)) + way.T[:, None, :] * signal[None, :, use]

    for k, source in enumerate(OF_BASE):
        add(source, ways.base[:, :, k] / (2j * np.pi * f[:, None]), ride.base[k])
    lever = by_unbalance(p, ride.angles)
    for k in range(3) if np.any(lever) else ():
        add(BY_UNBALANCE, (ways.torque * at_the_body(p, f)[:, None, :]) @ lever[:, k], ride.force[k])
    for name, pair in ride.torques.items():
        for k in PAIR:
            add(name, ways.torque[:, :, k], pair[k])
    outer = 1 - int(p["platform.form"])
    along = np.eye(2)[outer]
    add(ROLL, ways.rate[:, outer, None] * along, ride.second[0])
    add(ROLL, (ways.torque * at_the_body(p, f)[:, None, :])[:, :, outer], ride.second[1])
    moved |= more.moved if more else {}
    whole, named = sum(moved.values(), np.zeros((), complex)), set(moved)
    sources = {
        name: JitterSource(np.mean(np.abs(y) ** 2, axis=1), np.mean(np.real(np.conj(whole) * y), axis=1))
        for name, y in moved.items()
        if np.any(y)
    }
    white = float(p.get("gyro.white") or 0.0)
    if white and "gyro.bandwidth" in p:
        density = _gyro(p, ride, ways, 2.0 * white**2)
        sources[NOISE_OF_GYRO] = JitterSource(density, density)
    sources |= {name: JitterSource(y, y) for name, y in (more.noise if more else {}).items()}
    nothing = np.zeros((), complex)
    shaken = sum((moved.pop(name) for name in (*OF_BASE, BY_UNBALANCE) if name in moved), nothing)
    by_power = (whole - shaken - moved[ROLL], shaken, moved[ROLL])
    base = [np.zeros((2, f.size)) for _ in range(5)]
    for (i, a), (j, b) in product(enumerate(by_power), repeat=2):
        base[i + j] += np.mean(np.real(np.conj(a) * b), axis=1)
    base[0] += sum((x.part for name, x in sources.items() if name not in named), np.zeros(()))
    return JitterBudget(sources, () if more and more.moved else tuple(base))


def _gyro(p: Mapping[str, Any], ride: Ride, ways: Ways, density: float) -> Array:
    """Return the density of the line of sight by white noise of both axes of the gyro: (2, frequencies)."""
    ratio = 1j * ways.f / float(p["gyro.bandwidth"])
    low_pass = 1.0 / (1.0 + math.sqrt(2.0) * ratio + ratio**2)
    inner = int(p["platform.form"])
    total: Array = np.zeros((2, ways.f.size))
    for k in PAIR:
        secant = 1.0 / math.cos(ride.angles[inner]) if k != inner else 1.0
        gain = float(p.get("decoupler.K", 1.0)) * secant
        total = total + density * np.abs(gain * low_pass[:, None] * ways.test[:, :, k]).T ** 2
    return total
