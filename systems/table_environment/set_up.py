"""Errors of the set-up of the test of surroundings: what they do to the data, to first order.

With w = (w_E, w_N, w_U) the inertial rate of the ground in its own axes, tilted by q,

    w_N = W cos phi + q_E W sin phi + dq_N/dt        w_U = W sin phi - q_E W cos phi

and the gyro (input axis east, output axis up, spin axis south) turned by a small angle r about its own axes,

    about I:  s_E r                                   (a tilt about east that turns no rate)
    about O:  -r w_N + r (s_E q_N - s_N q_E)          (input axis towards north)
    about S:  -r w_U - s_N r                          (input axis up)

is what -k i is more than without.  What is recorded beside the current may have a wrong scale.  [ENV-DISTURBANCE;
derived]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.setups import SiteSetup
from gyrobench.reduction.setup.sources import CURRENT_OFFSET, TORQUER_SCALE, TURNED, Effect

from .sources import RECORDED


def effects(
    found: Findings, windows: Mapping[str, Array], s: SiteSetup, k: float, causes: Sequence[str]
) -> list[Effect]:
    """Return all sources.

    k: torquer scale factor, rad/s/A.  causes: names of the recorded columns, in the order of the columns of the fit,
    which follow its constant.
    """
    tilt_east, tilt_north = (np.asarray(windows[n], dtype=float) for n in ("tilt_east", "tilt_north"))
    s_E, s_N = (float(found.est.beta[1 + causes.index(n)]) for n in ("tilt_east", "tilt_north"))
    w, middle = s.earth_rate, (found.t_start + found.t_end) / 2.0
    north, up = w * math.cos(s.latitude), w * math.sin(s.latitude)
    turning = _rate(found.t_start, found.t_end, tilt_north)
    turned = {
        "input": np.full_like(middle, s_E),
        "output": -(north + tilt_east * up + turning) + s_E * tilt_north - s_N * tilt_east,
        "spin": -(up - tilt_east * north) - s_N,
    }
    one = np.eye(found.X.shape[1])
    return [
        *(TURNED[n].effect(s, found.error(e)) for n, e in turned.items()),
        TORQUER_SCALE.effect(s, found.error(-k * windows["mean"])),
        CURRENT_OFFSET.effect(s, found.error(-k)),
        *(
            RECORDED.of(cause=n, words=n.replace("_", " ")).effect(s, found.error(dX=found.X * one[j]))
            for j, n in enumerate(causes, 1)
        ),
    ]


def _rate(t0: Array, t1: Array, mean: Array) -> Array:
    """Return the mean rate (n,) over windows that follow one another of what has the means ``mean`` over them."""
    edges, length = np.append(t0[:1], t1), t1 - t0
    integral = CubicSpline(edges, np.concatenate([[0.0], np.cumsum(mean * length)]))
    return np.asarray(np.diff(integral(edges, 1)) / np.diff(edges))
