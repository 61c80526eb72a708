"""The linear model of one step of a part with sampled methods, by differences of its own steps.

x+ = A x + B u,  y = C x+ + D u with x = states and discrete values.  Exact but for rounding where the step is linear.

A part that hands on values of earlier steps and keeps none (an amplifier that is asked once a step) only delays by the
step, and has a continuous model, in which it does not: :func:`undelayed`.

Not modelled: a part whose step is not the same one step later (a ring buffer; for a sampling period of several steps
see gyrobench.linear.multirate).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.component import Component, ComponentError
from gyrobench.component.tangents import twin_of
from gyrobench.linear.part_linearization import jacobians
from gyrobench.packaging.dependencies import moved
from gyrobench.packaging.source import PartCode

DELTA = 1e-6  # of a value, or of 1 where it is smaller
SETTLED = 1000  # steps after which a filter with a changing gain has its last one
ALIKE = 1e-3  # relative change of a coefficient between two steps that are alike
ROUNDED = 1e-14  # of a difference of values, its rounding
STILL = ALIKE / SETTLED  # the same, where it is not to grow to that until the filter has settled
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
    twin = twin_of(part)
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
    return _settled(first, twin, inputs, outputs, step)


def _settled(first: SampledStep, twin: Component, inputs: list[str], outputs: list[str], step: float) -> SampledStep:
    """Return the first step of a part that stands before it, or a later one that is like the next; ValueError without.

    The part goes on.
    """
    discrete = first.names[len(twin.states) :]
    try:
        twin.do_step(0.0, step)
        if _is_still(first, twin, inputs, outputs, step):
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
    part: Component, inputs: list[str], outputs: list[str], step: float, whole: SampledStep
) -> tuple[Array, Array, Array, Array] | None:
    """Return A, B, C, D of x' = A x + B u, y = C x + D u without the delay of the sampled methods; x: the states.

    whole: the step of the part, of :func:`sampled_step`.  None where a discrete value that the inputs reach keeps
    something from step to step (a filter in samples), or where half the step is not the same method twice as often (a
    sampling period of its own).

    Values d that are handed on, d+ = N d + K x + L u with a nilpotent N, are (I - N)^-1 (K x + L u) as the step goes to
    zero.
    """
    n = len(part.states)
    there = _handed_on(whole, n, _moved(part, inputs, step)[1])
    rows = n + np.flatnonzero(there)
    kept = whole.a[np.ix_(rows, rows)]
    if np.any(np.abs(np.linalg.matrix_power(kept, len(rows))) > DELTA):
        return None
    handed = [whole.names[k] for k in rows]
    twin = twin_of(part)
    try:
        half = differences(twin, inputs, [], 0.5 * step, handed)
        if _settled(half, twin, inputs, [], 0.5 * step) is not half:
            part = twin  # where it has settled
        fine = differences(part, inputs, [], FINE * step, handed)
    except (ComponentError, ValueError):
        return None
    still = np.linalg.inv(np.eye(len(rows)) - fine.a[n:, n:])
    of_x, of_u = still @ fine.a[n:, :n], still @ fine.b[n:]
    a, b, c, d = jacobians(part, inputs, outputs)
    all_outputs = [s.name for s in part.layout if s.section == "output"]
    sides = list(part.tangents({name: 1.0} for name in handed))
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
        twin = twin_of(part)
        for n in [*inputs, *(s.name for s in part.states)]:
            twin.set(n, twin.get(n) + size)
        for k in range(2):
            twin.do_step(k * step, step)
        values.append(np.array([twin.get(s.name) for s in discrete]))
    reached = values[0] != values[1]
    if not reached.any():
        return [], reached[:0]
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

    def matrices(columns: list[str]) -> tuple[Array, Array]:
        found = []
        for name in columns:
            size = _size(part, name)
            found.append([change / (2.0 * size) for change in _changes(part, {name: size}, names, outputs, step)])
        state, shown = (
            np.array([pair[k] for pair in found]).reshape(len(columns), rows).T
            for k, rows in enumerate((len(names), len(outputs)))
        )
        return state, shown

    (a, c), (b, d) = matrices(names), matrices(inputs)
    return SampledStep(names, a, b, c, d)


def _size(part: Component, name: str) -> float:
    return DELTA * max(1.0, abs(part.get(name)))


def _changes(
    part: Component, moves: dict[str, float], names: list[str], outputs: list[str], step: float
) -> list[Array]:
    """Return the differences of ``names`` after a step, and of outputs before it, between both signs of the moves."""

    def moved(sign: float) -> Component:
        twin = twin_of(part)
        for name, size in moves.items():
            twin.set(name, part.get(name) + sign * size)
        return twin

    after, before = [], []
    for sign in (1.0, -1.0):
        twin = moved(sign)
        twin.do_step(twin.t, step)
        after.append(np.array([twin.get(n) for n in names]))
        if outputs:
            twin = moved(sign)
            twin.flow()  # an output may be a derivative
        before.append(np.array([twin.get(n) for n in outputs]))
    return [after[0] - after[1], before[0] - before[1]]


def _is_still(model: SampledStep, part: Component, inputs: list[str], outputs: list[str], step: float) -> bool:
    """Return whether the step of a part at its present point is the model.

    First one step with all moved at once, each by a random share of its own, so that coefficients that differ do not
    cancel; where that is not the sum of the columns (a kink at this point), column by column.
    """
    columns = [*model.names, *inputs]
    shares = np.random.default_rng(1).uniform(0.5, 1.0, len(columns))
    moves = {name: share * _size(part, name) for name, share in zip(columns, shares, strict=True)}
    by = 2.0 * np.array(list(moves.values()))
    changes = _changes(part, moves, model.names, outputs, step)
    sides = np.hstack([model.a, model.b]), np.hstack([model.c, model.d])
    if all(
        np.all(np.abs(change - side @ by) <= STILL * (np.abs(side) @ by) + ROUNDED)
        for change, side in zip(changes, sides, strict=True)
    ):
        return True
    discrete = model.names[len(part.states) :]
    return model.is_like(differences(part, inputs, outputs, step, discrete), STILL)
