"""The test as choices of a method, each with the total time that it takes."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.visit_protocol import gyro_noise, gyro_unseen
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import plans
from .reduction import method_of


def _options(method: str, length: float) -> Mapping[str, Any]:
    return {"method": method, "time": format_time(length)}


def protocol_of(system: System, record: Record) -> OptionProtocol:
    """Return the methods that head, gyro and rough heading admit; the length is the total time.

    The options level, axes and rough say what is admitted, as of the method auto, which compares by white noise alone.
    """
    own = method_of(record.run)
    possible = [m for m in plans.possible(system["level"], system["axes"], system["rough"]) if m != own]
    windows = float(system["windows"] + system["positions"])
    choices = []
    for method in [own, *possible]:
        lost = plans.overhead(method, system["positions"], system["back"], system["settle"], system.step)
        least = lost + 10.0 * system.step * windows + (plans.TURN / plans.RATE if method in plans.TURNING else 0.0)
        choices.append(Choice(method, functools.partial(_options, method), float(record.windows["t_end"][-1]), least))
    p = record.run.parameters
    noise = {axis: gyro_noise(p, meter="", axis=f"_{axis}") for axis in "xy"}

    def covariances(fits: Sequence[Findings], record: Record) -> list[Array]:
        (fit,) = fits
        if "w_x" not in fit.data.quantities:
            return [noise["y"].covariance(fit.t_start, fit.t_end)]
        half = fit.y.size // 2  # strapdown: x, then y
        V = np.zeros((fit.y.size, fit.y.size))
        for rows, axis in ((slice(0, half), "x"), (slice(half, None), "y")):
            V[rows, rows] = noise[axis].covariance(fit.t_start[rows], fit.t_end[rows])
        return [V]

    unseen = ["a bias of the gyro that changes otherwise than as a Gauss-Markov process", *gyro_unseen(p, ("_x", "_y"))]
    return OptionProtocol(tuple(choices), covariances, ("ψ", "A", "b"), tuple(unseen))
