"""Torques that the model of the motor test leaves out, each sought in what the fit leaves.

A term f of M joins the fit with the covariance found without it: the F test of its columns <f> tells whether it is
there, their values how large it is.  What is there moves the constants by up to as many u as it has itself.
[MOTOR-TEST; own design]

Not sought: cogging and torque ripple of the motor.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import linalg, special

from gyrobench.reduction.toolkit import Array, plain

LEVEL = 1e-3  # of all terms together


class Term(NamedTuple):
    """columns: torques (samples, m) of size 1 at these angles (rad) and rates (rad/s)."""

    meaning: str
    unit: str
    columns: Callable[[Array, Array], Array]
    remedy: str


TERMS = (
    Term(
        "drag with the square of the rate", "N·m·s²/rad²", lambda x, w: -(w * np.abs(w))[:, None],
        "Take a lower rate, or say the drag of the air with D.",
    ),
    Term(
        "torque once a turn", "N·m", lambda x, w: np.column_stack([np.cos(x), np.sin(x)]),
        "Balance the table, or level its axis.",
    ),
)  # fmt: skip


class Sought(NamedTuple):
    """A term with its size (the amplitude of two columns), its u in ``unit``, and the p of its F test."""

    term: Term
    size: float
    u: float
    p: float


def seek(X: Array, rest: Array, V: Array, J: float, terms: Sequence[Array]) -> list[Sought]:
    """Return each of :data:`TERMS`, likeliest first.

    X (n, p), rest (n,): regressors and residuals of y; V: their covariance, lower bands; J: inertia, which makes
    torques of y; terms: <f> of each term, (n, m).
    """
    factor = linalg.cholesky_banded(V, lower=True)
    found = []
    for term, columns in zip(TERMS, terms, strict=True):
        m = columns.shape[1]
        white = linalg.solve_banded((V.shape[0] - 1, 0), factor, np.column_stack([X, columns, rest]))
        A, z = white[:, :-1], white[:, -1]
        value, *_ = np.linalg.lstsq(A, z, rcond=None)
        left, dof = float(np.sum((z - A @ value) ** 2)), z.size - A.shape[1]
        without = float(np.sum((z - A[:, :-m] @ np.linalg.lstsq(A[:, :-m], z, rcond=None)[0]) ** 2))
        F = max(without - left, 0.0) / m / (left / dof)
        size = float(np.linalg.norm(value[-m:]))
        own = np.linalg.inv(A.T @ A)[-m:, -m:] * left / dof
        along = value[-m:] / size if size > 0.0 else np.eye(m)[0]
        u = float(np.sqrt(along @ own @ along))
        found.append(Sought(term, J * (size if m > 1 else float(value[-1])), J * u, float(special.fdtrc(m, dof, F))))
    return sorted(found, key=lambda s: s.p)


def sentence(sought: Sequence[Sought]) -> str:
    """Return what is said of the likeliest term, '' where chance explains it."""
    first = sought[0]
    if first.p >= LEVEL / len(sought):
        return ""
    size = f"{plain(first.size)} ± {plain(1.96 * first.u, 1)} {first.term.unit}"
    return (
        f"What the model leaves holds a {first.term.meaning}, {size} (95 %), which is not in it: K, J, D, M_C and c "
        f"may be wrong by more than their u. {first.term.remedy}"
    )
