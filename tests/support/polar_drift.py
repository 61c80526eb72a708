"""Windows of a polar servo test with Gauss-Markov drift, white drift and shared angle readings: made, and estimated at
once by generalized least squares.  Beside estimator_coefficients; shares no code with it.
"""

from __future__ import annotations

import math
from ctypes import c_double, c_uint
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.packaging.instance import make

Array = np.ndarray[Any, Any]
DPH, ARCSEC = math.pi / 648000.0, math.pi / 648000.0
EARTH = 7.2921159e-5
PRIOR = np.array([0.2, 0.1, 0.1, 0.1, 0.1]) * DPH


@dataclass(frozen=True)
class Noise:
    """tau s, rms rad/s, white rad/s/sqrt(Hz), sigma rad: those of EST-KF-COEFF."""

    tau: float = 1800.0
    rms: float = 0.005 * DPH
    white: float = 0.0
    sigma: float = 0.1 * ARCSEC


@dataclass(frozen=True)
class Day:
    """Windows from t0 to t1 s; the table turns evenly with the Earth rate."""

    t0: Array
    t1: Array

    @classmethod
    def of(cls, hours: float = 24.0, dT: float = 100.0) -> Day:
        t0 = np.arange(0.0, hours * 3600.0 - 0.5 * dT, dT)
        return cls(t0, t0 + dT)

    @property
    def design(self) -> Array:
        """Means over the windows, by Gauss-Legendre quadrature of 8 points."""
        x, weight = np.polynomial.legendre.leggauss(8)
        t = (self.t0 + self.t1)[:, None] / 2.0 + (self.t1 - self.t0)[:, None] / 2.0 * x
        columns = [np.ones_like(t), *(f(k * EARTH * t) for k in (1, 2) for f in (np.cos, np.sin))]
        return np.column_stack([c @ weight / 2.0 for c in columns])

    def covariance(self, noise: Noise) -> Array:
        """Of the window means: integrals of rms2 exp(-|t - s|/tau) over both windows, white noise, shared readings."""
        a, b = self.t0, self.t1
        T, tau = b - a, noise.tau

        def decay(s: Array, t: Array) -> Array:
            return np.exp(-np.maximum(t[:, None] - s[None, :], 0.0) / tau)

        later = tau**2 * (decay(b, a) - decay(b, b) - decay(a, a) + decay(a, b))
        R = np.tril(later, -1)
        R = R + R.T + np.diag(2.0 * tau * (T - tau * -np.expm1(-T / tau)))
        shared = np.tril(np.isclose(a[:, None], b[None, :]), -1)
        R = noise.rms**2 * R - noise.sigma**2 * (shared + shared.T) + np.diag(white_part(noise, T))
        return np.asarray(R / np.outer(T, T))

    def covariance_with_end(self, noise: Noise) -> Array:
        """Of the window means with the drift at the end of the last."""
        to_end = noise.tau * (np.exp((self.t1 - self.t1[-1]) / noise.tau) - np.exp((self.t0 - self.t1[-1]) / noise.tau))
        return np.asarray(noise.rms**2 * to_end / (self.t1 - self.t0))


def white_part(noise: Noise, T: Array) -> Array:
    return np.asarray(noise.white**2 * T + 2.0 * noise.sigma**2)


def least_squares(day: Day, noise: Noise, z: Array, prior: Array = PRIOR) -> tuple[Array, Array]:
    """A and w at the end, and their covariance, by one generalized least squares estimate with the prior."""
    X, R = day.design, day.covariance(noise)
    to_end = day.covariance_with_end(noise)
    c, RX = np.linalg.solve(R, to_end), np.linalg.solve(R, X)
    P = np.linalg.inv(X.T @ RX + np.diag(prior**-2.0))
    A, cX = P @ (RX.T @ z), c @ X
    w = c @ (z - X @ A)
    P_w = noise.rms**2 - c @ to_end + cX @ P @ cX
    return np.append(A, w), np.block([[P, -(P @ cX)[:, None]], [-(cX @ P)[None, :], np.array([[P_w]])]])


def draw(day: Day, noise: Noise, rng: np.random.Generator, runs: int, prior: Array = PRIOR) -> tuple[Array, Array]:
    """(runs, 6) coefficients and the drift at the end, (runs, windows) mean rates."""
    X, n = day.design, day.t0.size
    joint = np.zeros((n + 1, n + 1))
    joint[:n, :n], joint[n, n] = day.covariance(noise), noise.rms**2
    joint[n, :n] = joint[:n, n] = day.covariance_with_end(noise)
    scale = np.sqrt(np.diag(joint))
    root = np.linalg.cholesky(joint / np.outer(scale, scale)) * scale[:, None]
    A, e = rng.normal(size=(runs, 5)) * prior, rng.normal(size=(runs, n + 1)) @ root.T
    return np.column_stack([A, e[:, n]]), A @ X.T + e[:, :n]


def instance() -> Any:
    return make("estimator_coefficients", "native")


INPUTS = ("count", "window_phase", "angle_start", "angle_end", "t_start", "t_end", "omega_E", "valid")


def play(
    one: Any, day: Day, z: Array, outputs: list[str], noise: Noise | None = None, valid: Array | None = None,
    phase: Array | None = None, **parameters: float,
) -> Array:  # fmt: skip
    """(windows, outputs) after each window; the instance is reset.

    The angles are those of the Earth rate, whatever z is: omega_E carries the difference, so that the design is known.
    """
    n = day.t0.size
    there, phases = np.ones(n) if valid is None else valid, np.full(n, 2.0) if phase is None else phase
    T = day.t1 - day.t0
    rows = np.column_stack(
        [np.arange(1, n + 1), phases, EARTH * day.t0, EARTH * day.t1, day.t0, day.t1, z - EARTH, there]
    )
    rows[:, 6] = z - (rows[:, 3] - rows[:, 2]) / T
    set_to = {**(vars(noise) if noise else {}), **parameters}
    one.set(set_to)
    one.initialize(0.0)
    references = [
        (c_uint * len(names))(*[one.variables[k].valueReference for k in names]) for names in (INPUTS, outputs)
    ]
    x, y, found = (c_double * len(INPUTS))(), (c_double * len(outputs))(), np.empty((n, len(outputs)))
    for k, row in enumerate(rows.tolist()):
        x[:] = row
        one.fmu.fmi2SetReal(one.fmu.component, references[0], len(x), x)
        one.fmu.fmi2DoStep(one.fmu.component, float(k), 1.0, 1)
        one.fmu.fmi2GetReal(one.fmu.component, references[1], len(y), y)
        found[k] = y
    one.reset()
    return found


def priors(prior: Array) -> dict[str, float]:
    return {f"prior[{k + 1}]": float(x) for k, x in enumerate(prior)}
