"""Protocol of a test for the search for its shortest plan: candidates, rows of its regression, noise, moves, options.

A system names in ``protocol`` a module beside system.py with

    def protocol_of(system, record) -> VisitProtocol

system: with its values; record: of a run of it as it is, with the parameters of the parts.  The rows are those of the
reduction, made by the reduction's own functions; what is printed is never rested on them alone: the plan that was found
is run, reduced and predicted from the design matrix of that very reduction (predicted_uncertainty.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import System

GUARD = 0.011  # s that sequencer and sampler take beside move, settling and dwell


@dataclass(frozen=True)
class DataNoise:
    """Noise of the data of a fit: white density, rms and correlation time (s) of a Gauss-Markov process, in the unit of
    the data.  The model of gyrobench.reduction.estimation.noise.
    """

    white: float
    markov: float = 0.0
    tau: float = 1.0

    def covariance(self, t0: Array, t1: Array, independent: Array | float = 0.0) -> Array:
        """Return the covariance (n, n) of means over [t0, t1]; independent: sd of an error of each row by itself."""
        V: Array = np.diag(self.white**2 / (t1 - t0) + np.square(np.broadcast_to(independent, t0.shape)))
        if self.markov > 0.0:
            V += self.markov**2 * noise.process_covariance(t0, t1, self.tau)
        return V


@dataclass(frozen=True)
class Channel:
    """One fit of a reduction, to first order: rows (m, p) of the candidates, values = map (q, p) unknowns.

    names: of the values, as the result prints them, with other names that a want may use.  noise: of its data.
    repeat: (m,) sd of an error that a visit has as a whole, new in each (repeatability of a position).
    """

    names: tuple[str, ...]
    rows: Array
    map: Array
    noise: DataNoise
    repeat: Array | float = 0.0
    aliases: Mapping[str, str] = field(default_factory=dict)  # want -> name


@dataclass(frozen=True)
class VisitProtocol:
    """A test that goes from place to place and averages at rest.

    labels: of the m candidates.  move: s from one candidate (None: from the start) to another.  settle: s.
    options: the values of the system that make a plan of visits (candidate, s).  book: the visits of the plan as the
    system has it.  most: visits a plan may have.  required: candidates that every plan must visit.  averaged: whether
    the readings of a visit are one datum.  least: shortest dwell, s.  unseen: what no plan of this test determines, as
    sentences.
    """

    labels: tuple[str, ...]
    channels: tuple[Channel, ...]
    move: Callable[[int | None, int], float]
    settle: float
    options: Callable[[Sequence[tuple[int, float]]], dict[str, Any]]
    book: tuple[tuple[int, float], ...]
    most: int = 99
    required: tuple[int, ...] = ()
    unseen: tuple[str, ...] = ()
    least: float = 1.0

    def times(self, places: Sequence[int], dwells: Array) -> tuple[Array, Array]:
        """Return start and end (n,) of each visit's readings, s."""
        moves = [self.move(a, b) for a, b in zip([None, *places[:-1]], places, strict=True)]
        before = np.cumsum(np.asarray(moves) + self.settle + GUARD)
        end = before + np.cumsum(dwells)
        return end - dwells, end


def phases_of(system: System) -> list[Phase]:
    """Return the phases of a system whose plan is one of phases."""
    plan = system.plan()
    assert isinstance(plan, Plan)
    return plan.phases


def gyro_noise(
    parameters: Mapping[str, Any], k: str = "gyro.k", meter: str = "rebalance.meter", axis: str = ""
) -> DataNoise:
    """Return the noise of a drift rate that a rebalance current gives, rad/s: of the gyro, and of the current meter.

    axis: "_x" of a gyro with two.  The noise of the pickoff falls with the window and is left out.
    """
    p = parameters
    read = float(p.get(k, 0.0)) * float(p.get(meter, 0.0))
    tau = float(p.get(f"gyro.markov{axis}_tau", p.get("gyro.markov_tau", 1.0)))
    return DataNoise(
        float(np.hypot(p.get(f"gyro.white{axis}", 0.0), read)), float(p.get(f"gyro.markov{axis}", 0.0)), tau
    )


#: parameters of a gyro's drift that are outside the noise model
GYRO_TERMS = ("turn_on", "flicker", "walk", "quantization", "ramp")


def gyro_unseen(parameters: Mapping[str, Any], axes: Sequence[str] = ("",)) -> list[str]:
    """Return the random drift that a prediction leaves out, as sentences."""
    names = [f"{n}{a}" for a in axes for n in GYRO_TERMS]
    return [f"{n} is not in the noise model of the design" for n in random_terms(parameters, "gyro", names)]


def random_terms(parameters: Mapping[str, Any], slot: str, names: Sequence[str]) -> list[str]:
    """Return the parameters of random drift outside the noise model that are set: flicker, random walk, ramp ..."""
    return [f"{slot}.{n}" for n in names if float(parameters.get(f"{slot}.{n}", 0.0) or 0.0) != 0.0]
