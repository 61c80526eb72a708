"""Comparison of a loop at two amplitudes: its curves of S, with their uncertainties.

A linear loop gives the same response at any amplitude.  Dry friction, backlash and saturation do not: the describing
function, and with it every margin, belongs to one amplitude (Pintelon 2012, 4.2).
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench.identification.loop_curve import BETWEEN, LoopCurve

APART = 4.5  # standard uncertainties: of some hundred frequencies one in a thousand pairs of linear loops is so far off
NEAR = (0.1, 10.0)  # of |L|: where it matters


def difference(one: LoopCurve, other: LoopCurve) -> tuple[float, float, float] | None:
    """Return the largest difference of L that is told from noise: dB, degrees, Hz; None for none.

    Raises ValueError where the curves have no frequencies in common.
    """
    at = np.arange(BETWEEN // 2, one.f.size, BETWEEN)
    at = at[(one.f[at] >= other.f[0]) & (one.f[at] <= other.f[-1])] if other.f.size else at[:0]
    if not at.size:
        raise ValueError("no frequencies in common")
    f = one.f[at]
    S = np.interp(f, other.f, other.S.real) + 1j * np.interp(f, other.f, other.S.imag)
    u = np.hypot(one.u[at], np.interp(f, other.f, other.u))
    L, M = one.L[at], (1.0 - S) / S
    size = np.abs(L)
    told = (np.abs(one.S[at] - S) > APART * u) & (size > NEAR[0]) & (size < NEAR[1])
    told &= one.resolved[at] & (np.interp(f, other.f, other.resolved) == 1.0)
    if not np.any(told):
        return None
    k = int(np.argmax(np.where(told, np.abs(np.log(M / L)), 0.0)))
    return 20.0 * math.log10(abs(M[k] / L[k])), math.degrees(float(np.angle(M[k] / L[k]))), float(f[k])
