"""Jitter of a line of sight for any controller of a loop, from the linear model without it.

    u = U d + Q y + n        y = G u        L = -G Q        line of sight = W d + R y
    line of sight = (W + R G U / (1 + L)) d + R G / (1 + L) n

d the angle of the base about each axis, n the noise of the sensor in the loop's signal; other loops stay closed.

Not modelled: dry friction that slips (the model takes it for an elastic contact), limits, what is of second order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.component import Component
from gyrobench.linear.linear_model import Linear, operating_point
from gyrobench.record.frequency_response import Complex
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.margins import excitation_response
from gyrobench.system.line_of_sight import LineOfSight
from gyrobench.system.wiring import Assembly
from gyrobench.tuning.loop_ports import LoopPorts
from gyrobench.tuning.plant import without_controller


@dataclass(frozen=True)
class SightModel:
    """The closed linear model without the controller of one loop, and the sources of the jitter.

    In it the test signal of the loop is -v, and its signal e is u.
    """

    model: LinearModel
    ports: LoopPorts
    sources: LineOfSight

    def at(self, f: Array) -> SightWays:
        """Return the ways at frequencies, Hz; those below the lowest are left out."""
        use = f >= self.sources.lowest * (1.0 - 1e-9)
        g = f[use]

        def way(kind: str, axis: int, to: str) -> Complex:
            return np.asarray(excitation_response(self.model, kind, axis, to, g))

        moved = [(way("motion", k, self.ports.angle), way("motion", k, self.ports.inside)) for k in (1, 2, 3)]
        angles = [density(g) / (2.0 * np.pi * g) ** 2 for density in self.sources.rates]
        return SightWays(
            use, g, tuple((w, u, s) for (w, u), s in zip(moved, angles, strict=True)),
            way("test", self.ports.axis, self.ports.angle),
            way("test", self.ports.axis, self.ports.inside), self.sources.noise[self.ports.loop](g),
        )  # fmt: skip


@dataclass(frozen=True)
class SightWays:
    """Ways to a line of sight at frequencies f, Hz: of the base (W, U, density of its angle); R, Q; density of n."""

    use: NDArray[np.bool_]
    f: Array
    base: tuple[tuple[Complex, Complex, Array], ...]
    driven: Complex
    back: Complex
    noise: Array

    def sources(self, G: Complex) -> dict[str, float]:
        """Return source -> rms of the line of sight, rad; G: the controller over all frequencies."""
        answer = self.driven * G[self.use] / (1.0 - G[self.use] * self.back)
        density = {f"vibration about {axis}": np.abs(w + answer * u) ** 2 * s
                   for axis, (w, u, s) in zip("xyz", self.base, strict=True)}  # fmt: skip
        density["noise of the sensor"] = np.abs(answer) ** 2 * self.noise
        return {name: math.sqrt(float(np.trapezoid(s, self.f))) for name, s in density.items()}

    def rms(self, G: Complex) -> float:
        """Return the jitter, rad rms."""
        return math.sqrt(sum(x * x for x in self.sources(G).values()))

    def voltage(self, G: Complex) -> float:
        """Return what the controller gives to the motor for base and noise together, V rms."""
        answer = G[self.use] / (1.0 - G[self.use] * self.back)
        seen = sum((np.abs(u) ** 2 * s for _, u, s in self.base), self.noise)
        return math.sqrt(float(np.trapezoid(np.abs(answer) ** 2 * seen, self.f)))

    def floor(self) -> float:
        """Return the jitter, rad rms, below which no linear controller of this loop comes, causal or not.

        The line of sight is (W + X U) d + X n, X = R G/(1 + L); at each frequency the best complex X alone makes
        |W|2 S - |W conj(U) S|2 / (|U|2 S + S_n), axes of the base summed.
        """
        kept = sum((np.abs(w) ** 2 * s for w, _, s in self.base), np.zeros(self.f.size))
        shared = sum((w * np.conj(u) * s for w, u, s in self.base), np.zeros(self.f.size, complex))
        seen = sum((np.abs(u) ** 2 * s for _, u, s in self.base), self.noise)
        least = kept - np.abs(shared) ** 2 / np.maximum(seen, 1e-300)
        return math.sqrt(max(0.0, float(np.trapezoid(least, self.f))))


def sight_models(
    assembly: Assembly, parameters: Mapping[str, Any], part_of: Callable[[str], type[Component]], step: float,
    points: Sequence[Mapping[str, float]], ports: LoopPorts, sources: LineOfSight,
) -> list[SightModel]:  # fmt: skip
    """Return the model at each point of the spread.  Raises LinearizationError and ComponentError."""
    found = []
    for values in points:
        linear = Linear(assembly, operating_point(assembly, {**parameters, **values}, part_of), step)
        found.append(
            SightModel(
                without_controller(linear, ports.slot, {("v", "test"): -1.0, ("e", "u"): 1.0}).discrete(),
                ports,
                sources,
            )
        )
    return found
