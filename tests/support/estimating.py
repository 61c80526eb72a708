"""Plays a series of readings through an estimator (its native FMU)."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import c_double, c_uint
from typing import Any

import numpy as np
from native_parts import make

Array = np.ndarray[Any, Any]
AR3 = (-0.7466, -0.5044, -0.2538)  # table 3.4.2 of Xia 2008 with its sign put right
SIGMA2 = 3.3697e-6  # its innovation variance


def arrays(parameters: dict[str, Any]) -> dict[str, float]:
    """phi=[a, b] as phi[1] ... phi[5]; an array of numpy as it is, element by element."""
    found: dict[str, float] = {}
    for name, value in parameters.items():
        if isinstance(value, np.ndarray):
            found |= {f"{name}[{','.join(str(k + 1) for k in i)}]": float(x) for i, x in np.ndenumerate(value)}
        elif isinstance(value, Sequence):
            found |= {f"{name}[{i + 1}]": float(x) for i, x in enumerate([*value, *[0.0] * (5 - len(value))])}
        else:
            found[name] = float(value)
    return found


def _references(one: Any, names: Sequence[str]) -> Any:
    return (c_uint * len(names))(*[one.variables[n].valueReference for n in names])


def play(
    part: str,
    z: Array | Sequence[float],
    outputs: str | Sequence[str] = "estimate",
    *,
    T: float = 1e-3,
    valid: Array | None = None,
    instance: Any = None,
    **parameters: Any,
) -> Array:
    """Outputs after each reading: (n,) for one output, (n, m) for a list; T: communication step, s.

    z, valid: (n,), or (n, m) for the first m readings of a part that has several.

    instance: of the part, used and reset.
    """
    names = [outputs] if isinstance(outputs, str) else list(outputs)
    one: Any = instance or make(part, "native")
    columns = np.asarray(z, dtype=float).reshape(len(z), -1)
    there = np.ones_like(columns) if valid is None else np.asarray(valid, dtype=float).reshape(len(z), -1)
    given = np.hstack([columns, there]).tolist()
    fed = [f"{n}{'' if k == 0 else f'_{k + 1}'}" for n in ("z", "valid") for k in range(columns.shape[1])]
    try:
        one.set(arrays(parameters))
        one.initialize(0.0)
        found = np.empty((len(z), len(names)))
        # by FMI's own functions with buffers made once: there are tests with a million readings
        fmu, known, wanted = one.fmu, [n for n in fed if n in one.variables], len(names)
        inputs, found_at = (_references(one, ns) for ns in (known, names))
        x, y = (c_double * len(known))(), (c_double * wanted)()
        for k, reading in enumerate(given):
            x[:] = reading[: len(known)]
            fmu.fmi2SetReal(fmu.component, inputs, len(known), x)
            fmu.fmi2DoStep(fmu.component, k * T, T, 1)
            fmu.fmi2GetReal(fmu.component, found_at, wanted, y)
            found[k] = y
    finally:
        if instance is None:
            one.free()
        else:
            one.reset()
    return found[:, 0] if isinstance(outputs, str) else found


def companion(phi: Sequence[float], Q: float) -> tuple[Array, Array]:
    """Transition matrix and process covariance of x_t = sum phi_i x_{t-i} + w_t, var w = Q."""
    p = len(phi)
    F = np.zeros((p, p))
    F[0] = phi
    F[1:, :-1] = np.eye(p - 1)
    G = np.zeros((p, p))
    G[0, 0] = Q
    return F, G


def rate_model(q: float, T: float, walk: float = 0.0) -> tuple[Array, Array]:
    """The same of value and slope, slope driven by white noise of density q, value by one of density walk."""
    G = q * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    G[0, 0] += walk * T
    return np.array([[1.0, T], [0.0, 1.0]]), G


def kalman(z: Array, F: Array, G: Array, R: float, P0: Array, valid: Array | None = None) -> Array:
    """(n, 4): estimate, variance, innovation, nis of the filter written in matrices, H = [1 0 ... 0]."""
    n = len(F)
    H = np.eye(1, n)
    x, P = np.zeros((n, 1)), np.array(P0, dtype=float)
    found = []
    for k, reading in enumerate(z):
        x, P = F @ x, F @ P @ F.T + G
        y = e = 0.0
        if valid is None or valid[k]:
            S = float((H @ P @ H.T)[0, 0]) + R
            K = P @ H.T / S
            y = float(reading - (H @ x)[0, 0])
            e = y * y / S
            x = x + K * y
            P = (np.eye(n) - K @ H) @ P @ (np.eye(n) - K @ H).T + K @ K.T * R
        found.append((x[0, 0], P[0, 0], y, e))
    return np.array(found)


def kalman_of_many(
    z: Array, A: Array, C: Array, W: Array, V: Array, x0: Array, P0: Array, valid: Array | None = None
) -> list[tuple[Array, Array, float]]:
    """(x, P, nis) after each instant of the filter written in matrices; z: (k, m); rows that are missing left out."""
    x, P, found = np.array(x0, dtype=float), np.array(P0, dtype=float), []
    for k, reading in enumerate(z):
        x, P, e = A @ x, A @ P @ A.T + W, 0.0
        rows = np.flatnonzero(valid[k]) if valid is not None else np.arange(len(C))
        if rows.size:
            H, R = C[rows], V[np.ix_(rows, rows)]
            S = H @ P @ H.T + R
            K = np.linalg.solve(S, H @ P).T
            y = reading[rows] - H @ x
            e = float(y @ np.linalg.solve(S, y))
            x, L = x + K @ y, np.eye(len(x)) - K @ H
            P = L @ P @ L.T + K @ R @ K.T
        found.append((x, P, e))
    return found


def padded(**matrices: Array) -> dict[str, Array]:
    """A, W, P0 (6, 6), C (3, 6), V, psi (3, 3), x0 (6,) for the parts of the linear model."""
    shapes = {"A": (6, 6), "W": (6, 6), "P0": (6, 6), "C": (3, 6), "V": (3, 3), "psi": (3, 3), "x0": (6,)}
    found = {name: np.zeros(shapes[name]) for name in matrices}
    for name, x in matrices.items():
        found[name][tuple(slice(0, k) for k in np.shape(x))] = x
    return found


#: model that estimator_aided is told, and that aided_series draws
AIDED = {
    "Ts": 0.01, "q": 3.0, "walk": 1e-4, "R": 4e-4, "k": 2.0, "drift": 0.3, "sigma_angle": 5e-3, "P0_slope": 0.5,
}  # fmt: skip


def aided_model() -> tuple[Array, Array]:
    """exp(A T) and the covariance of the driving noise over T of (value, slope, drift, angle), by Van Loan."""
    from scipy.linalg import expm

    A = np.zeros((4, 4))
    A[0, 1], A[3, 0] = 1.0, AIDED["k"]
    big = np.zeros((8, 8))
    big[:4, :4], big[4:, 4:], big[:4, 4:] = -A, A.T, np.diag([0.0, AIDED["q"], AIDED["walk"], 0.0])
    e = expm(big * AIDED["Ts"])
    F = e[4:, 4:].T
    return F, F @ e[:4, 4:]


def aided_series(rng: np.random.Generator, n: int, every: int) -> tuple[Array, Array, Array]:
    """States of that model, (n, 4), readings (n,) and angles (n,), NaN but for one in ``every``."""
    F, Q = aided_model()
    root = np.linalg.cholesky(Q + 1e-18 * np.eye(4))
    x = rng.normal(size=4) * [1.0, np.sqrt(AIDED["P0_slope"]), AIDED["drift"], 0.0]
    X = np.empty((n, 4))
    for k in range(n):
        X[k] = x = F @ x + root @ rng.normal(size=4)
    z = X[:, 0] + X[:, 2] + np.sqrt(AIDED["R"]) * rng.normal(size=n)
    read = np.arange(1, n + 1) % every == 0
    return X, z, np.where(read, X[:, 3] + AIDED["sigma_angle"] * rng.normal(size=n), np.nan)


def riccati(F: Array, G: Array, R: float) -> tuple[float, float]:
    """Steady gain of the first state and variance of its estimate, from scipy's solve_discrete_are."""
    from scipy.linalg import solve_discrete_are

    H = np.eye(1, len(F))
    P = solve_discrete_are(F.T, H.T, G, np.array([[R]]))
    gain = float(P[0, 0] / (P[0, 0] + R))
    return gain, gain * R  # P+ = P- R / (P- + R)


def autoregressive(rng: np.random.Generator, n: int, Q: float, phi: Sequence[float] = AR3) -> Array:
    """A stationary series of n values."""
    from scipy.signal import lfilter

    w = rng.normal(size=n + 500) * np.sqrt(Q)
    return np.asarray(lfilter([1.0], [1.0, *(-c for c in phi)], w)[500:])


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def decibel(x: Array, of: float) -> float:
    return float(20.0 * np.log10(rms(x) / of))
