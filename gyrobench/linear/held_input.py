"""The exact step of a continuous system whose inputs are held."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component.numerics import TAYLOR


def held(a: Array, b: Array, t: float) -> tuple[Array, Array]:
    """Return e^(A t) and int_0^t e^(A s) ds B, B (n, m) or (n,), by phi1(A t) as in the integrator of the parts.

    numerics.phi1 has the formulas; it is of lists.
    """
    one, z = np.eye(len(a)), a * t
    doublings = max(0, 1 + math.frexp(np.abs(z).sum(axis=1).max(initial=0.0))[1])
    z, phi = z / 2.0**doublings, one
    for k in range(TAYLOR, 1, -1):
        phi = one + z @ phi / k
    for _ in range(doublings):
        phi = phi @ (one + 0.5 * (z @ phi))
        z = 2.0 * z
    return one + z @ phi, t * (phi @ b)
