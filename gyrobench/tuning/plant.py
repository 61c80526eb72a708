"""The plant that a stabilizer sees, from the exact Jacobians of the parts: what comes back to ``stabilizer.u`` for one
unit of -v, with the communication step, the order of the parts and every inserted delay.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.component import Component
from gyrobench.linear.block import LinearBlock
from gyrobench.linear.held_input import held
from gyrobench.linear.linear_model import Linear, operating_point
from gyrobench.record.frequency_response import Complex, reached
from gyrobench.record.run_document import LinearModel
from gyrobench.system.wiring import Assembly
from gyrobench.tuning.inner_plant import opened_inside
from gyrobench.tuning.loop_ports import STABILIZER, LoopPorts
from gyrobench.tuning.own_controllers import InnerOwnController, own_controller, own_values
from gyrobench.tuning.structures import Controller

DRY = ("friction", "stiction")
#: of the values of a plant: joints stick that slip in the others
STICKS = "sticking"


@dataclass(frozen=True)
class Plant:
    """x+ = a x + b y, w = c x: y the controller's output -v of this step, w the return in the next; step in s.

    L = w/y times the controller.  values: the parameters of the parts that are not nominal.  inner: the controller is
    inside of a part, and its output is not held between the steps.  beside: input of what comes back past it, in L too.
    """

    a: Array
    b: Array
    c: Array
    step: float
    values: Mapping[str, float]
    inner: bool = False
    beside: Array | None = None

    def with_controller(self, controller: Controller) -> HeldController:
        """Return a controller as it works in this loop."""
        return (InnerController if self.inner else HeldController)(controller, self.step)

    def controller_response(self, controller: Controller, f: Array) -> Complex:
        """Return the response of a controller in this loop at frequencies in Hz."""
        return self.with_controller(controller).response(np.exp(2j * np.pi * np.asarray(f, float) * self.step))

    def response(self, f: Array) -> Complex:
        """Return the response at frequencies in Hz."""
        return self._from(self.b, f)

    def past(self, f: Array) -> Complex:
        """Return what comes back beside the controller at frequencies in Hz."""
        return np.zeros(np.size(f), complex) if self.beside is None else self._from(self.beside, f)

    def _from(self, b: Array, f: Array) -> Complex:
        z = np.exp(2j * np.pi * np.asarray(f, float) * self.step)
        n = len(self.a)
        states = np.linalg.solve(z[:, None, None] * np.eye(n) - self.a, np.broadcast_to(b, (z.size, n, 1)) + 0j)
        return np.asarray((self.c @ states)[:, 0, 0])

    def toward(self, other: Plant, share: float) -> Plant:
        """Return a plant between this one and another with as many states, linear in the matrices."""
        names = ("a", "b", "c") if self.beside is None else ("a", "b", "c", "beside")
        return replace(other, **{n: (1.0 - share) * getattr(self, n) + share * getattr(other, n) for n in names})

    def modes(self) -> list[complex]:
        """Return its modes."""
        return modes(np.linalg.eigvals(self.a), self.step)


def modes(z: Any, step: float) -> list[complex]:
    """Return the poles in the s plane with a damping below 0.3, upper half, by frequency.  z: those of steps."""
    p = np.log(z[np.abs(z) > 1e-9] + 0j) / step
    return sorted((complex(x) for x in p if x.imag > 0.0 and -x.real < 0.3 * abs(x)), key=abs)


def without_friction(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the dry friction of the parts as parameters of 0; {} where there is none."""
    names = [n for n, v in parameters.items() if n.rpartition(".")[2] in DRY and np.any(np.asarray(v, float))]
    return {n: (0.0 * np.asarray(parameters[n], float)).tolist() for n in names}


def plants(
    assembly: Assembly,
    parameters: Mapping[str, Any],
    part_of: Callable[[str], type[Component]],
    step: float,
    points: Sequence[Mapping[str, float]],
    ports: LoopPorts = STABILIZER,
) -> list[Plant]:
    """Return the plant at each point of the spread.  Raises LinearizationError and ComponentError."""
    own = own_controller(parameters, ports.slot)
    inner = isinstance(own, InnerOwnController)
    matrices = [_opened(assembly, {**parameters, **values}, part_of, step, ports) for values in points]
    if len({len(a) for a, _, _ in matrices}) > 1:
        raise UsageError("--over: the parts have other states at some points of the spread: narrow it")
    between = np.any([reached(a, b) & reached(a.T, c.T) for a, b, c in matrices], axis=0)
    if not between.any():
        raise UsageError("the voltage of the stabilizer does not reach its input: the loop is open")
    return [
        Plant(a[between][:, between], b[between, :1], c[:, between], step, values, inner,
              b[between, 1:] if inner else None)
        for (a, b, c), values in zip(matrices, points, strict=True)
    ]  # fmt: skip


def _opened(
    assembly: Assembly, parameters: Mapping[str, Any], part_of: Callable[[str], type[Component]], step: float,
    ports: LoopPorts,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return a, b, c of the loop with a gain of 1 in the place of the controller, opened before it.

    b has a second column where something comes back beside the controller.
    """
    own, slot = own_controller(parameters, ports.slot), ports.slot

    def linear(**changed: Any) -> Linear:
        other = {**parameters, **{f"{slot}.{n}": v for n, v in changed.items()}}
        parts = operating_point(assembly, other, part_of)
        for k in range(own.started if own else 0):
            parts[slot].do_step(k * step, step)
        return Linear(assembly, parts, step)

    if own is None:
        return _matrices(without_controller(linear(), slot, {("v", "u"): -1.0}).discrete(ports.opened))
    q = own_values(parameters, slot)
    if not isinstance(own, InnerOwnController):
        a, b, c = _matrices(linear().discrete(ports.opened))
        return a, b, c / own.gain(q)
    small = own.small(q)
    both = opened_inside(linear(**own.blank(q, small)), linear(**own.blank(q, 2.0 * small)), slot, ports.port, small)
    (a, b, c), (_, beside, _) = (_matrices(m) for m in both)
    return a, np.hstack([b, beside]), c


def without_controller(linear: Linear, slot: str, gains: Mapping[tuple[str, str], float]) -> Linear:
    """Return the system with gains (output, input) -> number in the place of a controller."""
    own = linear.blocks[slot]
    d = np.zeros((len(own.outputs), len(own.inputs)))
    for (output, given), gain in gains.items():
        d[own.outputs.index(output), own.inputs.index(given)] = gain
    m, p = len(own.inputs), len(own.outputs)
    linear.blocks[slot] = LinearBlock(
        slot, own.inputs, own.outputs, [], np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0)), d, [np.zeros((0, m))]
    )
    linear.sampled.pop(slot, None)
    linear.multirate.pop(slot, None)
    linear.states = [f"{s}.{v}" for s in linear.order for v in linear.blocks[s].states]
    return linear


def _matrices(model: LinearModel) -> tuple[Array, Array, Array]:
    """Return a, b, c of a model with one input and one output."""
    n = len(model.states)
    if np.any(np.asarray(model.D, float)):
        raise UsageError("the loop has no delay of a step: it cannot be tuned")
    a, b, c = (np.asarray(m, float) for m in (model.A, model.B, model.C))
    return a.reshape(n, n), b.reshape(n, 1), c.reshape(1, n)


class HeldController:
    """A continuous controller in the loop: exact for a held input, as the parts are."""

    def __init__(self, controller: Controller, step: float) -> None:
        from scipy.signal import tf2ss

        num, den = (np.trim_zeros(np.array(p), "b")[::-1] for p in (controller.num, controller.den))
        a, b, c, d = tf2ss(num, den)
        n = len(den) - 1
        a, b, c = a[:n, :n], b[:n], c[:, :n]
        self.a, self.b, self.c, self.d = self._sampled(a, b, c, float(np.ravel(d)[0]), step)

    @staticmethod
    def _sampled(a: Array, b: Array, c: Array, d: float, step: float) -> tuple[Array, Array, Array, float]:
        """Return x+ = a x + b u, y = c x + d u: y at the end of the step in which u is held."""
        a, b = held(a, b, step)
        return a, b, c @ a, float((c @ b)[0, 0]) + d

    def response(self, z: Complex) -> Complex:
        """Return the response at points z: the output at the end of a step sees the input held in it."""
        n = len(self.a)
        if n == 0:
            return np.full(z.size, self.d + 0j)
        states = np.linalg.solve(z[:, None, None] * np.eye(n) - self.a, np.broadcast_to(self.b, (z.size, n, 1)) + 0j)
        return np.asarray(self.d + (self.c @ states)[:, 0, 0])

    def loop(self, plant: Plant) -> tuple[Array, Array, Array]:
        """Return a, b, c of the open loop: states of plant and controller, input r, output w."""
        n, m = len(plant.a), len(self.a)
        a = np.zeros((n + m, n + m))
        a[:n, :n], a[:n, n:], a[n:, n:] = plant.a, plant.b @ self.c, self.a
        past = 0.0 if plant.beside is None else plant.beside
        b = np.vstack([plant.b * self.d + past, self.b])
        return a, b, np.hstack([plant.c, np.zeros((1, m))])

    def poles(self, plants: Sequence[Plant]) -> Array:
        """Return the poles z of each closed loop, (plants, states): of plants with as many states."""
        closed = []
        for p in plants:
            a, b, c = self.loop(p)
            closed.append(a - b @ c)
        return np.asarray(np.linalg.eigvals(np.array(closed)))


class InnerController(HeldController):
    """A controller inside of a part, whose output goes on between the communication steps: by s = (2/h)(z - 1)/(z + 1).

    What it drives is held in the plant, and the two make the loop of the part but for a frequency that is off by
    (w h)2/12: 0.13 % at a fiftieth of the frequency of the steps.
    """

    @staticmethod
    def _sampled(a: Array, b: Array, c: Array, d: float, step: float) -> tuple[Array, Array, Array, float]:
        n = len(a)
        half = 0.5 * step * a
        inverse = np.linalg.inv(np.eye(n) - half)
        ahead = 0.5 * step * inverse @ b  # x = w + ahead u with the state w of the trapezoid rule
        return inverse @ (np.eye(n) + half), 2.0 * inverse @ ahead, c, float((c @ ahead)[0, 0]) + d
