"""Jitter of a line of sight for any controller of a loop, from the linear model without it.

    u = sum_i U_i d_i + Q y        y = G u        L = -G Q        line of sight = sum_i W_i d_i + R y
    line of sight = sum_i (W_i + R G U_i / (1 + L)) d_i

d_i what moves it: angles of the base, direction of a target, noise of sensors (U = 1, W = 0 of the loop's own); other
loops stay closed.

Not modelled: dry friction that slips (the model takes it for an elastic contact), limits, what is of second order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component import Component
from gyrobench.linear.linear_model import Linear, operating_point
from gyrobench.record.frequency_response import Complex
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.margins import excitation_responses
from gyrobench.system.line_of_sight import LineOfSight
from gyrobench.system.values import with_elements
from gyrobench.system.wiring import Assembly
from gyrobench.tuning.loop_ports import LoopPorts
from gyrobench.tuning.plant import without_controller

FINER = 12  # intervals in one of the grid


@dataclass(frozen=True)
class SightModel:
    """The closed linear model without the controller of one loop, and the sources of the jitter.

    In it the test signal of the loop is -v, and its signal e is u.
    """

    model: LinearModel
    ports: LoopPorts
    sources: LineOfSight

    @property
    def angle(self) -> str:
        """Return the channel of the angle whose jitter it is."""
        return self.sources.angles.get(self.ports.loop, self.ports.angle)

    def at(self, f: Array) -> SightWays:
        """Return the ways at frequencies, Hz; those below the lowest are left out."""
        use = f >= self.sources.lowest * (1.0 - 1e-9)
        g = f[use]

        narrow = self.sources.f[(self.sources.f > g[0]) & (self.sources.f < g[-1])]
        fine = np.union1d(finer(g), narrow)

        def both(kind: str, axis: int) -> tuple[Complex, Complex]:
            """Return the ways of an excitation to the line of sight and to the input of the controller."""
            made = excitation_responses(self.model, kind, (axis,), (self.angle, self.ports.inside), g)[:, :, 0]
            return np.interp(fine, g, made[:, 0]), np.interp(fine, g, made[:, 1])

        moved = []
        for source in self.sources.sources:
            if source.loop == self.ports.loop:
                w, u = np.zeros(fine.size, complex), np.ones(fine.size, complex)
            else:
                w, u = both(source.kind, source.axis)
            moved.append(MovedSight(source.name, w, u, source.density(fine)))
        return SightWays(f, fine, tuple(moved), *both(self.ports.kind, self.ports.axis))


def finer(f: Array) -> Array:
    """Return rising frequencies with FINER intervals in the place of each.

    A loop may close with a resonance of its own, where no part has one: narrower than the grid, on which the parts'
    responses are smooth.
    """
    k = np.arange(FINER * (f.size - 1) + 1)
    at = np.interp(k / FINER, np.arange(f.size), f)
    at[::FINER] = f
    return np.asarray(at)


@dataclass(frozen=True)
class MovedSight:
    """A source at frequencies: its way W to the line of sight and U to the input of the controller; its density."""

    name: str
    sight: Complex
    seen: Complex
    density: Array


@dataclass(frozen=True)
class SightWays:
    """Ways to a line of sight at frequencies f, Hz: of its sources; R, Q of the controller's output.

    at: frequencies at which a controller is given.
    """

    at: Array
    f: Array
    moved: tuple[MovedSight, ...]
    driven: Complex
    back: Complex

    def sources(self, G: Complex) -> dict[str, float]:
        """Return source -> rms of the line of sight, rad; G: the controller at ``at``."""
        held = np.interp(self.f, self.at, G)
        answer = self.driven * held / (1.0 - held * self.back)
        squares: dict[str, float] = {}
        for m in self.moved:
            made = float(np.trapezoid(np.abs(m.sight + answer * m.seen) ** 2 * m.density, self.f))
            squares[m.name] = squares.get(m.name, 0.0) + made
        return {name: math.sqrt(x) for name, x in squares.items()}

    def rms(self, G: Complex) -> float:
        """Return the jitter, rad rms."""
        return math.sqrt(sum(x * x for x in self.sources(G).values()))

    def voltage(self, G: Complex, source: str = "") -> float:
        """Return what the controller gives for all sources together, or for one, V rms."""
        held = np.interp(self.f, self.at, G)
        answer = held / (1.0 - held * self.back)
        return math.sqrt(float(np.trapezoid(np.abs(answer) ** 2 * self._seen(source), self.f)))

    def _seen(self, source: str = "") -> Array:
        """Return the density of the controller's input without the controller, of one source or all."""
        moved = [m for m in self.moved if source in ("", m.name)]
        return np.asarray(sum((np.abs(m.seen) ** 2 * m.density for m in moved), np.zeros(self.f.size)))

    def floor(self) -> float:
        """Return the jitter, rad rms, below which no linear controller of this loop comes, causal or not.

        The line of sight is sum (W_i + X U_i) d_i, X = R G/(1 + L); at each frequency the best complex X alone makes
        sum |W_i|2 S_i - |sum W_i conj(U_i) S_i|2 / sum |U_i|2 S_i.
        """
        kept = sum((np.abs(m.sight) ** 2 * m.density for m in self.moved), np.zeros(self.f.size))
        shared = sum((m.sight * np.conj(m.seen) * m.density for m in self.moved), np.zeros(self.f.size, complex))
        least = kept - np.abs(shared) ** 2 / np.maximum(self._seen(), 1e-300)
        return math.sqrt(max(0.0, float(np.trapezoid(least, self.f))))


def sight_models(
    assembly: Assembly, parameters: Mapping[str, Any], part_of: Callable[[str], type[Component]], step: float,
    points: Sequence[Mapping[str, float]], ports: LoopPorts, stated: Callable[[Mapping[str, Any]], LineOfSight],
) -> list[SightModel]:  # fmt: skip
    """Return the model at each point of the spread.  Raises LinearizationError and ComponentError.

    stated: parameters -> what moves the line of sight, which a spread may change too.
    """
    found = []
    for values in points:
        there = with_elements(parameters, values)
        sources = stated(there)
        parts = operating_point(assembly, {**there, **sources.riding, **sources.slipping}, part_of)
        linear = Linear(assembly, parts, step, sources.moved_by)
        opened = without_controller(linear, ports.slot, {("v", "test"): -1.0, ("e", "u"): 1.0})
        found.append(SightModel(opened.discrete(), ports, sources))
    return found
