"""Loops with dry friction, many at once, for the proof of identification: semi-implicit steps in numpy alone.

    J w' = u - c w - T_c tanh(w/v_s) + d,      u = r - K (y + w_i x),  x' = y,  y = w some samples late

The truth is the best linear approximation for the class of the excitation: S of the mean over many realizations of the
phases, without noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from own_loops import H
from scipy.interpolate import make_smoothing_spline

SUB = 4  # steps of integration in a sample


@dataclass(frozen=True)
class FrictionPlatforms:
    """Parameters, each (n,)."""

    J: np.ndarray
    c: np.ndarray
    T_c: np.ndarray
    v_s: np.ndarray
    K: np.ndarray
    w_i: np.ndarray
    late: np.ndarray

    def repeated(self, count: int) -> FrictionPlatforms:
        return FrictionPlatforms(*(np.repeat(x, count) for x in vars(self).values()))

    def run(self, r: np.ndarray, torque: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return u and y, (samples, n), under r at the plant's input."""
        samples, n = r.shape
        w, x = np.zeros(n), np.zeros(n)
        before = np.zeros((int(self.late.max()) + 1, n))
        u, y = np.empty_like(r), np.empty_like(r)
        rows = np.arange(n)
        h = H / SUB
        for k in range(samples):
            before[k % before.shape[0]] = w
            measured = before[(k - self.late) % before.shape[0], rows] + noise[k]
            x = x + H * measured
            drive = r[k] - self.K * (measured + self.w_i * x)
            for _ in range(SUB):  # the slope of the friction is taken implicitly
                t = np.tanh(w / self.v_s)
                force = drive + torque[k] - self.c * w - self.T_c * t
                w = w + h * force / (self.J + h * (self.c + self.T_c * (1.0 - t * t) / self.v_s))
            u[k], y[k] = drive, measured
        return u, y


def random_friction(count: int, rng: np.random.Generator) -> FrictionPlatforms:
    """Return platforms whose friction is 5 to 40 % of an excitation of rms 1 N.m."""
    J = 10.0 ** rng.uniform(-2.0, -1.0, count)
    fc = rng.uniform(8.0, 20.0, count)
    wc = 2.0 * np.pi * fc
    return FrictionPlatforms(
        J, J * rng.uniform(0.5, 3.0, count), rng.uniform(0.05, 0.4, count), rng.uniform(0.02, 0.1, count) / (J * wc),
        J * wc * rng.uniform(0.7, 1.0, count), wc / rng.uniform(5.0, 10.0, count), rng.integers(1, 6, count),
    )  # fmt: skip


@dataclass(frozen=True)
class MeasuredLoop:
    """S of a mean over realizations at frequencies, Hz; between them a smoothing spline of ln L over ln f."""

    f: np.ndarray
    S: np.ndarray

    def responses(self, f: np.ndarray) -> tuple[np.ndarray, None]:
        """Return L at f, Hz."""
        x, log = np.log(self.f), np.log(1.0 / self.S - 1.0)
        parts = [make_smoothing_spline(x, y)(np.log(f)) for y in (log.real, np.unwrap(log.imag))]
        return np.exp(parts[0] + 1j * parts[1]), None
