"""Default plans of the drift tests for setup_effects.py, as their own reductions see them.

A system is run and reduced once; what its fit was given is kept: windows, regressors, candidates, and what errors of
the table do to the data.  A day of the servo tests is taken 500 times as fast, with the Earth rate raised alike: in the
units of the day times and rates are 500 times longer and smaller.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames, units
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation import fit_result, nuisances
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.system.system import load_system

Array = NDArray[np.float64]
DPH = units.factor("deg/h")
ARCSEC = units.factor("arcsec")
FAST = 500.0


@dataclass(frozen=True)
class Plan:
    """Times (n,) s, design (n, p), names and true values of its coefficients, number of each window's mount,
    candidates; what 1 arcsec of a tilt that is weighed (n,), of the mount of the gyro and of an encoder, once a turn
    (m, n) does to the data in deg/h; readings: the data are differences of readings.
    """

    t0: Array
    t1: Array
    X: Array
    names: tuple[str, ...]
    truth: Array
    mount: NDArray[np.int_]
    candidates: list[Candidate]
    tilt: Array
    mounted: Array
    encoder: Array
    readings: bool = False


def seen(system: str, channel: int = 0, speed: float = 1.0, **values: Any) -> Plan:
    """The plan of a system with these values; channel: which of its fits."""
    noted: list[tuple[Any, Effect]] = []
    inner = fit_result.standard_changes

    def note(found: Any, effect: Effect) -> Array:
        noted.append((found, effect))
        return inner(found, effect)

    fit_result.standard_changes = note  # type: ignore[assignment]
    try:
        with Session(system) as session, fit_result.observed_fits() as fits:
            load_system(system).with_values(values).reduce(session.run(values, seed=1))
    finally:
        fit_result.standard_changes = inner
    found = fits[channel][0]

    def of(*words: str) -> Array:  # each independent part of the errors whose names have these words, deg/h per arcsec
        rows = [np.atleast_2d(e.error) for f, e in noted if f is found and any(w in e.source for w in words)]
        return np.vstack([np.zeros((0, found.y.size)), *rows]) * (ARCSEC / DPH / speed)

    p = found.X.shape[1]
    every = [*found.candidates, *(h.candidate for h in found.hidden)]
    groups = next((c.block.columns for c in every if c.kind == "mount"), np.ones((found.y.size, 1)))
    tilts = [c for c in found.candidates if c.unit == "″"]
    tilt = np.ravel(tilts[0].columns) * (ARCSEC / DPH / speed) if tilts else np.zeros(found.y.size)
    trend = nuisances.trend(found.t_start * speed, found.t_end * speed)
    scaled = [replace(c, columns=np.asarray(c.columns) / (1.0 if c.scatter else DPH)) for c in every]
    return Plan(
        found.t_start * speed, found.t_end * speed, found.X, tuple(q.name for q in found.linear),
        found.est.beta[:p] / DPH, np.argmax(groups, axis=1),
        [replace(c, columns=trend.columns) if c.name.startswith("trend") else c for c in scaled],
        tilt, of("gyro turned about", "gyro on the plate", "input axis towards"), of("angle error, once"),
        found.mode == "readings",
    )  # fmt: skip


DAY: dict[str, Any] = {"site.earth_rate": FAST * frames.EARTH_RATE, "settle": 2.0}
PLANS = {
    "servo_polar": lambda: seen(
        "servo_polar", 0, FAST, **DAY, time=172.4, window=1.2, dwell=7.2, **{"cage.i_max": 10.0}
    ),
    "servo_vertical_level": lambda: seen("servo_vertical_level"),
    "servo_two_axis": lambda: seen(
        "servo_two_axis", 0, FAST, **DAY, time=172.8, window=1.2, **{"cage_x.i_max": 10.0, "cage_y.i_max": 10.0}
    ),
    "eight_position": lambda: seen("eight_position"),
    "fixed_position": lambda: seen("fixed_position"),
    "open_loop_drift": lambda: seen("open_loop_drift"),
    "tumble_two_axis": lambda: seen("tumble_two_axis"),
    "two_channel": lambda: seen("tumble_two_channel"),
    "two_channel, simple": lambda: seen("tumble_two_channel", model="simple"),
    "two_channel, both senses": lambda: seen("tumble_two_channel", both_senses=True),
}
