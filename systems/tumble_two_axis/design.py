"""The test as candidates of a plan: positions of both table axes, rows of the reduction's regression."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.design.visit_protocol import Channel, VisitProtocol, gyro_noise, gyro_unseen, phases_of
from gyrobench.record.record import Record
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import geometry

TURN = 2.0 * math.pi
STEPS = 24  # positions of each axis


def protocol_of(system: System, record: Record) -> VisitProtocol:
    """Return the candidates: every 15° of the outer and of the inner axis, and the positions of the system's plan.

    Most of the moving is the inner axis: it is the input axis, and the torquer follows its rate.
    """
    p, site = record.run.parameters, Location.of(record.run)
    outer, inner = (a.ravel() for a in np.meshgrid(*2 * [np.arange(STEPS) * TURN / STEPS], indexing="ij"))
    at = {
        (round(math.degrees(a), 3), round(math.degrees(b), 3)): j
        for j, (a, b) in enumerate(zip(outer, inner, strict=True))
    }
    book = []
    for f in phases_of(system):
        own = tuple(round(math.degrees(math.fmod(a, TURN)) % 360.0, 3) for a in (f.target, f.target_y))
        book.append((at.setdefault(own, len(at)), f.dwell))  # type: ignore[arg-type]
    angle = np.radians(np.array(list(at)))
    force = -geometry.attitude(site.latitude, angle[:, 0], angle[:, 1]) @ frames.U * site.gravity / frames.G0
    X = drift.regressors(force, geometry.NAMES)
    rate, acceleration = (np.asarray(p[f"table.{n}"], dtype=float) for n in ("index_rate", "acceleration"))

    def move(before: int | None, after: int) -> float:
        here = np.zeros(2) if before is None else angle[before]
        way = np.abs([math.remainder(float(x), TURN) for x in angle[after] - here])
        peak = np.minimum(rate, np.sqrt(way * acceleration))
        return float(np.max(np.where(way > 0.0, way / np.maximum(peak, 1e-12) + peak / acceleration, 0.0)))

    def options(visits: Sequence[tuple[int, float]]) -> dict[str, Any]:
        each = [(np.degrees(angle[j]), t) for j, t in visits]
        return {"visits": "; ".join(f"{a:.7g}deg {b:.7g}deg {format_time(t)}" for (a, b), t in each)}

    channel = Channel(geometry.NAMES, X, np.eye(len(geometry.NAMES)), gyro_noise(p))
    labels = tuple(f"{a:g}°, {b:g}°" for a, b in at)
    unseen = ["D_OO, which constant |g| folds into D_F, D_II and D_SS", *gyro_unseen(p)]
    return VisitProtocol(labels, (channel,), move, float(system["settle"]), options, tuple(book), unseen=tuple(unseen))
