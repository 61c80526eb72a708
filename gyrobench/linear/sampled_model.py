"""The linear model of one step of a part with sampled methods, by differences of its own steps.

x+ = A x + B u,  y = C x+ + D u with x = states and discrete values.  Exact but for rounding where the step is linear.

A part that hands on values of earlier steps and keeps none (an amplifier that is asked once a step) only delays by the
step, and has a continuous model, in which it does not: :func:`undelayed`.

Not modelled: a part whose step is not the same one step later (a ring buffer; for a sampling period of several steps
see gyrobench.linear.multirate).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.component import Component, ComponentError
from gyrobench.linear.part_linearization import jacobians
from gyrobench.packaging.dependencies import moved
from gyrobench.packaging.source import PartCode

DELTA = 1e-6  # of a value, or of 1 where it is smaller
SETTLED = 1000  # steps after which a filter with a changing gain has its last one
ALIKE = 1e-3  # relative change of a coefficient between two steps that are alike
FINE = 1e-3  # of the step, where it is to be none
MAX_DISCRETE = 100  # discrete values: more are a memory, whose step is not the same one step later


@dataclass
class SampledStep:
    """One step; names: of states and of the discrete values that inputs or states move, the columns of A and C.

    within: the discrete values carry inputs through the step only (a part that follows an input between its values); at
    the instants themselves nothing depends on them, and the part's Jacobians are its continuous model.
    """

    names: list[str]
    a: Array
    b: Array
    c: Array
    d: Array
    within: bool = False

    def is_like(self, other: SampledStep, change: float) -> bool:
        """Return whether no coefficient of another step differs by more than a relative change."""
        pairs = [(getattr(self, m), getattr(other, m)) for m in "abcd"]
        return all(np.allclose(x, y, rtol=change, atol=1e-6 * np.abs(x).max(initial=0.0)) for x, y in pairs)


def sampled_step(part: Component, inputs: list[str], outputs: list[str], step: float) -> SampledStep | None:
    """Return the linear step of ``part`` at its present point; None where no sampled method links input and output.

    Raises ValueError (the text says why) for a part whose step is not the same one step later.
    """
    if not part.pieces["sampled"] or not inputs:
        return None
    twin = type(part)(part.instance)
    twin.set_state(part.get_state())
    discrete, reached = _moved(twin, inputs, step)
    if not reached.any():
        return None
    if len(discrete) > MAX_DISCRETE:
        raise ValueError(f"keeps {len(discrete)} values in memory")
    first = differences(twin, inputs, outputs, step, discrete)
    n = len(part.states)
    reached = _handed_on(first, n, reached)
    if not (np.any(first.a[:n, n:][:, reached]) or np.any(first.c[:, n:][:, reached])):
        return None  # none that the inputs reach goes further; constants of the part do not count
    first.within = not any(np.any(side) for k in np.flatnonzero(reached) for side in part.tangent({discrete[k]: 1.0}))
    if first.within:
        return first
    try:
        twin.do_step(0.0, step)
        if first.is_like(differences(twin, inputs, outputs, step, discrete), ALIKE / SETTLED):
            return first
        for k in range(1, SETTLED):
            twin.do_step(k * step, step)
        last = differences(twin, inputs, outputs, step, discrete)
        twin.do_step(SETTLED * step, step)
        after = differences(twin, inputs, outputs, step, discrete)
    except ComponentError as error:
        raise ValueError(str(error)) from error
    if not last.is_like(after, ALIKE):
        raise ValueError("its one step is not like the next (a memory, or a sampling period of several steps)")
    return last


def undelayed(
    part: Component, inputs: list[str], outputs: list[str], step: float
) -> tuple[Array, Array, Array, Array] | None:
    """Return A, B, C, D of x' = A x + B u, y = C x + D u without the delay of the sampled methods; x: the states.

    None where a discrete value that the inputs reach keeps something from step to step (a filter in samples), or where
    half the step is not the same method twice as often (a sampling period of its own).

    Values d that are handed on, d+ = N d + K x + L u with a nilpotent N, are (I - N)^-1 (K x + L u) as the step goes to
    zero.
    """
    n = len(part.states)
    try:
        twin = type(part)(part.instance)
        twin.set_state(part.get_state())
        if sampled_step(part, inputs, outputs, 0.5 * step) is None:
            return None
        discrete, reached = _moved(part, inputs, step)
        whole, fine = (differences(twin, inputs, outputs, h, discrete) for h in (step, FINE * step))
    except (ComponentError, ValueError):
        return None
    there = _handed_on(whole, n, reached)
    rows = n + np.flatnonzero(there)
    kept = whole.a[np.ix_(rows, rows)]
    if np.any(np.abs(np.linalg.matrix_power(kept, len(rows))) > DELTA):
        return None
    still = np.linalg.inv(np.eye(len(rows)) - fine.a[np.ix_(rows, rows)])
    of_x, of_u = still @ fine.a[rows, :n], still @ fine.b[rows]
    a, b, c, d = jacobians(part, inputs, outputs)
    all_outputs = [s.name for s in part.layout if s.section == "output"]
    sides = list(part.tangents({discrete[k - n]: 1.0} for k in rows))
    a_d = np.array([side[0] for side in sides], dtype=float).T.reshape(n, len(rows))
    c_d = np.array([[side[1][all_outputs.index(o)] for o in outputs] for side in sides], dtype=float).T
    c_d = c_d.reshape(len(outputs), len(rows))
    return a + a_d @ of_x, b + a_d @ of_u, c + c_d @ of_x, d + c_d @ of_u


def _handed_on(step: SampledStep, n: int, reached: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the discrete values that are reached at once or from another of them; n: states before them."""
    for _ in reached:
        reached = reached | np.any(step.a[n:, n:][:, reached], axis=1)
    return reached


def _moved(part: Component, inputs: list[str], step: float) -> tuple[list[str], NDArray[np.bool_]]:
    """Return the discrete values that inputs or states move, and which depend after two steps on the inputs, or on
    the previous states.

    The others (constants, noise) would be columns of nothing, a step in Python each.
    """
    discrete = [s for s in part.layout if s.section == "discrete"]
    values = []
    for size in (0.0, DELTA):
        twin = type(part)(part.instance)
        twin.set_state(part.get_state())
        for n in [*inputs, *(s.name for s in part.states)]:
            twin.set(n, twin.get(n) + size)
        for k in range(2):
            twin.do_step(k * step, step)
        values.append(np.array([twin.get(s.name) for s in discrete]))
    reached = values[0] != values[1]
    follow: set[str] = _following(type(part))  # type: ignore[arg-type]  # mypy takes the hash of an instance
    kept = [k for k, s in enumerate(discrete) if reached[k] or s.decl.name in follow]
    return [discrete[k].name for k in kept], reached[kept]


@functools.lru_cache(maxsize=256)
def _following(part: type[Component]) -> set[str]:
    return moved(PartCode(part))


def differences(
    part: Component, inputs: list[str], outputs: list[str], step: float, discrete: list[str]
) -> SampledStep:
    """Return the linear step of a part at its present point; discrete: values that are kept."""
    names = [s.name for s in part.states] + discrete
    kept: Any = part.get_state()

    def column(name: str, after: Callable[[], list[float]], move: bool) -> Array:
        shifted = []
        for sign in (1.0, -1.0):
            part.set_state(kept)
            x = part.get(name)
            size = DELTA * max(1.0, abs(x))
            part.set(name, x + sign * size)
            if move:
                part.do_step(part.t, step)
            shifted.append(np.array(after()))
        return np.asarray((shifted[0] - shifted[1]) / (2.0 * size))

    def state() -> list[float]:
        return [part.get(n) for n in names]

    def output() -> list[float]:
        part.flow()  # an output may be a derivative
        return [part.get(n) for n in outputs]

    def matrix(columns: list[str], after: Callable[[], list[float]], move: bool, rows: int) -> Array:
        return np.column_stack([column(n, after, move) for n in columns]) if columns else np.zeros((rows, 0))

    found = SampledStep(
        names,
        matrix(names, state, True, len(names)),
        matrix(inputs, state, True, len(names)),
        matrix(names, output, False, len(outputs)),
        matrix(inputs, output, False, len(outputs)),
    )
    part.set_state(kept)
    return found
