"""The test as candidates of a plan: 24 stations of the head in two mounts, rows of the reduction's linearized model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench.design.visit_protocol import Channel, DataNoise, VisitProtocol, phases_of
from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import geometry
from .model import Polynomial, Visits

TURN = 2.0 * math.pi
STATIONS = 24


def protocol_of(system: System, record: Record) -> VisitProtocol:
    """Return the candidates: the stations of the head in mount a, then in mount b, where the system's plan has both.

    The repeatability of the head is an error of a whole visit, its slope times the angle.  Not in the model: the error
    of a station that comes back each turn (u_angle of the reduction), scale factor of the meter.
    """
    p = record.run.parameters
    phases = phases_of(system)
    mounts = sorted({f.face for f in phases})
    mount = np.repeat(np.array(mounts), STATIONS)
    angle = np.tile(np.arange(STATIONS) * TURN / STATIONS, len(mounts))
    zeros = {m: geometry.zero_angle(m, p["accelerometer.mount"]) for m in mounts}
    model, gamma = Polynomial(mounts, False), Location.of(record.run).gravity / G0
    k = np.array([float(p[f"accelerometer.{n}"]) for n in model.terms])
    v = Visits(mount, angle, angle, angle, np.zeros_like(angle), math.nan)
    slopes = model.slopes(v, zeros, gamma, k)
    white = math.hypot(
        float(p["accelerometer.white"]) / G0, float(p["accelerometer.meter"]) * p["accelerometer.scale"] / G0
    )
    noise = DataNoise(white, float(p["accelerometer.markov"]) / G0, float(p["accelerometer.markov_tau"]))
    channel = Channel(
        tuple(model.names),
        np.column_stack([model.columns(v, zeros, gamma), slopes]),
        np.eye(len(model.names)),
        noise,
        repeat=np.abs(slopes.sum(axis=1)) * float(p["table.repeat"]),
    )
    labels = tuple(f"mount {m}, {360.0 * (j % STATIONS) / STATIONS:g}°" for j, m in enumerate(mount))
    rate = float(p["table.index_rate"])

    def move(before: int | None, after: int) -> float:
        here = 0.0 if before is None else angle[before]
        return 1.5 * abs(math.remainder(float(angle[after] - here), TURN)) / rate

    def options(visits: Sequence[tuple[int, float]]) -> dict[str, Any]:
        each = [f"{mount[j]} {math.degrees(angle[j]):g}deg {format_time(t)}" for j, t in visits]
        return {"visits": "; ".join(each)}

    def station(face: str, target: float) -> int:
        return mounts.index(face) * STATIONS + round(target * STATIONS / TURN) % STATIONS

    unseen = ["θ₀ holds the zero of the head and the error of the input axis together"]
    if float(p.get("accelerometer.turn_on", 0.0)):
        unseen.append("a bias of the turn-on is in k0 and not in its u")
    return VisitProtocol(
        labels, (channel,), move, float(system["settle"]), options,
        tuple((station(f.face, f.target), f.dwell) for f in phases), unseen=tuple(unseen),
    )  # fmt: skip
