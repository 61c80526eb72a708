"""The record of an alignment as columns, with the true attitude of a simulated platform."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.setup.window_checks import ReductionError

from . import plans

ARCMIN, ARCSEC, DEG = units.factor("arcmin"), units.factor("arcsec"), math.pi / 180.0
K = uncertainty.NORMAL


@dataclass(frozen=True)
class Run:
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
        d = self.psi - self.true
        return np.asarray(d - 2.0 * np.pi * np.floor(d / (2.0 * np.pi) + 0.5))

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


def read(record: Record) -> Run:
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
    return Run(
        np.asarray(c["time"], dtype=float), mode, status, ready, psi, sigma, columns("controller.tilt", 2),
        columns("controller.sigma_tilt", 2), true, lean,
    )  # fmt: skip
