"""A table with two axes and an inertial measurement unit in plain numpy and scipy: records without gyrobench.

Rotations are those of scipy (vectors turned from the instrument into east, north, up); means over a window that turns
are sums over 720 even steps of each turn.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

EARTH = 7.2921159e-5
Array = Any


@dataclass
class Unit:
    """True instrument, SI; G per g0."""

    bg: Array
    Sg: Array
    G: Array
    ba: Array
    Sa: Array

    @classmethod
    def drawn(cls, rng: np.random.Generator, size: float = 1e-3) -> Unit:
        dph = math.pi / 648000.0
        return cls(
            rng.normal(size=3) * 20.0 * dph, rng.normal(size=(3, 3)) * size, rng.normal(size=(3, 3)) * 2.0 * dph,
            rng.normal(size=3) * 5e-3 * 9.80665, rng.normal(size=(3, 3)) * size,
        )  # fmt: skip

    def coefficients(self) -> dict[str, float]:
        """Return the values by the names of the reduction."""
        found = {}
        for i, a in enumerate("xyz"):
            found |= {f"bg_{a}": self.bg[i], f"ba_{a}": self.ba[i]}
            for k, b in enumerate("xyz"):
                found |= {f"Sg_{a}{b}": self.Sg[i, k], f"G_{a}{b}": self.G[i, k], f"Sa_{a}{b}": self.Sa[i, k]}
        return {n: float(v) for n, v in found.items()}


@dataclass
class Heat:
    """What follows the temperature, SI, of three instruments; T above the reference, z a play of this width (K)."""

    bias: Array  # (3, 3): of T, T2, T3 (rows) for each instrument
    hysteresis: Array
    ramp: Array
    scale: Array  # (2, 3): of T, T2
    width: float = 10.0

    @classmethod
    def drawn(cls, rng: np.random.Generator, bias: float, scale: float) -> Heat:
        """bias: SI, of the polynomial at 40 K; scale: relative, there."""
        powers = 40.0 ** -np.arange(1.0, 4.0)[:, None]
        return cls(rng.normal(size=(3, 3)) * bias * powers, rng.normal(size=3) * bias, rng.normal(size=3) * bias * 30.0,
                   rng.normal(size=(2, 3)) * scale * powers[:2])  # fmt: skip

    def means(self, t0: Array, t1: Array, temperature: Any, inputs: Array) -> Array:
        """Return what is read too much (n, 3), means over windows; temperature: function of the time, K; inputs (n, 3)
        of the instruments, even over each window.
        """
        t = np.arange(t0[0], t1[-1] + 0.25, 0.25)
        T = temperature(t)
        z, play = 0.0, []
        for step in np.diff(T, prepend=T[0]):
            z = min(max(z + 2.0 * step / self.width, -1.0), 1.0)
            play.append(z)
        slope = np.gradient(T, t)
        each = np.array([T, T**2, T**3]).T @ self.bias + np.outer(play, self.hysteresis) + np.outer(slope, self.ramp)
        grown = np.array([T, T**2]).T @ self.scale
        out = np.empty((t0.size, 3))
        for k, (a, b) in enumerate(zip(t0, t1, strict=True)):
            rows = (t >= a) & (t < b)
            out[k] = each[rows].mean(axis=0) + grown[rows].mean(axis=0) * inputs[k]
        return out

    def coefficients(self, kind: str) -> dict[str, float]:
        """Return the values by the names of the reduction."""
        found = {}
        for i, a in enumerate("xyz"):
            found |= {f"b{kind}{n}_{a}": self.bias[k, i] for k, n in enumerate(("T", "T2", "T3"))}
            found |= {f"b{kind}H_{a}": self.hysteresis[i], f"b{kind}R_{a}": self.ramp[i]}
            found |= {f"S{kind}{n}_{a}": self.scale[k, i] for k, n in enumerate(("T", "T2"))}
        return {n: float(v) for n, v in found.items()}


@dataclass
class World:
    """Site and errors of the set-up.  case: turn of the instrument on the plate; table: of the table in the room."""

    latitude: float = 0.7
    gravity: float = 9.805
    case: Rotation = field(default_factory=Rotation.identity)
    table: Rotation = field(default_factory=Rotation.identity)
    square: float = 0.0

    def axes(self, x: Array, y: Array) -> Rotation:
        """Instrument to east, north, up at table angles (n,): turned about X, then about Y as X has taken it."""
        right = Rotation.from_rotvec([0.0, 0.0, self.square])
        about_x, about_y = (Rotation.from_rotvec(np.outer(q, axis)) for q, axis in ((x, [1, 0, 0]), (y, [0, 1, 0])))
        return self.table * about_x * right * about_y * self.case

    def felt(self, x: Array, y: Array, rate_x: float, rate_y: float) -> tuple[Array, Array]:
        """Rate and specific force (n, 3) in axes of the instrument."""
        to_room = self.axes(x, y)
        earth = EARTH * np.array([0.0, math.cos(self.latitude), math.sin(self.latitude)])
        about = self.table.apply([1.0, 0.0, 0.0]) * rate_x
        second = (
            self.table * Rotation.from_rotvec(np.outer(x, [1, 0, 0])) * Rotation.from_rotvec([0.0, 0.0, self.square])
        ).apply([0.0, 1.0, 0.0])
        omega = to_room.inv().apply(earth + about + second * rate_y)
        return omega, to_room.inv().apply([0.0, 0.0, self.gravity])

    def windows(self, plan: list[tuple[float, float, float, float, float, int]], unit: Unit,
                noise: Any = None) -> dict[str, Array]:  # fmt: skip
        """Windows of a plan of (outer, inner, rate of outer, rate of inner, length, number); noise: (gyro, acc) (n, 3)
        functions of starts and ends.
        """
        rows: dict[str, list[float]] = {
            n: [] for n in ("phase", "t_start", "t_end", "outer_start", "outer_end", "inner_start", "inner_end")
        }
        omega, force = [], []
        t = 0.0
        for k, (x0, y0, rx, ry, length, count) in enumerate(plan, 1):
            t += 10.0
            for j in range(count):
                turns = max(1, math.ceil(max(abs(rx), abs(ry)) * length / (2.0 * math.pi)))
                steps = 720 * turns if rx or ry else 1
                s = (np.arange(steps) + 0.5) / steps * length + j * length
                w, f = self.felt(x0 + rx * s, y0 + ry * s, rx, ry)
                omega.append(w.mean(axis=0))
                force.append(f.mean(axis=0))
                ends = (j * length, (j + 1) * length)
                values = (k, t, t + length, x0 + rx * ends[0], x0 + rx * ends[1], y0 + ry * ends[0], y0 + ry * ends[1])
                for n, v in zip(rows, values, strict=True):
                    rows[n].append(v)
                t += length
        out = {n: np.array(v) for n, v in rows.items()}
        w, f = np.array(omega), np.array(force)
        gyro = w + w @ unit.Sg.T + f @ unit.G.T / 9.80665 + unit.bg
        acc = f + f @ unit.Sa.T + unit.ba
        if noise is not None:
            more = noise(out["t_start"], out["t_end"])
            gyro, acc = gyro + more[0], acc + more[1]
        for i, a in enumerate("xyz"):
            out[f"mean_g{a}"], out[f"mean_a{a}"] = gyro[:, i], acc[:, i]
        return out


RIGHT = math.pi / 2.0
FACES = [(0.0, 0.0), (math.pi, 0.0), (RIGHT, 0.0), (-RIGHT, 0.0), (0.0, RIGHT), (0.0, -RIGHT)]
EDGES = [(a * RIGHT / 2.0, b * RIGHT) for a in (1, -1) for b in (0, 2, 1, -1)] + [
    (0.0, b * RIGHT / 2.0) for b in (1, -1, 3, -3)
]


def plan(places: Any = (*FACES, *EDGES), rate: float = 0.5, turns: int = 5, dwell: float = 60.0, count: int = 4,
         axes: str = "xyz") -> Any:  # fmt: skip
    """Positions, then turns in both senses about the axes."""
    found = [(x, y, 0.0, 0.0, dwell / count, count) for x, y in places]
    one = 2.0 * math.pi / rate if rate else 0.0
    for axis in axes if rate else "":
        for sign in (1.0, -1.0):
            inner = RIGHT if axis == "z" else 0.0
            rates = (0.0, sign * rate) if axis == "y" else (sign * rate, 0.0)
            found.append((0.1, inner, *rates, one, turns))
    return found


def own_axes(unit: Unit) -> dict[str, float]:
    """Coefficients in the axes of the accelerometers: x along the first input axis, y in the plane of the first two, by
    Gram and Schmidt from the rows of 1 + Sa.
    """
    K = np.eye(3) + unit.Sa
    x = K[0] / np.linalg.norm(K[0])
    y = K[1] - (K[1] @ x) * x
    y /= np.linalg.norm(y)
    axes = np.array([x, y, np.cross(x, y)])  # rows: the new axes in the old ones
    turned = Unit(unit.bg, (np.eye(3) + unit.Sg) @ axes.T - np.eye(3), unit.G @ axes.T, unit.ba, K @ axes.T - np.eye(3))
    return turned.coefficients()


DIRECTIONS = np.array([d for d in itertools.product((1.0, 0.0, -1.0), repeat=3) if any(d)])


def poses(rng: np.random.Generator, count: int = 26) -> list[Rotation]:
    """Attitudes (instrument to room) with faces, edges and corners up, each some degrees off and of any heading."""
    order = rng.permutation(len(DIRECTIONS))[:count]
    found = []
    for d in DIRECTIONS[order]:
        up = d / np.linalg.norm(d) + 0.1 * rng.normal(size=3)
        axis = np.cross(up / np.linalg.norm(up), [0.0, 0.0, 1.0])
        size = np.linalg.norm(axis)
        angle = math.atan2(size, up[2] / np.linalg.norm(up))
        level = Rotation.from_rotvec(axis / size * angle if size > 1e-9 else [angle, 0.0, 0.0])
        found.append(Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)]) * level)
    return found


def handled(
    unit: Unit, at: list[Rotation], rng: np.random.Generator, *, rest: float = 4.0, turn: float = 2.0,
    rate: float = 100.0, gyro: float = 0.0, acc: float = 0.0, latitude: float = 0.7, gravity: float = 9.805,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Time (n,), readings of gyros and of accelerometers (n, 3) of a unit that is put from attitude to attitude.

    gyro, acc: noise densities.  Between the attitudes the instrument turns about one axis as a cycloid does.
    """
    earth = EARTH * np.array([0.0, math.cos(latitude), math.sin(latitude)])
    omega, force = [], []
    still, moving = round(rest * rate), round(turn * rate)
    for k, here in enumerate(at):
        way = (here.inv() * at[k + 1]).as_rotvec() if k + 1 < len(at) else np.zeros(3)
        tau = np.concatenate([np.zeros(still), np.arange(1, moving) / moving if k + 1 < len(at) else []])
        part = tau - np.sin(2.0 * np.pi * tau) / (2.0 * np.pi)
        speed = (1.0 - np.cos(2.0 * np.pi * tau)) / turn
        to_room = here * Rotation.from_rotvec(np.outer(part, way))
        omega.append(np.outer(speed, way) + to_room.inv().apply(earth))
        force.append(to_room.inv().apply([0.0, 0.0, gravity]))
    w, f = np.concatenate(omega), np.concatenate(force)
    size = math.sqrt(rate)
    read_g = w + w @ unit.Sg.T + f @ unit.G.T / 9.80665 + unit.bg + gyro * size * rng.normal(size=w.shape)
    read_a = f + f @ unit.Sa.T + unit.ba + acc * size * rng.normal(size=f.shape)
    return np.arange(len(w)) / rate, read_g, read_a
