"""The linear model of a system with loops: its parts' own Jacobians, connected along its wires.

A system names its loops by the input where each is opened, ``loops = {"pitch": "stabilizer.u"}``.  Every part but the
exciter is linearized at the operating point, which is the start of the run with the outputs propagated along the
wires; excitations come in from outside.  Two models are made:

``continuous``  the wires carry every value without delay: the model of control theory.
``discrete``    the co-simulation itself: one communication step runs the parts in their order, each exactly discretized
                with its inputs held; a cut wire carries the value of the previous step.  The communication step and
                every inserted delay are in it, to rounding for parts that are integrated exactly.

Opened at an input, the loop is L = -(returned signal) / (injected signal), other loops closed.

A sampled method that keeps something of an input has no continuous model; the discrete one takes the part's own step,
where one step is like the next (gyrobench.linear.sampled_model), or like the one a sampling period later: a loop that
is opened at its input is then that of its samples (gyrobench.linear.multirate).  One that carries it through the step
only (the motion of a base between its values), or hands it on a step later, has both.

Not modelled: limits.  Sampled methods whose steps differ otherwise (a moving average) and third-party FMUs leave the
system without a linear model; a warning says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.component import Component
from gyrobench.errors import GyrobenchError
from gyrobench.linear.block import LinearBlock, block_of, multirate_of, start, step_of, undelayed_of
from gyrobench.linear.multirate import MultirateStep
from gyrobench.linear.sampled_model import SampledStep
from gyrobench.packaging import load_part
from gyrobench.record.frequency_response import unstable
from gyrobench.record.run_document import LinearModel, LinearModels, LinearPair, OpenLoop
from gyrobench.system.sockets import socket
from gyrobench.system.values import flatten
from gyrobench.system.wiring import Assembly, Connection

PASSES = 3  # along the wires, to find the operating point


class LinearizationError(GyrobenchError):
    """The system has no linear model; the text says why."""


def known_parts(names: Mapping[str, str], bench: Path | None) -> Callable[[str], type[Component]]:
    """Return what finds the class of the part in a slot; it raises LinearizationError where no name is known for it."""

    def part_of(slot: str) -> type[Component]:
        if slot not in names:
            raise LinearizationError(f"the FMU in slot {slot} is not one of this bench: its Jacobians are not known")
        return load_part(names[slot], bench)

    return part_of


def operating_point(
    assembly: Assembly, parameters: Mapping[str, Any], part_of: Callable[[str], type[Component]]
) -> dict[str, Component]:
    """Return the parts as plain classes with these parameters and starts ("slot.name", SI), started and propagated;
    those that round (a converter, an output word) without it, as a slope of 0 is not that of their curve.

    part_of: slot -> class; raises LinearizationError for a slot without a part of this bench.  Raises
    ComponentError where a part does not start.
    """
    parts = {}
    for slot in assembly.order.order:
        part = part_of(slot)(slot)
        known = {s.name for s in part.layout if s.section in ("parameter", "input")}
        for name, value in parameters.items():
            of, _, parameter = name.partition(".")
            for element, x in flatten(parameter, value).items() if of == slot else ():
                if element in known:
                    part.set(element, float(x))
        for name, x in part.unrounded.items():
            part.set(name, x)
        parts[slot] = part

    def feed(slot: str) -> None:
        for c in assembly.connections:
            if c.target == slot:
                constant = c.output.constant
                value = parts[c.source].get(c.output.variable) if constant is None else constant
                parts[slot].set(c.input.variable, c.gain * value + c.offset)

    for slot in assembly.order.order:
        feed(slot)
        start(parts[slot])
    for _ in range(PASSES):
        for slot in assembly.order.order:
            feed(slot)
    return parts


class Linear:
    """The linear system; see the module.  also: slots whose outputs come in from outside, as the exciter's do."""

    def __init__(
        self, assembly: Assembly, parts: Mapping[str, Component], step: float, also: Sequence[str] = ()
    ) -> None:
        self.step = step
        system = assembly.system
        if late := [c.wire for c in assembly.connections if c.delayed]:
            if system.coupling:
                raise LinearizationError("the parts are coupled in parallel")
            raise LinearizationError(f"a mapping file delays {', '.join(dict.fromkeys(late))}")
        sources = [s for s, d in system.slots.items() if socket(d.socket).name == "Excitation" or s in also]
        varying = [c for c in assembly.connections if c.output.constant is None]
        self.connections = [c for c in varying if c.target not in sources]
        self.outside = list(
            dict.fromkeys(f"{c.source}.{c.output.variable}" for c in self.connections if c.source in sources)
        )
        channels = [n for n in system.channels if n.partition(".")[0] not in sources]
        self.shown = [n for n in channels if self._has(parts, n)]
        self.order = [s for s in assembly.order.order if s not in sources]
        for part in parts.values():  # outputs may look ahead within the internal step
            part.h = step / max(1, math.ceil(step / getattr(part, "step", step) - 1e-9))
        self.blocks = {s: self._block(s, parts[s]) for s in self.order}
        self.sampled: dict[str, SampledStep] = {}
        self.multirate: dict[str, MultirateStep] = {}  # of them, those that sample every few steps
        for s in self.order:
            at = parts[s], self.blocks[s].inputs, self.blocks[s].outputs, step
            try:
                slow = multirate_of(*at)
                model = slow.baseband() if slow else step_of(*at)
            except ValueError as error:
                raise LinearizationError(f"{s} works in samples, and {error}") from error
            if model is not None:
                self.sampled[s] = model
            if slow is not None:
                self.multirate[s] = slow
        self._parts = parts
        self.inputs = [f"{s}.{v}" for s in self.order for v in self.blocks[s].inputs]
        self.outputs = [f"{s}.{v}" for s in self.order for v in self.blocks[s].outputs]
        self.states = [f"{s}.{v}" for s in self.order for v in self.blocks[s].states]
        self.k = np.zeros((len(self.inputs), len(self.outputs)))
        self.w = np.zeros((len(self.inputs), len(self.outside)))
        for c in self.connections:
            row, source = self.inputs.index(f"{c.target}.{c.input.variable}"), f"{c.source}.{c.output.variable}"
            if source in self.outside:
                self.w[row, self.outside.index(source)] = c.gain
            else:
                self.k[row, self.outputs.index(source)] = c.gain
        self.cut = [n for n in self.outputs if any(self._late(c, n) for c in self.connections)]

    @cached_property
    def undelayed(self) -> dict[str, Any]:
        """Return the continuous models of parts that work in samples, slot -> its matrices, or None without one."""
        return {
            s: undelayed_of(self._parts[s], self.blocks[s].inputs, self.blocks[s].outputs, self.step)
            for s, model in self.sampled.items()
            if not model.within
        }

    @staticmethod
    def _has(parts: Mapping[str, Component], name: str) -> bool:
        slot, _, variable = name.partition(".")
        return any(s.name == variable and s.section == "output" for s in parts[slot].layout)

    def _block(self, slot: str, part: Component) -> LinearBlock:
        incoming = list(dict.fromkeys(c.input.variable for c in self.connections if c.target == slot))
        wired = [c.output.variable for c in self.connections if c.source == slot]
        outgoing = list(dict.fromkeys([*wired, *(n.partition(".")[2] for n in self.shown if n.startswith(slot + "."))]))
        return block_of(part, incoming, outgoing, self.step)

    def _late(self, c: Connection, name: str) -> bool:
        """Return whether this connection takes the output ``name`` from the previous step."""
        if f"{c.source}.{c.output.variable}" != name:
            return False
        return self.order.index(c.source) >= self.order.index(c.target)

    def _row(self, break_at: str) -> int:
        if break_at not in self.inputs:
            raise LinearizationError(
                f"break point {break_at}: not a connected input; connected inputs: {', '.join(self.inputs)}"
            )
        return self.inputs.index(break_at)

    # ------------------------------------------------------------------ models
    def continuous(self, break_at: str | None = None) -> LinearModel:
        """Return A, B, C, D from excitations to channels, or of the loop L opened at an input ("slot.variable")."""
        from scipy.linalg import block_diag

        plain = {s: (p.a, p.b, p.c, p.d) for s, p in self.blocks.items()}
        of_parts = [self.undelayed.get(s) or plain[s] for s in self.order]
        a, b, c, d = (block_diag(*(of_part[m] for of_part in of_parts)) for m in range(4))
        k, w = self.k.copy(), self.w
        return_row = np.zeros((0, len(self.outputs)))
        if break_at is not None:
            row = self._row(break_at)
            return_row = k[row : row + 1].copy()
            k[row] = 0.0
            w = np.zeros((len(self.inputs), 1))
            w[row] = 1.0
        solve = np.linalg.inv(np.eye(len(self.inputs)) - k @ d)  # no algebraic loop: this is a finite sum
        uk, uw = solve @ k @ c, solve @ w
        cy, dy = c + d @ uk, d @ uw
        if break_at is not None:
            return _model(a + b @ uk, b @ uw, -return_row @ cy, -return_row @ dy, [break_at], ["L"], self.states, 0.0)
        rows = [self.outputs.index(n) for n in self.shown]
        return _model(a + b @ uk, b @ uw, cy[rows], dy[rows], self.outside, self.shown, self.states, 0.0)

    def discrete(self, break_at: str | None = None) -> LinearModel:
        """Return the same for the communication step; states: those of the parts and the values of cut wires.

        A loop that is opened where a part takes samples every few steps: for the period of the samples, exact.
        """
        slow = self.multirate.get(break_at.partition(".")[0]) if break_at else None
        if slow is None or slow.tick is None or any(m.every != slow.every for m in self.multirate.values()):
            return self._step(break_at, self.sampled)
        phases = []
        for i in range(slow.every):
            at = (slow.tick + i) % slow.every
            phases.append(self._step(break_at, self.sampled | {s: m.steps[at] for s, m in self.multirate.items()}))
        first = phases[0]
        a, b = np.array(first.A), np.array(first.B)
        for phase in phases[1:]:
            a, b = np.array(phase.A) @ a, np.array(phase.A) @ b
        return first.model_copy(update={"A": a.tolist(), "B": b.tolist(), "step": slow.every * self.step})

    def _step(self, break_at: str | None, sampled: Mapping[str, SampledStep]) -> LinearModel:
        """Return one communication step; sampled: slot -> the step of a part with sampled methods."""
        names_of = {s: sampled[s].names if s in sampled else self.blocks[s].states for s in self.order}
        all_states = [f"{s}.{v}" for s in self.order for v in names_of[s]]
        nx, nc = len(all_states), len(self.cut)
        n_in = 1 if break_at is not None else len(self.outside)
        width = nx + nc + n_in
        x = np.eye(nx, width)
        y = np.zeros((len(self.outputs), width))
        for j, name in enumerate(self.cut):
            y[self.outputs.index(name), nx + j] = 1.0
        injected = np.zeros((n_in, width))
        injected[:, nx + nc :] = np.eye(n_in)
        returned = np.zeros((1, width))
        broken = -1 if break_at is None else self._row(break_at)
        first_x = first_u = first_y = 0
        for slot in self.order:
            p = self.blocks[slot]
            u_at = slice(first_u, first_u + len(p.inputs))
            x_at = slice(first_x, first_x + len(names_of[slot]))
            y_at = slice(first_y, first_y + len(p.outputs))
            u = self.k[u_at] @ y + (self.w[u_at] @ injected if break_at is None else 0.0)
            if u_at.start <= broken < u_at.stop:
                returned = u[broken - u_at.start : broken - u_at.start + 1].copy()
                u[broken - u_at.start] = injected[0]
            model = sampled.get(slot)
            ad, bd = (model.a, model.b) if model else p.held(self.step)
            c, d = (model.c, model.d) if model else (p.c, p.d)
            x[x_at] = ad @ x[x_at] + bd @ u
            y[y_at] = c @ x[x_at] + d @ u
            first_u, first_x, first_y = u_at.stop, x_at.stop, y_at.stop
        after = np.vstack([x, y[[self.outputs.index(n) for n in self.cut]]])
        shown = -returned if break_at is not None else y[[self.outputs.index(n) for n in self.shown]]
        n = nx + nc
        names = ([break_at], ["L"]) if break_at is not None else (self.outside, self.shown)
        states = [*all_states, *(f"{c} (step before)" for c in self.cut)]
        return _model(after[:, :n], after[:, n:], shown[:, :n], shown[:, n:], *names, states, self.step)


def _model(
    a: Array, b: Array, c: Array, d: Array, inputs: list[str], outputs: list[str], states: list[str], step: float
) -> LinearModel:
    """Return the model in the form of run.json; step: s, 0 for a continuous model."""
    return LinearModel(
        A=a.tolist(), B=b.tolist(), C=c.tolist(), D=d.tolist(), inputs=inputs, outputs=outputs, states=states, step=step
    )


def loops(
    assembly: Assembly, parameters: Mapping[str, Any], part_of: Callable[[str], type[Component]], step: float
) -> tuple[LinearModels, list[str]]:
    """Return the linear models that run.json keeps, and the warnings to give before the run.

    Where there is no linear model, ``missing`` says why.
    """
    from gyrobench.component import ComponentError

    try:
        parts = operating_point(assembly, parameters, part_of)
        linear = Linear(assembly, parts, step)
        in_samples = any(model is None for model in linear.undelayed.values())
        kinds = {"discrete": linear.discrete} | ({} if in_samples else {"continuous": linear.continuous})
        loops_: dict[str, OpenLoop] = {}
        for name, at in assembly.system.loops.items():
            loops_[name] = OpenLoop.model_validate({"break": at, **{kind: model(at) for kind, model in kinds.items()}})
        models = LinearModels(closed=LinearPair(**{kind: model() for kind, model in kinds.items()}), loops=loops_)
    except ComponentError as error:  # the run reports it too
        return LinearModels(missing=str(error)), []
    except LinearizationError as error:
        return LinearModels(missing=str(error)), [f"no margins from linearized parts: {error}"]
    pair = models.closed
    for model, text in ((pair.continuous, "the linear loop"), (pair.discrete, f"the loop with its step of {step:g} s")):
        growing = unstable(model) if model is not None else []
        if growing:
            others = f" and {len(growing) - 1} more" if len(growing) > 1 else ""
            return models, [f"{text} is unstable: pole {_written(growing[0])}{others}; the run will show it growing"]
    return models, []


def _written(p: complex) -> str:
    """Return a pole as text: -9.1 1/s, or 2.3 ± 89j rad/s with its frequency."""
    if abs(p.imag) < 1e-9 * abs(p):
        return f"{p.real:+.4g} 1/s"
    return f"{p.real:+.4g} ± {p.imag:.4g}j rad/s ({p.imag / (2.0 * np.pi):.4g} Hz)"
