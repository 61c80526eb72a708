"""Type B uncertainties of the tumble: each source's effect on every coefficient, by exact perturbation of the model.

A source changes what the reduction believes (geometry: regressors X and input-axis rate) or what it reads (current).
With gain G (estimates = G y) the change of the estimates is G (dy - dX a).  For the ideal geometry this gives the
known sensitivities: input axis tilted towards the output axis by eps: eps W sin(phi)/gamma in D_O and nothing else
[TUM1-SENS-IA]; table axis off the pole by delta: W delta/(gamma cos phi) in D_I or 2 W delta/(gamma^2 sin 2 phi) in
D_OS [TUM1-SENS-AXIS].  Not modelled: an independent tilt of each mount, wobble and encoder errors
of other orders, temperature.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.reduction.drift import pulses, window_regressors
from gyrobench.reduction.drift.drift_terms import torquer_effects
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import (
    ANGLE_ONCE,
    ANGLE_TWICE,
    AXIS_POLE_EAST,
    AXIS_POLE_NORMAL,
    INPUT_TO_OUTPUT,
    INPUT_TO_SPIN,
    TURNED,
    WOBBLE,
)

from .setup import TumbleSetup

TILT = "ε_IO"  # the tilt of the input axis towards the output axis as an unknown
TOWARDS_OUTPUT = INPUT_TO_OUTPUT
SMALL = 1e-5  # rad, step of the geometric perturbations (they are linear to 1e-10)


def design(
    setup: TumbleSetup, turning: window_regressors.Turning, names: tuple[str, ...], base: Array | None = None
) -> Array:
    """Window means (n, p) of the regressors ``names``; the column of :data:`TILT` is minus the rate along O,
    rad/s.
    """
    base = setup.base if base is None else base
    terms = tuple(n for n in names if n != TILT)
    X = window_regressors.regressors(turning, base, setup.gravity, terms)
    if TILT not in names:
        return X
    along = window_regressors.axis_rate(turning, base, setup.latitude, setup.earth_rate, 1)
    return np.column_stack([X, -along])


def effects(
    setup: TumbleSetup, turning: window_regressors.Turning, current: Array, spread: Array, found: Findings
) -> list[Effect]:
    """All sources with their sensitivities; sizes come from ``setup`` and may be 0.

    current, spread (n,): mean in A with the sign of the precession convention, standard deviation in a window.
    """
    names, X = found.est.names[: found.X.shape[1]], found.X
    rate = window_regressors.axis_rate(turning, setup.base, setup.latitude, setup.earth_rate)

    def geometry(base: Array, turned: window_regressors.Turning) -> Array:
        dX = design(setup, turned, names, base) - X
        drate = window_regressors.axis_rate(turned, base, setup.latitude, setup.earth_rate) - rate
        return found.error(drate, dX) / SMALL

    def axis(direction: Array) -> Array:
        # the reduction believes the axis to be where it is not
        return -geometry(setup.base @ frames.rotation(direction, SMALL).T, turning)

    def mount(direction: Array) -> Array:
        tilt = frames.rotation(direction, SMALL)
        return geometry(setup.base, replace(turning, face=tilt @ turning.face))

    def angles(n: int) -> Array:  # an encoder that reads too much by sin n theta, and by cos n theta
        return np.array([geometry(setup.base, wrong) for wrong in window_regressors.misread(turning, n, SMALL)])

    along_i, along_o, along_s = np.eye(3)
    windows = pulses.Windows(current, spread, turning.t_end - turning.t_start)
    return [
        AXIS_POLE_EAST.effect(setup, axis(setup.base[0])),
        AXIS_POLE_NORMAL.effect(setup, axis(setup.base[1])),
        TOWARDS_OUTPUT.effect(setup, mount(along_s)),
        INPUT_TO_SPIN.effect(setup, mount(-along_o)),
        TURNED["input"].effect(setup, mount(along_i)),
        WOBBLE.effect(setup, _wobble(setup, turning, found)),
        ANGLE_ONCE.effect(setup, angles(1)),
        ANGLE_TWICE.effect(setup, angles(2)),
        *torquer_effects(setup, found, setup.k, windows, setup.quantum, setup.pulses),
    ]


def _wobble(setup: TumbleSetup, turning: window_regressors.Turning, found: Findings) -> Array:
    """Errors (2, n) by a table axis that wobbles, at the phases 0 and 90 degrees, per rad."""
    names = found.est.names[: found.X.shape[1]]
    terms = tuple(n for n in names if n != TILT)
    errors = []
    for rate, dX in window_regressors.wobbles(turning, setup.base, setup.place, terms, SMALL):
        believed = np.column_stack([dX, rate[:, 1]]) if TILT in names else dX
        errors.append(found.error(-rate[:, 0], believed))
    return np.array(errors)
