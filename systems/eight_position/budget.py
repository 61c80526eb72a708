"""Type B uncertainties of the eight positions: each source's effect on every coefficient, by perturbing the model.

An attitude error turns the gyro by a small angle about one of its axes in one position (independent: the squares of
the eight add up; an error of the index head is one of them) or in all of them (mount).  Largest: W eps, 7.3e-4 deg/h
for 10 arcsec.  A latitude stated too large by delta changes k by -tan(latitude) delta relative.  Not modelled: products
of gravity components that an attitude error lets in (D_xy eps and the like), drift of the meters.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.reduction.drift.drift_terms import torquer_sources
from gyrobench.reduction.drift.pulses import Windows
from gyrobench.reduction.estimation.effects import Effect, one_by_one
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import LATITUDE, TURNED, Source

from . import model, positions

SMALL = 1e-5  # rad
ATTITUDE = Source(
    "position.attitude", "attitude of each position", "rad", "u_attitude",
    "about each axis, the positions independent of one another",
)  # fmt: skip
IN_FIXTURE = {n: replace(TURNED[n], name=f"{TURNED[n].name} in the fixture") for n in "xyz"}


def turned(axis: str, angle: float, numbers: tuple[int, ...]) -> dict[int, Array]:
    """Return attitudes with the gyro turned by ``angle`` (rad) about its own ``axis`` in the positions ``numbers``."""
    R = frames.rotation(np.eye(3)["xyz".index(axis)], angle)
    return {n: R.T @ positions.ATTITUDES[n] for n in numbers}


def attitude_error(
    channel: str, setup: model.EightPositionSetup, found: Findings, lin: model.Linear, position: NDArray[np.int_],
    attitudes: dict[int, Array],
) -> Array:  # fmt: skip
    """Return the error of the data (n,) when the positions were ``attitudes`` and the nominal ones are believed."""
    believed = model.directions(position, setup.latitude)
    real = model.directions(position, setup.latitude, attitudes)
    # y = w - k I is formed with the believed w while k I = w_real - drift_real
    dw = model.rate(channel, real, setup.earth_rate) - model.rate(channel, believed, setup.earth_rate)
    D = model.drift_columns(channel, real, setup.terms) - model.drift_columns(channel, believed, setup.terms)
    return found.error(D @ lin.start - dw)


def effects(
    channel: str, setup: model.EightPositionSetup, found: Findings, lin: model.Linear, readings: Windows,
    position: NDArray[np.int_],
) -> list[Effect]:  # fmt: skip
    """Return all sources with their sensitivities for one current (A); sizes come from ``setup`` and may be 0."""
    current, pulses, every = readings.mean, setup.pulses.get(channel), tuple(positions.ATTITUDES)
    turns = {a: attitude_error(channel, setup, found, lin, position, turned(a, SMALL, every)) / SMALL for a in "xyz"}
    d0, d1 = (model.directions(position, x) for x in (setup.latitude, setup.latitude + SMALL))
    dw = model.rate(channel, d1, setup.earth_rate) - model.rate(channel, d0, setup.earth_rate)
    full = float(np.max(np.abs(current))) or 1.0
    offset = found.error(-lin.k0)
    _, nonlinearity, zero, resolution = torquer_sources(channel, f"{full * 1e3:.3g} mA")  # the scale factor is a result
    parts = tuple(f"position {n} about {axis}" for axis in turns for n in np.unique(position))
    return [
        ATTITUDE.effect(setup, np.vstack([one_by_one(turn, position) for turn in turns.values()]), parts=parts),
        *(IN_FIXTURE[axis].effect(setup, turn) for axis, turn in turns.items()),
        LATITUDE.effect(setup, found.error(dw) / SMALL),
        zero.effect(setup, offset),
        resolution.effect(setup.quantum.get(channel, 0.0) / math.sqrt(12.0), offset),
        nonlinearity.effect(setup, found.error(-lin.k0 * current * np.abs(current) / full)),
        *(pulses.effects(found, lin.k0, readings, setup, channel) if pulses else ()),
    ]
