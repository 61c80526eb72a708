"""One part in the linear model of a system: its Jacobians and its step, found once for a point.

Between the runs of a series most parts are what they were: parameters, inputs and states are the same numbers.  What
was found for the same class, complete state and ports is taken again (:data:`KEPT` of them), to the last bit.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component import Component
from gyrobench.linear.held_input import held
from gyrobench.linear.multirate import multirate_step
from gyrobench.linear.part_linearization import jacobians
from gyrobench.linear.sampled_model import sampled_step, undelayed

KEPT = 256  # parts at a point
T = TypeVar("T")


@dataclass
class LinearBlock:
    """One part: x' = A x + B u, y = C x + D u, with the ports that matter, "slot.variable".

    within: B in the middle of each internal step, where a part follows an input through the communication step.
    """

    slot: str
    inputs: list[str]
    outputs: list[str]
    states: list[str]
    a: Array
    b: Array
    c: Array
    d: Array
    within: list[Array]
    _held: dict[float, tuple[Array, Array]] = field(default_factory=dict, repr=False)

    def held(self, step: float) -> tuple[Array, Array]:
        """Return exp(A h) and its integral times B: the exact step with the inputs held."""
        if step not in self._held:
            self._held[step] = self._transition(step)
        return self._held[step]

    def _transition(self, step: float) -> tuple[Array, Array]:
        ad, bd = np.eye(len(self.a)), np.zeros(self.b.shape)
        for b in self.within:
            a, driven = held(self.a, b, step / len(self.within))
            ad, bd = a @ ad, a @ bd + driven
        return ad, bd


class _Point:
    """A part at its present point; equal to another of the same class, name and complete state."""

    def __init__(self, part: Component) -> None:
        self.part = part
        self._key = (type(part), part.instance, hashlib.sha256(repr(part.get_state()).encode()).digest())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Point) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@functools.lru_cache(maxsize=KEPT)
def _started(point: _Point) -> dict[str, Any]:
    point.part.initialize()
    return point.part.get_state()


def start(part: Component) -> None:
    """Initialize a part that stands before it, to what the same part came to before.  Raises ComponentError."""
    part.set_state(_started(_Point(part)))


def _kept(find: Callable[[Component, list[str], list[str], float], T]) -> Callable[..., T]:
    """Return a function of a part, its inputs and outputs, and a step that takes again what it has found."""

    @functools.lru_cache(maxsize=KEPT)
    def found(point: _Point, inputs: tuple[str, ...], outputs: tuple[str, ...], step: float) -> T:
        return find(point.part, [*inputs], [*outputs], step)

    def of(part: Component, inputs: list[str], outputs: list[str], step: float) -> T:
        return found(_Point(part), tuple(inputs), tuple(outputs), step)

    return of


@_kept
def block_of(part: Component, inputs: list[str], outputs: list[str], step: float) -> LinearBlock:
    """Return the part, slot = its instance name, linearized at its present point.  Raises ComponentError."""
    a, b, c, d = jacobians(part, inputs, outputs)
    states = [s.name for s in part.states]
    return LinearBlock(part.instance, inputs, outputs, states, a, b, c, d, _within(part, inputs, b, step))


step_of, multirate_of = _kept(sampled_step), _kept(multirate_step)


@_kept
def undelayed_of(
    part: Component, inputs: list[str], outputs: list[str], step: float
) -> tuple[Array, Array, Array, Array] | None:
    """Return what :func:`gyrobench.linear.sampled_model.undelayed` does."""
    try:
        whole = step_of(part, inputs, outputs, step)
    except ValueError:
        return None
    return None if whole is None else undelayed(part, inputs, outputs, step, whole)


def _within(part: Component, inputs: list[str], b: Array, step: float) -> list[Array]:
    """Return B in the middle of each internal step; the one of the communication points where it is the same."""
    now = part.t
    part.step_end = now + step
    found = []
    for k in range(round(step / part.h)):
        part.t = now + (k + 0.5) * part.h
        found.append(jacobians(part, inputs, [])[1])
    part.t = part.step_end = now
    return [b] if all(np.array_equal(x, b) for x in found) else found
