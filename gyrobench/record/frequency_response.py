"""Frequency responses and poles of the linear models that a record holds: A, B, C, D and a step (s; 0: continuous)."""

from __future__ import annotations

import cmath
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel

Complex = NDArray[np.complex128]
SLOW = 1e-2  # rad/s: a pole nearer to the origin is an integrator of the model (an attitude, a time)
TOGETHER = 30_000  # elements of the matrices that are solved at once: they fit into the processor's cache
TOLERANCE = 0.05  # relative, of a crossover against the requested one


def model_response(model: LinearModel, f: Sequence[float] | Array) -> Complex:
    """Return the frequency response of a model: array (frequency, output, input)."""
    a, b, c, d = (np.asarray(m, float) for m in (model.A, model.B, model.C, model.D))
    n = len(model.states)
    a, b, c = a.reshape(n, n), b.reshape(n, len(model.inputs)), c.reshape(len(model.outputs), n)
    d = d.reshape(len(model.outputs), len(model.inputs))
    between = reached(a, b) & reached(a.T, c.T)  # the other states, often two of three, are of no effect
    a, b, c, n = a[between][:, between], b[between], c[:, between], int(between.sum())
    s = 2j * np.pi * np.asarray(f, float)
    s = np.exp(s * model.step) if model.step else s
    one, b = np.eye(n), b.astype(complex)
    parts = np.array_split(s, -(-s.size * n * n // TOGETHER) or 1)
    states = [np.linalg.solve(p[:, None, None] * one - a, np.broadcast_to(b, (p.size, *b.shape))) for p in parts]
    return np.asarray(c @ np.concatenate(states) + d)


def reached(a: Array, b: Array) -> NDArray[np.bool_]:
    """Return the states that the inputs move, directly (b) or through others (a): (n,)."""
    reached: NDArray[np.bool_] = np.any(b != 0.0, axis=1)
    for _ in range(len(reached)):
        further = reached | np.any(a[:, reached] != 0.0, axis=1)
        if np.array_equal(further, reached):
            break
        reached = further
    return reached


def poles(model: LinearModel) -> list[complex]:
    """Return the poles in the s plane, rad/s; of a discrete model ln(z) / step, without z = 0 (pure delays)."""
    eigenvalues = np.linalg.eigvals(np.asarray(model.A, float)) if model.A else np.zeros(0)
    if not model.step:
        return [complex(p) for p in eigenvalues]
    return [cmath.log(complex(z)) / model.step for z in eigenvalues if abs(z) > 1e-12]


def unstable(model: LinearModel) -> list[complex]:
    """Return the poles in the right half plane, the fastest growing first, but those nearer to 0 than 0.01 rad/s.

    Nor do those of a discrete model nearer than 1e-5 / step: rounding splits three integrators in a row, a triple pole
    at z = 1, by the third root of 1e-16.
    """
    slow = max(SLOW, 1e-5 / model.step) if model.step else SLOW
    right = [p for p in poles(model) if p.imag >= 0.0 and abs(p) > slow and p.real > 1e-6 * abs(p)]
    return sorted(right, key=lambda p: -p.real)
