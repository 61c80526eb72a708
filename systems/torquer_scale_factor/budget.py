"""Budget of a run of the torquer test: what ammeter, encoder, axes and time base do to its rates, to first order.

    theta' = K i + omega_d - omega_E (p . I) + noise,       p . I = u + r cos theta + s sin theta

with the table axis leaning by u towards the pole p, the input axis by r towards the output axis (on the pole at angle
0) and by s towards the spin axis, which the table turns with it.  Both senses see the same Earth rate, so it is a
drift; an encoder that is off by e(theta) gives e(theta_2) - e(theta_1) over an angle that both senses turn, which is in
the scale factor: 30 arcsec once a turn are up to 1.5e-4 of it over 10 degrees.  [TEST-TORQUER; derived]

Not in the budget: e in the polynomial of the drift over the angle, second order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift.channels import errors_in
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.setups import Setup

from .sources import AMMETER, ZERO


@dataclass(frozen=True, kw_only=True)
class TorquerSetup(Setup):
    """u_current, u_time: relative; of a table of rates these two count alone.  truth: printed name -> value in the
    printed unit.  channel: along the table axis, of a two-degree-of-freedom gyro.
    """

    channel: str = ""
    earth_rate: float = frames.EARTH_RATE

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        made = super().of(run, channel=str(run.options.get("channel", "")), **own)
        return replace(made, errors=errors_in(made.errors, made.channel))


def effects(found: Findings, currents: int, start: Array, end: Array, setup: TorquerSetup) -> Sequence[sources.Effect]:
    """Return all sources of a fit to windows; start, end (n,): table angle, rad.

    currents: their number; the first columns of the fit are the current of each, then the constant of each.
    """
    length = found.t_end - found.t_start

    def mean(integral: Array) -> Array:
        return integral / np.where(end == start, 1.0, end - start)

    def read(n: int) -> Array:  # an encoder that reads too much by sin n theta, and by cos n theta
        return np.array([found.error((f(n * end) - f(n * start)) / length) for f in (np.sin, np.cos)])

    def design(columns: slice, source: slice) -> Array:
        dX = np.zeros_like(found.X)
        dX[:, columns] = found.X[:, source]
        return found.error(dX=dX)

    K, constant = slice(0, currents), slice(currents, 2 * currents)
    along_o, along_s = mean(np.sin(end) - np.sin(start)), mean(np.cos(start) - np.cos(end))
    return [
        AMMETER.effect(setup, design(K, K)),
        ZERO.effect(setup, design(K, constant)),
        sources.ANGLE_ONCE.effect(setup, read(1)),
        sources.ANGLE_TWICE.effect(setup, read(2)),
        sources.AXIS_LEVEL_POLE.effect(setup, found.error(-setup.earth_rate)),
        sources.INPUT_TO_OUTPUT.effect(setup, found.error(-setup.earth_rate * along_o)),
        sources.INPUT_TO_SPIN.effect(setup, found.error(setup.earth_rate * along_s)),
        sources.TIME_BASE.effect(setup, found.error(-found.y), note="relative, seconds read too long"),
    ]
