"""Budget of the multi-position test: what errors of head, mount, meter and gravity do to the data, to first order.

With the axis of the head (table axis z) up by delta, and the accelerometer turned about its axes by small angles,

    Y = gamma delta in mount a, Z = gamma delta in mount b, 0 else
    about x:  Y + r Z, Z - r Y        about y:  X - r Z, Z + r X        about z:  X + r Y, Y - r X

(X, Y, Z) = -f/g0 change the terms k4 X Y and k5 X Z; a turn about the axis of the head is theta_0 besides, which is
estimated, and one across it changes X in second order only.  [ACC; derived]
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.setup.sources import Effect
from gyrobench.units import ARCSEC

from . import closed, sources
from .geometry import specific_force
from .model import MultipointSetup, Polynomial, Visits

STEP = 1e-4
LEVEL_SLOPE = 1e-3  # of the largest: a position where the data do not change with the angle shows no error of it
STATIONS = "station"  # kind of the candidate
UNSTATED = (
    "errors of the head's positions are the same wherever a position comes back (the other mount, another turn); they "
    "are not in u, and this plan does not show their size. State u_angle, take more positions or declare type_b = none."
)


def places(v: Visits, slopes: Array) -> list[Candidate]:
    """Return the errors of positions that come back as constants that scatter: of a position the data of both mounts,
    and of all turns, are off by the same angle; none where each is visited once.  slopes (n,): of the data per rad.
    """
    stations, at, visited = np.unique(_stations(v.angle), return_inverse=True, return_counts=True)
    if not np.any(visited > 1):
        return []
    columns = np.where(at[:, None] == np.arange(stations.size), slopes[:, None], 0.0)
    columns = columns[:, np.abs(columns).max(axis=0) > LEVEL_SLOPE * np.abs(slopes).max()]
    meaning = "standard deviation of the head's positions, the same in each turn and mount"
    return [Candidate("σ_position", meaning, "″", ARCSEC, columns, scatter=True, kind=STATIONS)]


def effects(
    found: Findings, model: Polynomial, v: Visits, zeros: Mapping[str, float], k: Array, s: MultipointSetup
) -> list[Effect]:
    """Return all sources with their sensitivities; sizes come from ``s`` and may be 0.  k: coefficients of the model's
    terms; what a mount alone or four positions do not see is taken as 0.
    """
    terms = len(model.terms)
    stretched = np.zeros_like(found.X)
    stretched[:, :terms] = (
        model.columns(v, zeros, s.gamma * (1.0 + STEP)) - model.columns(v, zeros, s.gamma * (1.0 - STEP))
    ) / (2.0 * STEP * s.gravity)
    slope = found.X[:, terms:].sum(axis=1)  # of the data per rad of angle
    offset = found.error(s.scale / G0)
    stations, at = np.unique(_stations(v.angle), return_inverse=True)
    alone = np.array([found.error(np.where(at == p, slope, 0.0)) for p in range(stations.size)])
    axis, turned = _mounted(model, v, zeros, k, s.gamma, slope)
    weighed = any(c.kind == STATIONS for c in found.candidates)
    needed = "" if weighed or s.places_stated or not places(v, slope) else UNSTATED
    of_head = "of the readings of the head"

    def misread(n: int) -> Array:  # the head stands short of what it reads
        return np.array([found.error(-slope * f(n * v.angle)) for f in (np.sin, np.cos)])

    return [
        sources.SCALE.effect(s, found.error(v.y)),
        sources.ZERO.effect(s, offset),
        sources.RESOLUTION.effect(s.quantum / math.sqrt(12.0), offset),
        sources.GRAVITY.effect(s, found.error(dX=stretched)),
        sources.PLACES.effect(s, alone, parts=tuple(f"{x:g}°" for x in stations.tolist()), needed=needed),
        sources.ANGLE_ONCE.effect(s, misread(1), note=of_head),
        sources.ANGLE_TWICE.effect(s, misread(2), note=of_head),
        sources.AXIS.effect(s, found.error(axis)),
        *(
            sources.TURNED.of(k=str(n), axis=name).effect(s, found.error(row))
            for n, (name, row) in enumerate(zip(("input", "output", "pendulum"), turned, strict=True), 1)
        ),
    ]


def _stations(angle: Array) -> Array:
    """Return the positions (n,) within a turn, degrees, neighbours to closed.EQUAL the same."""
    step = 10.0 * closed.EQUAL
    turn: Array = np.mod(angle + closed.EQUAL, 2.0 * math.pi)
    return np.asarray(np.round(np.rint(turn / step) * math.degrees(step), 2))


def _mounted(
    model: Polynomial, v: Visits, zeros: Mapping[str, float], k: Array, gamma: float, slope: Array
) -> tuple[Array, Array]:
    """Return what the data are wrong by per rad of the axis above the horizon (n,), and of the accelerometer turned
    about each of its axes (3, n).
    """
    of = dict(zip(model.terms, k.tolist(), strict=True))
    k4, k5 = of.get("k4", 0.0), of.get("k5", 0.0)
    axis, turned = np.zeros_like(v.y), np.zeros((3, v.y.size))
    for m in model.mounts:
        mine = v.mount == m
        X, Y, Z = specific_force(m, v.angle[mine] + zeros[m], gamma)
        across, own = (k4, 2) if m == "a" else (k5, 1)  # own: the axis across the head that lies in the plane of X
        axis[mine] = across * gamma * X
        turned[0, mine] = k4 * X * Z - k5 * X * Y
        # about the axis that lies along the axis of the head: the angle; about the other, X and it share the plane
        turned[own, mine] = (-k4 if m == "a" else k5) * X**2
        sense = -1.0  # both axes lie against the axis of the head: a turn about them is one back
        turned[3 - own, mine] = sense * slope[mine]
    return axis, turned
