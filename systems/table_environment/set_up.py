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
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.run_metadata import Site
from gyrobench.reduction.setup.sources import CURRENT_OFFSET, TORQUER_SCALE, TURNED, Source

STATED = "relative, positive where the stated one is too large"


def effects(
    found: Findings, windows: Mapping[str, Array], k: float, site: Site, scales: Sequence[str],
    sizes: Mapping[str, float],
) -> list[Effect]:  # fmt: skip
    """Return all sources; sizes: u_mount (rad), u_scale_factor (1), u_current (A), u_scales (1).

    scales: names of the recorded causes, in the order of the columns of the fit, which follow its constant and s_rate,
    s_E, s_N among them.
    """
    tilt_east, tilt_north = (np.asarray(windows[n], dtype=float) for n in ("tilt_east", "tilt_north"))
    s_E, s_N = (float(found.est.beta[1 + scales.index(n)]) for n in ("tilt_east", "tilt_north"))
    w, middle = site.earth_rate, (found.t_start + found.t_end) / 2.0
    north, up = w * math.cos(site.latitude), w * math.sin(site.latitude)
    turning = _rate(found.t_start, found.t_end, tilt_north)
    turned = {
        "input": np.full_like(middle, s_E),
        "output": -(north + tilt_east * up + turning) + s_E * tilt_north - s_N * tilt_east,
        "spin": -(up - tilt_east * north) - s_N,
    }

    def scaled(column: int) -> Array:
        dX = np.zeros_like(found.X)
        dX[:, column] = found.X[:, column]
        return found.error(dX=dX)

    words = {n: n.replace("_", " ") for n in scales}
    return [
        *(TURNED[n].effect(sizes, found.error(e)) for n, e in turned.items()),
        TORQUER_SCALE.effect(sizes, found.error(-k * windows["mean"]), note=STATED),
        CURRENT_OFFSET.effect(sizes, found.error(-k)),
        *(
            Source(f"scale_of_the:{words[n]}", f"scale of the {words[n]}", "1", "u_scales").effect(
                sizes, scaled(j), note="relative, what is recorded"
            )
            for j, n in enumerate(scales, 1)
        ),
    ]


def _rate(t0: Array, t1: Array, mean: Array) -> Array:
    """Return the mean rate (n,) over windows that follow one another of what has the means ``mean`` over them."""
    edges, length = np.append(t0[:1], t1), t1 - t0
    integral = CubicSpline(edges, np.concatenate([[0.0], np.cumsum(mean * length)]))
    out: Array = np.diff(integral(edges, 1)) / np.diff(edges)
    return out
