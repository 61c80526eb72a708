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
from gyrobench.reduction.drift.pulses import Windows, sources
from gyrobench.reduction.estimation.effects import Effect, one_by_one
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import LATITUDE, Source

from . import model, positions

SMALL = 1e-5  # rad
STATED = "positive where the stated one is too large"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def turned(axis: str, angle: float, numbers: tuple[int, ...]) -> dict[int, Array]:
    """Attitudes with the gyro turned by ``angle`` (rad) about its own ``axis`` in the positions ``numbers``."""
    R = frames.rotation(AXES[axis], angle)
    return {n: R.T @ positions.ATTITUDES[n] for n in numbers}


def attitude_error(
    channel: str, setup: model.Setup, found: Findings, lin: model.Linear, position: NDArray[np.int_],
    attitudes: dict[int, Array],
) -> Array:  # fmt: skip
    """What the data (n,) are wrong by when the positions were ``attitudes`` and the nominal ones are believed."""
    believed = model.directions(position, setup.latitude)
    real = model.directions(position, setup.latitude, attitudes)
    # y = w - k I is formed with the believed w while k I = w_real - drift_real
    dw = model.rate(channel, real, setup.earth_rate) - model.rate(channel, believed, setup.earth_rate)
    D = model.drift_columns(channel, real, setup.terms) - model.drift_columns(channel, believed, setup.terms)
    return found.error(D @ lin.start - dw)


def own_sources(channel: str) -> tuple[str, ...]:
    """Zero, resolution, nonlinearity and pulses of the current about ``channel``, which the other channel lacks."""
    meter = f"of the {channel} current meter"
    own = (f"zero {meter}", f"resolution {meter}", f"nonlinearity of the torquer about {channel}")
    return (*own, *sources(channel))


def effects(
    channel: str, setup: model.Setup, found: Findings, lin: model.Linear, readings: Windows, position: NDArray[np.int_]
) -> list[Effect]:
    """All sources with their sensitivities for one current (A); sizes come from ``setup`` and may be 0."""
    current, pulses = readings.mean, setup.pulses.get(channel)

    every = tuple(positions.ATTITUDES)
    turns = {a: attitude_error(channel, setup, found, lin, position, turned(a, SMALL, every)) / SMALL for a in AXES}
    alone = np.vstack([one_by_one(turn, position) for turn in turns.values()])
    step = replace(setup, latitude=setup.latitude + SMALL)
    d0, d1 = (model.directions(position, s.latitude) for s in (setup, step))
    dw = model.rate(channel, d1, setup.earth_rate) - model.rate(channel, d0, setup.earth_rate)
    full = float(np.max(np.abs(current))) or 1.0
    offset = found.error(-lin.k0)
    quantum = setup.quantum.get(channel, 0.0) / math.sqrt(12.0)
    zero, resolution, nonlinearity, *_ = own_sources(channel)
    return [
        Source("attitude_of_each_position", "attitude of each position", "rad", "u_attitude").effect(
            setup,
            alone,
            note="about each axis, the positions independent of one another",
            parts=tuple(f"position {n} about {axis}" for axis in AXES for n in np.unique(position)),
        ),
        *(
            Source(
                f"gyro_turned_about_its_axis:{axis}",
                f"gyro turned about its {axis} axis in the fixture",
                "rad",
                "u_mount",
            ).effect(setup, turns[axis])
            for axis in AXES
        ),
        LATITUDE.effect(setup, found.error(dw) / SMALL),
        Source("?", zero, "A", "u_current").effect(setup, offset),
        Source("?", resolution, "A").effect(quantum, offset, note="as if never dithered"),
        Source("?", nonlinearity, "1", "u_nonlinearity").effect(
            setup,
            found.error(-lin.k0 * current * np.abs(current) / full),
            note=f"relative departure from proportionality at {full * 1e3:.3g} mA",
        ),
        *(pulses.effects(found, lin.k0, readings, setup.u_pulse, setup.u_switching, channel) if pulses else ()),
    ]
