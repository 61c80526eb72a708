"""Grades of sensors, and the linear error model of an alignment.

    history(settings, psi)      responses of the heading to each constant error, variance by each noise, over time

The model is that of ALIGN-GYRO in continuous time, errors in platform axes:

    phi' = u + d + m + kappa c_z z + white + phi x Omega        t = phi + a + white
    u_z = I + k_z y,  y' = (t_x - y)/lag

Not modelled: period and delay of the controller, lag of the platform (both below 1 % of the times here).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array

DPH, UG = units.factor("deg/h"), 9.80665e-6
LEVEL, COARSE, TURN, SECOND, TO_NORTH, FAST, SLOW = range(1, 8)
STAGES = ("levelling", "coarse heading", "half a turn", "second window", "turn to north", "gyrocompass, fast",
          "gyrocompass, falling")  # fmt: skip
FALL, LAG, RISE = 0.25, 0.1, 0.3  # of alignment_controller
N = 18
PHI, J, I, V, D, M, A, KAPPA, Y = 0, 3, 5, 6, 8, 11, 14, 16, 17  # noqa: E741
#: white drift, Gauss-Markov drift, tilt: number of the noise, and the states that it drives
DRIVEN = ((0, slice(D, D + 3)), (1, slice(M, M + 3)), (2, slice(A, A + 2)))
#: sources of a heading's error, by their ids
SOURCES = {
    **{f"gyro.drift.{axis}": f"constant drift along {axis}" for axis in "xyz"},
    **{f"accelerometer.bias.{axis}": f"accelerometer bias along {axis}" for axis in "xy"},
    "latitude": "latitude", "torquer.azimuth": "azimuth torquer", "gyro.white": "white drift",
    "gyro.markov": "Gauss-Markov drift", "accelerometer.noise": "accelerometer noise",
    "start": "start: tilt 0.1 rad, heading unknown", "base.vibration": "vibration of the base",
}  # fmt: skip


@dataclass(frozen=True)
class Sensors:
    """Standard deviations, SI: constant and Gauss-Markov drift (tau: s), densities of white noise, biases.

    latitude, rad, and scale (relative, azimuth torquer) are those of the place and the torquer.
    """

    bias: float
    markov: float
    white: float
    accelerometer: float
    force: float
    tau: float = 300.0
    latitude: float = 0.0
    scale: float = 0.0


#: constant drift, Gauss-Markov drift, white drift, accelerometer bias and noise; our own assumptions of typical sensors
GRADES = {
    "precise": Sensors(0.002 * DPH, 0.0005 * DPH, 0.006 * DPH, 5.0 * UG, 5.0 * UG),
    "navigation": Sensors(0.01 * DPH, 0.002 * DPH, 0.0178 * DPH, 20.0 * UG, 10.0 * UG),
    "tactical": Sensors(0.1 * DPH, 0.02 * DPH, 0.178 * DPH, 100.0 * UG, 50.0 * UG),
}


@dataclass(frozen=True)
class Settings:
    """Settings of alignment_controller, SI; level: time from switch-on to the first window."""

    latitude: float
    gravity: float = 9.80665
    earth_rate: float = units.EARTH_RATE
    positions: int = 1
    coarse_time: float = 60.0
    order: int = 3
    damping: float = math.sqrt(0.5)
    level_frequency: float = 0.3
    fast_frequency: float = 0.03
    fast_time: float = 100.0
    slow_frequency: float = 0.005
    rate_max: float = math.radians(1.0)
    level: float = 60.0

    @property
    def north(self) -> float:
        return self.earth_rate * math.cos(self.latitude)

    @property
    def up(self) -> float:
        return self.earth_rate * math.sin(self.latitude)

    def gains(self, stage: int, w: float, rise: float = 1.0) -> tuple[float, float, float, float, float, float]:
        """Return k of x and y, of J_x and J_y, of tilt and its integral in the azimuth (rise: share of these)."""
        z = 2.0 * self.damping
        first = (z if self.order == 2 else 1.0 + z) * w
        if stage < TO_NORTH or (stage == TO_NORTH and w > self.fast_frequency):  # still turning
            j = w * w if stage <= COARSE else 0.0
            return z * w, z * w, j, j, 0.0, 0.0
        if stage == TO_NORTH:
            return first, z * w, 0.0, 0.0, 0.0, 0.0
        share = rise / self.north
        if self.order == 2:
            return first, z * w, 0.0, w * w, share * w * w, 0.0
        return first, z * w, 0.0, w * w, share * first * w, share * w**3

    def poles(self, stage: int, w: float) -> list[complex]:
        """Return the poles of the levelling (stages before the gyrocompass) or of the gyrocompass loop, rad/s."""
        k = self.gains(stage, w)
        north = self.north if stage >= FAST else 0.0
        if stage < FAST:
            return [complex(p) for p in np.roots([1.0, k[0], k[2]])] if k[2] else [complex(-k[0])]
        A = [[-k[0], -north, 0.0, 0.0], [north, 0.0, k[4], 1.0], [w / LAG, 0.0, -w / LAG, 0.0], [k[5], 0.0, 0.0, 0.0]]
        n = 4 if k[5] else 3  # phi_x, phi_z, y, integral
        return [complex(p) for p in np.linalg.eigvals(np.array(A)[:n, :n])]


@dataclass(frozen=True)
class AlignmentStretch:
    """A stretch of time with one law: heading in its middle, rate of turning (of the heading), weight of the window."""

    stage: int
    time: float
    psi: float
    turning: float = 0.0
    weight: float = 0.0
    w: float = 0.0
    rise: float = 1.0


@dataclass(frozen=True)
class History:
    """t: s, n instants; stage; usable: from the end of the turn to north on.

    response (n, 3, 18): of phi to each error at switch-on; variance (n, 3 noises, 3).
    """

    t: Array
    stage: Array
    usable: Array
    response: Array
    variance: Array

    def sources(self, settings: Settings, s: Sensors) -> dict[str, tuple[float, str, Array]]:
        """Return, by the ids of :data:`SOURCES`, size and unit of a constant error (0 of a noise), and what it does to
        phi over t (n, 3).

        Of constant errors with sign, the response to one standard deviation; of noises their standard deviation.
        """
        r, g, north = self.response, settings.gravity, settings.north
        lean = s.accelerometer / g
        out = {f"gyro.drift.{axis}": (s.bias, "rad/s", s.bias * r[:, :, D + k]) for k, axis in enumerate("xyz")}
        out["accelerometer.bias.x"] = (s.accelerometer, "m/s2", -lean * r[:, :, A + 1])  # t_y = phi_y - b_x/g
        out["accelerometer.bias.y"] = (s.accelerometer, "m/s2", lean * r[:, :, A])
        out["latitude"] = (s.latitude, "rad", s.latitude * (north * r[:, :, D + 2]))
        out["torquer.azimuth"] = (s.scale, "1", s.scale * r[:, :, KAPPA])
        noises = {"gyro.white": s.white, "gyro.markov": s.markov, "accelerometer.noise": s.force / g}
        for k, (name, size) in enumerate(noises.items()):
            out[name] = (0.0, "", size * np.sqrt(np.maximum(self.variance[:, k], 0.0)))
        tilts = np.sum((0.1 * r[:, :, :2]) ** 2, axis=2)
        heading = 0.5 * north**2 * np.sum(r[:, :, J : J + 2] ** 2, axis=2)
        out["start"] = (0.0, "", np.sqrt(tilts + heading))
        return out

    def sigma(self, settings: Settings, s: Sensors) -> Array:
        """Return the standard deviation of phi over t (n, 3)."""
        return np.asarray(np.sqrt(sum(v**2 for _, _, v in self.sources(settings, s).values())))


def models(c: Settings, stretches: list[AlignmentStretch]) -> Array:
    """Return F of each stretch (n, 18, 18)."""
    k1, k2, j1, j2, kz, ki = np.array([c.gains(p.stage, p.w, p.rise) for p in stretches]).T
    turning, weight, w = np.array([(p.turning, p.weight, p.w) for p in stretches]).T
    heading = np.array([(-math.sin(p.psi), math.cos(p.psi)) if p.stage >= TURN else (0.0, 0.0) for p in stretches])
    x, y = c.north * heading.T
    z = c.up - turning
    stage = np.array([p.stage for p in stretches])
    F = np.zeros((len(stretches), N, N))
    F[:, 0, 0], F[:, 0, 1], F[:, 0, 2] = -k1, z, -y  # phi x Omega, and - k t
    F[:, 1, 0], F[:, 1, 1], F[:, 1, 2] = -z, -k2, x
    F[:, 2, 0], F[:, 2, 1] = y, -x
    F[:, 0, J] = F[:, 1, J + 1] = 1.0
    F[:, :3, D : D + 3] = F[:, :3, M : M + 3] = np.eye(3)
    F[:, 0, A], F[:, 1, A + 1], F[:, 2, Y] = -k1, -k2, kz
    lag = np.where(stage >= FAST, w / LAG, 0.0)
    F[:, Y, PHI], F[:, Y, A], F[:, Y, Y] = lag, lag, -lag
    F[:, J, PHI] = F[:, J, A] = -j1
    F[:, J + 1, PHI + 1] = F[:, J + 1, A + 1] = -j2
    F[:, 2, I], F[:, 2, KAPPA] = 1.0, z
    F[:, I, PHI] = F[:, I, A] = ki
    F[:, V, PHI] = F[:, V, A] = -weight * k1
    F[:, V + 1, PHI + 1] = F[:, V + 1, A + 1] = -weight * k2
    F[:, V, J] = F[:, V + 1, J + 1] = np.where(stage == COARSE, weight, 0.0)
    return F


def windowed(c: Settings, stage: int, psi: float) -> Array:
    """Return what the end of a window makes of the errors."""
    s, o = math.sin(psi), math.cos(psi)
    T = np.eye(N)
    T[V : V + 2] = 0.0
    if stage == COARSE:
        T[2] = 0.0
        T[J : J + 2] = 0.0
        T[2, V : V + 2] = -np.array([o, s]) / c.north
        T[J : J + 2, V : V + 2] = np.outer([-s, o], [-s, o])
    else:
        T[2, V : V + 2] = -0.5 * np.array([o, s]) / c.north
        T[J, V] = T[J + 1, V + 1] = 0.5
    return T


def pieces(c: Settings, psi: float, total: float) -> Iterator[AlignmentStretch]:
    """Yield the stretches of an alignment whose axis y points to psi at switch-on, for ``total`` s."""
    w = c.level_frequency
    yield from (AlignmentStretch(LEVEL, c.level / 60, psi, w=w) for _ in range(60))

    def window(stage: int, at: float) -> Iterator[AlignmentStretch]:
        n = 40
        for k in range(n):
            x = (k + 0.5) / n
            yield AlignmentStretch(stage, c.coarse_time / n, at, weight=6.0 * x * (1.0 - x) / c.coarse_time, w=w)

    def turn(stage: int, start: float, angle: float) -> Iterator[AlignmentStretch]:
        n = max(1, math.ceil(abs(angle) / 0.2))
        for k in range(n):
            rate = math.copysign(c.rate_max, angle)
            yield AlignmentStretch(stage, abs(angle) / c.rate_max / n, start + angle * (k + 0.5) / n, rate, w=w)

    yield from window(COARSE, psi)
    if c.positions == 2:
        yield from turn(TURN, psi, math.pi)
        rest = 3.0 / (c.damping * w)
        yield from (AlignmentStretch(TURN, rest / 5, psi + math.pi, w=w) for _ in range(5))
        psi = math.remainder(psi + math.pi, 2.0 * math.pi)
        yield from window(SECOND, psi)
    yield from turn(TO_NORTH, psi, -psi)
    level = 1.0 / (c.damping * c.fast_frequency)
    yield from (AlignmentStretch(TO_NORTH, level / 10, 0.0, w=c.fast_frequency) for _ in range(10))
    begun = c.level + c.positions * c.coarse_time + abs(psi) / c.rate_max + level
    if c.positions == 2:
        begun += math.pi / c.rate_max + rest
    left, elapsed = max(total - begun, 0.0), 0.0
    while elapsed < left - 1e-9:
        fast = elapsed < c.fast_time - 1e-9
        frequency = c.fast_frequency
        if not fast:
            frequency = max(c.slow_frequency, 1.0 / (1.0 / frequency + FALL * (elapsed - c.fast_time)))
        step = min(0.15 / frequency, left - elapsed, *([c.fast_time - elapsed] if fast else []))
        rise = min((elapsed + 0.5 * step) * c.fast_frequency / RISE, 1.0)
        yield AlignmentStretch(FAST if fast else SLOW, step, 0.0, w=frequency, rise=rise)
        elapsed += step


def transition(F: Array) -> Array:
    """Return exp(F) of each matrix by its series, for the small steps of an alignment (1e-4 and better)."""
    unit = np.eye(N)
    return np.asarray(unit + F @ (unit + F @ (unit + F @ (unit + F / 4.0) / 3.0) / 2.0))


def steps(c: Settings, stretches: list[AlignmentStretch], tau: float) -> tuple[Array, Array]:
    """Return the transition over each stretch (n, 18, 18) and what each noise adds to the covariance (n, 3, 18, 18)."""
    F = models(c, stretches)
    F[:, M : M + 3, M : M + 3] = -np.eye(3) / tau
    time = np.array([p.time for p in stretches])[:, None, None]
    half = transition(F * (0.5 * time))
    T = half @ half
    driven = np.empty((len(stretches), len(DRIVEN), N, N))
    for noise, columns in DRIVEN:
        G = np.broadcast_to(np.eye(N)[:, columns], F[:, :, columns].shape) if noise == 1 else F[:, :, columns]
        first, middle, last = (v @ v.transpose(0, 2, 1) for v in (G, half @ G, T @ G))
        driven[:, noise] = time / 6.0 * (2.0 / tau if noise == 1 else 1.0) * (first + 4.0 * middle + last)  # Simpson
    return T, driven


@lru_cache(maxsize=64)
def history(c: Settings, psi: float, total: float, tau: float = 300.0) -> History:
    """Return the responses over time."""
    X = np.eye(N)
    P = np.zeros((3, N, N))  # of the noises: white drift, Gauss-Markov drift, tilt
    P[1, M : M + 3, M : M + 3] = np.eye(3)
    t, rows = 0.0, []
    before = LEVEL
    at = psi
    stretches = list(pieces(c, psi, total))
    for p, T, driven in zip(stretches, *steps(c, stretches, tau), strict=True):
        if p.stage != before:
            if before in (COARSE, SECOND):
                end = windowed(c, before, at)
                X, P = end @ X, end @ P @ end.T
            if p.stage >= FAST > before and c.positions == 1:
                X[J] = 0.0
                P[:, J, :] = P[:, :, J] = 0.0
            before = p.stage
        X, P = T @ X, T @ P @ T.T + driven
        t += p.time
        at = p.psi
        usable = p.stage >= FAST or (p.stage == TO_NORTH and not p.turning)
        rows.append((t, p.stage, usable, X[:3].copy(), P[:, [0, 1, 2], [0, 1, 2]].copy()))
    return History(*(np.array(column) for column in zip(*rows, strict=True)))
