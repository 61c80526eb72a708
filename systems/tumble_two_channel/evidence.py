"""Beside the coefficients of the two-channel tumble: plots, tests of harmonics and turns, terms left out, budget."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.drift import pulses, window_regressors
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.setup.sources import (
    ANGLE_ONCE,
    ANGLE_TWICE,
    AXIS_POLE_EAST,
    AXIS_POLE_NORMAL,
    TURNED,
    WOBBLE,
    Source,
)
from gyrobench.result import Table
from gyrobench.units import DPH

from . import geometry
from .setup import OTHER, TwoChannelSetup, design

SMALL = 1e-5  # rad, step of the geometric perturbations (they are linear to 1e-10)


def groups(s: TwoChannelSetup, c: str, phase: Array, t: window_regressors.Turning, X: Array) -> list[Group]:
    out = []
    for p in s.faces:
        rows = np.flatnonzero(phase == p)
        if not s.turns(p):
            x = (t.t_start[rows] + t.t_end[rows]) / 2.0 - t.t_start[rows][0]
            out.append(Group(s.label(p), rows, x, "time in the dwell", "s"))
            continue
        x = np.degrees(np.mod((t.angle_start[rows] + t.angle_end[rows]) / 2.0, 2.0 * math.pi))
        angle = np.radians(np.arange(0.0, 361.0, 3.0))
        face = np.broadcast_to(np.asarray(s.faces[p], dtype=float), (angle.size, 3, 3))
        curve = design(s, c, window_regressors.Turning(angle, angle, np.zeros_like(angle), np.ones_like(angle), face))
        if s.tilt:
            curve[:, -1] = float(np.mean(X[rows, -1]))  # the table turns, the plotted one does not
        out.append(Group(s.label(p), rows, x, "table angle", "°", (np.degrees(angle), curve)))
    return out


def turns(s: TwoChannelSetup, found: Findings, phase: Array, t: window_regressors.Turning) -> Turns:
    """Tests of the harmonics that the model does not hold and of turn against turn, over theta = -angle."""
    phases = [(s.label(p), phase == p) for p in s.faces if s.turns(p)]
    out = Turns(found, phases, -t.angle_start, -t.angle_end, 1 if s.model == "simple" else 2)
    out.test()
    return out


def left_out(
    s: TwoChannelSetup, c: str, found: Findings, turning: window_regressors.Turning
) -> tuple[list[dict[str, Any]], list[str]]:
    """What simulated terms outside the model do to the coefficients: a table and a warning."""
    names = s.names(c)
    into = geometry.FOLD[c][0]
    extra = [n for n in drift.NAMES_2DOF[c] if n not in names and (s.truth or {}).get(n, 0.0) != 0.0]
    if s.model == "nine":
        extra = [n for n in extra if n != into]
    if not extra:
        return [], []
    assert s.truth is not None
    more = window_regressors.regressors(turning, s.base, s.gravity, tuple(extra)) @ np.array(
        [s.truth[n] for n in extra]
    )
    shift = found.gain @ more / DPH
    rows = [[q.title, float(v), q.unit] for q, v in zip(found.quantities, shift, strict=True)]
    caption = f"Predicted shift by {', '.join(extra)}, which are simulated and outside the model; likeliest noise model"
    table = Table("terms_left_out", "Terms left out", caption, ["coefficient", "shift", "unit"], rows)
    return [table], [
        f"{', '.join(extra)} is simulated but not in the {s.model} model: the others are shifted as the table says."
    ]


def own_sources(c: str) -> tuple[str, ...]:
    """Scale factor and nonlinearity of the torquer that measures a channel, zero and resolution of its current, pulses
    of its loop.
    """
    torquer, meter = f"of the torquer about {OTHER[c]}", f"of the {OTHER[c]} current meter"
    own = (f"scale factor {torquer}", f"nonlinearity {torquer}", f"zero {meter}", f"resolution {meter}")
    return (*own, *pulses.sources(OTHER[c]))


def effects(
    s: TwoChannelSetup, c: str, found: Findings, turning: window_regressors.Turning, readings: pulses.Windows
) -> list[Effect]:
    current, counted = readings.mean, s.pulses.get(OTHER[c])
    axis = geometry.AXIS[c]
    X, rate = found.X, window_regressors.axis_rate(turning, s.base, s.latitude, s.earth_rate, axis)

    def geometric(base: Array, turned: window_regressors.Turning) -> Array:
        dX = design(s, c, turned, base) - X
        drate = window_regressors.axis_rate(turned, base, s.latitude, s.earth_rate, axis) - rate
        return found.error(drate, dX) / SMALL

    def tilted(direction: Array) -> Array:
        # the reduction believes the axis to be where it is not
        return -geometric(s.base @ frames.rotation(direction, SMALL).T, turning)

    def mounted(direction: Array) -> Array:
        return geometric(s.base, replace(turning, face=frames.rotation(direction, SMALL) @ turning.face))

    def angles(n: int) -> Array:  # an encoder that reads too much by sin n theta, and by cos n theta
        return np.array([geometric(s.base, wrong) for wrong in window_regressors.misread(turning, n, SMALL)])

    def wobbling() -> Array:
        names = geometry.terms(s.model, c)
        errors = []
        for rates, dX in window_regressors.wobbles(turning, s.base, s.site, names, SMALL):
            believed = np.column_stack([dX, rates[:, 2]]) if s.tilt else dX
            errors.append(found.error(-rates[:, axis], believed))
        return np.array(errors)

    k, full = s.k[OTHER[c]], float(np.max(np.abs(current))) or 1.0
    quantum = s.quantum.get(OTHER[c], 0.0)
    one = np.ones_like(current)
    scale_factor, nonlinearity, zero, resolution, *_ = own_sources(c)
    return [
        AXIS_POLE_EAST.effect(s, tilted(s.base[0])),
        AXIS_POLE_NORMAL.effect(s, tilted(s.base[1])),
        *(TURNED[n].effect(s, mounted(d)) for n, d in zip("xyz", np.eye(3), strict=True)),
        WOBBLE.effect(s, wobbling()),
        ANGLE_ONCE.effect(s, angles(1)),
        ANGLE_TWICE.effect(s, angles(2)),
        Source("?", scale_factor, "1", "u_scale_factor").effect(
            s, found.error(-k * current), note="relative, positive where the stated one is too large"
        ),
        Source("?", nonlinearity, "1", "u_nonlinearity").effect(
            s,
            found.error(-k * current * np.abs(current) / full),
            note=f"relative departure from proportionality at {full * 1e3:.3g} mA",
        ),
        Source("?", zero, "A", "u_current").effect(s, found.error(-k * one)),
        Source("?", resolution, "A").effect(quantum / 12.0**0.5, found.error(-k * one), note="as if never dithered"),
        *(counted.effects(found, k, readings, s.u_pulse, s.u_switching, OTHER[c]) if counted else ()),
    ]
