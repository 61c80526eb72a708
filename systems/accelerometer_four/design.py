"""The test as choices of the number of positions, each with its dwell."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import geometry

POINTS = range(16, 25)


def _options(points: int, turns: int, length: float) -> Mapping[str, Any]:
    return {"points": points, "turns": turns, "dwell": format_time(length)}


def protocol_of(system: System, record: Record) -> OptionProtocol:
    """Return 16 to 24 positions, once round; the length is the dwell.  The reduction wants whole turns.

    Fewer positions determine fewer harmonics of the head: with n of them harmonic k is told from n - k by nothing.
    """
    p, own = record.run.parameters, (int(system["points"]), int(system["turns"]))
    each = [own, *((n, 1) for n in POINTS if (n, 1) != own)]
    choices = [
        Choice(f"{n} positions" if t == 1 else f"{n} positions, {t} turns", functools.partial(_options, n, t),
               float(system["dwell"]), 0.5)
        for n, t in each
    ]  # fmt: skip
    gamma = Location.of(record.run).gravity / G0
    white = np.array([float(p[f"accelerometer_{i}.white"]) for i in geometry.SENSORS])
    scale = np.array([float(p[f"accelerometer_{i}.K_I"]) for i in geometry.SENSORS])
    names = tuple(f"{k},{i}" for i in geometry.SENSORS for k in geometry.TERMS)

    def covariances(fits: Sequence[Findings], record: Record) -> list[Array]:
        """Return white noise of each sensor, and the repeatability of the head, one angle error for all four."""
        w = record.windows
        alpha, dwell = np.asarray(w["angle_start"], dtype=float), np.asarray(w["t_end"] - w["t_start"], dtype=float)
        V = np.diag(np.concatenate([n**2 / dwell for n in white]))
        tangent = [k * gamma * geometry.axes(i, alpha)[1] for k, i in zip(scale, geometry.SENSORS, strict=True)]
        common = np.vstack([np.diag(t) for t in tangent]) * float(p["table.repeat"])
        return [V + common @ common.T]

    unseen = ["third order", "harmonics of the head beyond half the number of positions, and its first"]
    return OptionProtocol(tuple(choices), covariances, names, tuple(unseen))
