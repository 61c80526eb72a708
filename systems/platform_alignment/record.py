"""The record of an alignment: its columns, the true attitude of a simulated platform, the error model beside it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.loops.loop_measures import wrapped
from gyrobench.reduction.setup.window_checks import ReductionError

from . import plans

K = uncertainty.NORMAL
#: parameters of the controller: settings, and errors of its sensors
SET = (
    "latitude", "gravity", "earth_rate", "positions", "coarse_time", "order", "damping", "level_frequency",
    "fast_frequency", "fast_time", "slow_frequency", "rate_max",
)  # fmt: skip
TOLD = ("bias", "markov", "white", "accelerometer", "force", "tau", "latitude", "scale")


@dataclass(frozen=True)
class AlignmentColumns:
    """What a record holds, as columns over time; true, lean: true heading, true tilt about x and y."""

    t: Array
    mode: Array
    status: Array
    ready: Array
    psi: Array
    sigma: Array
    tilt: Array
    sigma_tilt: Array
    true: Array
    lean: Array

    @property
    def error(self) -> Array:
        return wrapped(self.psi - self.true)

    @property
    def north(self) -> int | None:
        """Return the first row at which the turn to north is over, None where it was not."""
        at = (self.mode >= plans.TO_NORTH) & (np.abs(self.psi) < 1e-9)
        return int(np.argmax(at)) if at.any() else None

    def first(self, stage: int) -> int | None:
        """Return the first row of a stage, None where it was not reached."""
        at = self.mode >= stage
        return int(np.argmax(at)) if at.any() else None


def attitude(theta: Array, tilt: Array) -> tuple[Array, Array]:
    """Return heading (n,) of the axis y and tilt (n, 2) about x and y of the element.

    theta: (n, 3) joint angles pitch, roll, azimuth; tilt: (n, 3) small rotation of the base against east, north, up.
    C = R3(azimuth) R1(pitch) R2(roll) (1 - [tilt x]); a level element has C z = (0, 0, 1).
    """
    p, r, a = theta.T
    cp, sp, cr, sr, ca, sa = np.cos(p), np.sin(p), np.cos(r), np.sin(r), np.cos(a), np.sin(a)
    one = np.ones_like(p)
    zero = 0.0 * p
    R2 = np.array([[cr, zero, -sr], [zero, one, zero], [sr, zero, cr]])
    R1 = np.array([[one, zero, zero], [zero, cp, sp], [zero, -sp, cp]])
    R3 = np.array([[ca, sa, zero], [-sa, ca, zero], [zero, zero, one]])
    e, n, u = tilt.T
    base = np.array([[one, u, -n], [-u, one, e], [n, -e, one]])  # 1 - [tilt x]
    C = np.einsum("ijn,jkn,kln,lmn->imn", R3, R1, R2, base)
    return np.arctan2(C[1, 0], C[1, 1]), np.column_stack([C[1, 2], -C[0, 2]])


def read(record: Record) -> AlignmentColumns:
    """Return the columns of a record.  Raises ReductionError where one is missing."""
    c = record.channels
    names = ("controller.heading", "controller.sigma", "controller.mode", "controller.status", "controller.ready")
    missing = [n for n in (*names, "platform.theta[1]", "controller.tilt[1]", "controller.sigma_tilt[1]") if n not in c]
    if missing:
        raise ReductionError(f"the record has no channel {', '.join(missing)}: the system must record it")

    def columns(name: str, n: int) -> Array:
        return np.column_stack([np.asarray(c[f"{name}[{k}]"], dtype=float) for k in range(1, n + 1)])

    theta = columns("platform.theta", 3)
    tilt = columns("site.tilt", 3) if "site.tilt[1]" in c else np.zeros_like(theta)
    true, lean = attitude(theta, tilt)
    psi, sigma, mode, status, ready = (np.asarray(c[n], dtype=float) for n in names)
    return AlignmentColumns(
        np.asarray(c["time"], dtype=float), mode, status, ready, psi, sigma, columns("controller.tilt", 2),
        columns("controller.sigma_tilt", 2), true, lean,
    )  # fmt: skip


class Alignment:
    """A record with its columns, what the controller was set to and told of its sensors, and the error model.

    Raises ReductionError where a column is missing.
    """

    def __init__(self, record: Record) -> None:
        self.record, self.run = record, read(record)
        p = record.run.parameters
        known: dict[str, Any] = {n: float(p[f"controller.{n}"]) for n in SET if f"controller.{n}" in p}
        known |= {n: int(known[n]) for n in ("positions", "order") if n in known}
        self.settings = plans.Settings(**{"latitude": float(record.run.options["latitude"]), **known})
        errors = {name: float(p[f"controller.errors_{name}"]) for name in TOLD if f"controller.errors_{name}" in p}
        self.sensors = replace(plans.GRADES["navigation"], **errors)
        #: rms velocity of the base that the controller is told of, m/s
        self.shaken = float(p.get("controller.errors_vibration", 0.0))
        self.fine = self.run.first(plans.FAST)  # first row of the gyrocompass

    @cached_property
    def history(self) -> plans.History:
        """Return the error model along this run: its levelling time and its coarse heading."""
        run, first, north = self.run, self.run.first(plans.COARSE), self.run.first(plans.TO_NORTH)
        assert first is not None and north is not None
        psi = float(run.psi[north]) + (math.pi if self.settings.positions == 2 else 0.0)
        settings = replace(self.settings, level=max(float(run.t[first]), 1.0))
        return plans.history(settings, math.remainder(psi, 2.0 * math.pi), float(run.t[-1]), self.sensors.tau)

    @cached_property
    def sigma(self) -> Array:
        """Return the standard deviation of the heading by the error model, at the instants of its history."""
        return self.history.sigma(self.settings, self.sensors)[:, 2]
