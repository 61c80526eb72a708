"""The class of which every part is a subclass: its values, its equations, how they are stepped.

A part is one class of declarations and equations, with those of its bases and blocks (see ``composition``).  The class
is the single source of the plain Python part, the Python FMU, the native FMU (its equations translated to C), the
model description and the linearization.

Stepping, identical in every target.  A communication step ``[t, t + H]`` is cut into
``n = ceil(H / step)`` equal internal steps ``h = H / n`` with the inputs held.  In each one

1.  the noise of this internal step is drawn (counter-based: it depends on ``seed``, the port and the
    count of internal steps, on nothing else), unless the step is of rounding size, below 1e-6 of the one before: then
    the last samples hold, for white noise of density s would be s / sqrt(h), without bound;
2.  the states advance, by the exponential Euler step ``x+ = x + h phi1(h A) f(x)`` with
    ``A = df/dx`` (exact when f is linear in x), with ``self.t`` at the start of the internal step or, "midpoint", in
    its middle (second order for a part that follows an input through the step), or by RK4 with declared substeps;
3.  the ``@sampled`` methods whose turn it is run, with ``self.t`` at the end of the internal step.

``self.t``, ``self.h`` are the present time and h; ``self.step_start``, ``self.step_end`` are t and t + H, which a part
needs that follows an input through the communication step instead of holding it.

After the last one ``outputs`` is evaluated and all is checked to be finite but large discrete arrays (memories).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import accumulate
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from gyrobench.component.composition import (
    EQUATIONS,
    TIMES,
    ArraySlot,
    ComponentError,
    Derivatives,
    Piece,
    Placed,
    View,
    flatten,
    own_equations,
    own_items,
    pieces,
    stored,
    view_of,
)
from gyrobench.component.declarations import (
    DRAWN,
    Declaration,
    Noise,
    Parameter,
    Scalar,
    State,
    floats,
    full,
    make_layout,
    shape_of,
)
from gyrobench.component.integration import advance
from gyrobench.component.math import value
from gyrobench.component.numerics import ROUNDING, OnUse
from gyrobench.component.tangents import Tangent, dig, tangents
from gyrobench.component.tuned import check_bounds, tune
from gyrobench.component.vectors import Vector, copied, is_finite

RESERVED = ("der", "noise", "instance")


class Watched:
    """Scalars that must be finite: keys of ``__dict__`` of the single ones, and of the arrays that hold the others."""

    def __init__(self, scalars: Iterable[Scalar]) -> None:
        self.scalars = list(scalars)
        self.numbers = [s.path[0] for s in self.scalars if len(s.path) == 1]
        self.arrays = list(dict.fromkeys(stored(s.path[0]) for s in self.scalars if len(s.path) > 1))


class Component:
    """Base of every part: collects the declarations and steps the equations (see the module's text)."""

    version: ClassVar[str] = "1.0.0"
    _outside: ClassVar[Any] = None  # of a controller in C: what is compiled with it (packaging/own_controller)
    sources: ClassVar[dict[str, str]] = {}  # files of the part by module name, where it was loaded from a bench
    integrator: ClassVar[str] = "exponential"  # or "midpoint", "rk4"
    rk4_substeps: ClassVar[int] = 20  # of one internal step
    nonlinear: ClassVar[bool | str] = False  # True: A is taken anew at each internal step; a name: while that is not 0
    long_loops: ClassVar[bool] = False  # True: of elements that do not wait for one another: worth vector code
    unrounded: ClassVar[dict[str, float]] = {}  # parameters of its linear model: those without its rounding
    sampling_parameter: ClassVar[str] = "Ts"  # parameter with its sampling period, of a part that has one
    declarations: ClassVar[dict[str, Declaration]] = {}
    placed: ClassVar[dict[str, Placed]] = {}  # blocks by name
    pieces: ClassVar[dict[str, list[Piece]]] = {}  # equations by kind
    layout: ClassVar[list[Scalar]] = []
    states: ClassVar[list[Scalar]] = []
    noises: ClassVar[list[Noise]] = []
    _sampled_noises: ClassVar[list[Noise]] = []  # those whose samples are kept over an internal step

    t = 0.0
    h = 0.0
    step_start = 0.0
    step_end = 0.0

    if TYPE_CHECKING:  # names that blocks declare

        def __getattr__(self, name: str) -> Any: ...

    def __init_subclass__(cls) -> None:
        cls._own = own_items(cls)
        cls._functions = own_equations(cls)
        for kind in EQUATIONS:  # called by name, an equation is that of all bases and blocks
            setattr(cls, kind, vars(Component)[kind])
        declared, cls.placed, by_class = flatten(cls, Component)
        cls.pieces = pieces(cls, Component, by_class)
        if any(isinstance(d, Noise) for d in declared.values()):
            declared.setdefault("seed", Parameter(1, int, "seed of the noise of this instance", min=0))
        if "step" not in declared and (cls.pieces["sampled"] or any(isinstance(d, State) for d in declared.values())):
            declared["step"] = Parameter(1e-3, "s", "largest internal step", above=0.0)
        for n, d in declared.items():
            if hasattr(Component, n) or n in RESERVED:
                raise ComponentError(f"{cls.__name__}.{n}: every component has a {n!r} already, take another name")
            d.name = n
            if d.shape:
                setattr(cls, n, ArraySlot(n))
        if any(p.block.nonlinear for p in _all_placed(cls.placed)):
            cls.nonlinear = True
        cls.declarations = declared
        cls.layout = make_layout(declared)
        cls.states = [s for s in cls.layout if s.section == "state"]
        cls.noises = [d for d in declared.values() if isinstance(d, Noise)]
        cls._sampled_noises = [n for n in cls.noises if n.per != "use"]
        cls._by_name = {s.name: s for s in cls.layout}
        cls.streams = [0, *accumulate(math.prod(n.sample_shape) for n in cls.noises)][:-1]
        ports = list(zip(cls.streams, cls.noises, strict=True))
        cls._ports = {per: [p for p in ports if p[1].per == per] for per in DRAWN}
        cls._inputs = Watched(s for s in cls.layout if s.section == "input")
        cls._watched = Watched(
            s for s in cls.layout if s.section in ("state", "output", "discrete") and not s.is_memory
        )

    _tunable: ClassVar[frozenset[int]] = frozenset()  # parameters that may be set between steps, by value reference
    _derived: ClassVar[tuple[int, ...]] = ()  # what `start` makes of parameters alone: see packaging/tuning.py
    _own: ClassVar[dict[str, Any]] = {}
    _functions: ClassVar[dict[str, Any]] = {}
    _by_name: ClassVar[dict[str, Scalar]] = {}
    streams: ClassVar[list[int]] = []  # of each noise port: number of its (first) random stream
    _ports: ClassVar[dict[str, list[tuple[int, Noise]]]] = {}  # by when they are drawn: first stream and declaration
    _inputs: ClassVar[Watched]  # must be finite before each step
    _watched: ClassVar[Watched]  # and these after it

    def __init__(self, name: str = "", **parameters: Any) -> None:
        self.instance = name or type(self).__name__
        self.reset()
        for key, x in parameters.items():
            if not isinstance(self.declarations.get(key), Parameter):
                known = ", ".join(n for n, d in self.declarations.items() if isinstance(d, Parameter))
                raise ComponentError(f"{self.instance}: no parameter {key!r}; it has {known}")
            if shape_of(x) != self.declarations[key].shape:
                raise ComponentError(f"{self.instance}: {key} has shape {self.declarations[key].shape}")
            setattr(self, key, floats(x))

    # ------------------------------------------------------------------ equations of a part
    def start(self) -> None:
        """Run the ``start`` equations of all bases and blocks: derived values, and refusals."""
        self._equations("start")

    def flow(self) -> None:
        """Run the ``flow`` equations: ``self.der.<state>`` from states, discretes, parameters, inputs, noise."""
        self._equations("flow")

    def outputs(self) -> None:
        """Run the ``outputs`` equations, at the present instant."""
        self._equations("outputs")

    def _equations(self, kind: str) -> None:
        for piece in self.pieces[kind]:
            self._guard(piece)

    def _guard(self, piece: Piece) -> None:
        try:
            piece.function(self if piece.placed is None else self._view(piece.placed))
        except (ArithmeticError, IndexError, ValueError) as e:
            where = f"{piece.function.__name__} at t = {self.t:.9g} s"
            raise ComponentError(f"{self.instance}: {e} in {where}") from e

    def _view(self, placed: Placed) -> View:
        if placed.view is None:
            placed.view = view_of(placed)
        return placed.view(self)

    def refuse(self, condition: Any, message: str) -> None:
        """End the run with ``message`` if the condition holds; ``{H}`` in it prints self.H with %g."""
        if condition:
            self._refused(message.format(**{s.name: f"{self._at(s):g}" for s in self.layout if len(s.path) == 1}))

    def _refused(self, text: str) -> None:
        raise ComponentError(f"{self.instance}: {text} (t = {self.t:.9g} s)")

    # ------------------------------------------------------------------ values
    def _at(self, s: Scalar) -> float:
        x: Any = self
        for key in s.path:
            x = getattr(x, key) if isinstance(key, str) else x[key]
        return float(value(x))  # a dual number, in a refusal while derivatives are taken

    def _put(self, s: Scalar, x: float) -> None:
        box: Any = self
        for key in s.path[:-1]:
            box = getattr(box, key) if isinstance(key, str) else box[key]
        last = s.path[-1]
        if isinstance(last, str):
            setattr(box, last, float(x))
        else:
            box[last] = float(x)
        self._dirty = True

    def set(self, name: str, x: float) -> None:
        """Set a scalar by its FMI name, SI."""
        self._put(self._find(name), x)

    def get(self, name: str) -> float:
        """Return a scalar by its FMI name; outputs follow the present inputs."""
        s = self._find(name)
        if s.section == "output":
            self._refresh()
        return self._at(s)

    def read(self, references: Iterable[int]) -> list[float]:
        """Return values by value reference, as an FMU's get calls do."""
        scalars = [self._referenced(r) for r in references]
        if any(s.section == "output" for s in scalars):
            self._refresh()
        return [self._at(s) for s in scalars]

    def write(self, references: Iterable[int], values: Iterable[float]) -> None:
        """Set values by value reference; of parameters, once initialization has ended, those that are tunable."""
        given = [(self._referenced(r), float(x)) for r, x in zip(references, values, strict=True)]
        if self._running and any(s.section == "parameter" for s, _ in given):
            tune(self, given)
        for s, x in given:
            self._put(s, x)

    def _referenced(self, reference: int) -> Scalar:
        if not 0 <= reference < len(self.layout):
            raise ComponentError(f"{self.instance}: no variable has the value reference {reference}")
        return self.layout[reference]

    def _find(self, name: str) -> Scalar:
        s = self._by_name.get(name)
        if s is None:
            raise ComponentError(f"{self.instance}: no variable {name!r}; it has {', '.join(self._by_name)}")
        return s

    def reset(self) -> None:
        """Return to the state before initialization, every value at its start."""
        self.der = Derivatives()
        self.noise = SimpleNamespace(
            **{n.name: floats(full(0.0, n.sample_shape)) for n in self._sampled_noises},
            **{n.name: OnUse(self, s, n.name) for s, n in self._ports["use"]},
        )
        for d in self.declarations.values():
            setattr(self, d.name, floats(d.start))
            if isinstance(d, State):
                setattr(self.der, d.name, floats(full(0.0, d.shape)))
        self.t = self.h = self.step_start = self.step_end = 0.0
        self._tick = 0
        self._running = False
        self._dirty = True
        self._phi: list[list[float]] = []
        self._phi_h = 0.0
        self._drawn = 0.0

    def get_state(self) -> dict[str, Any]:
        """Return the complete state as plain numbers (exact through JSON)."""
        return {
            "part": f"{type(self).__name__} {self.version}",
            "v": [self._at(s) for s in self.layout],
            "noise": [copied(getattr(self.noise, n.name)) for n in self._sampled_noises],
            **{n: getattr(self, n) for n in TIMES},
            "tick": self._tick,
            "running": self._running,
            "dirty": self._dirty,
            "phi": [list(r) for r in self._phi],
            "phi_h": self._phi_h,
            "drawn": self._drawn,
        }

    def set_state(self, state: dict[str, Any]) -> None:
        if state["part"] != f"{type(self).__name__} {self.version}":
            raise ComponentError(f"{self.instance}: a state of {state['part']} is not one of this part")
        for s, x in zip(self.layout, state["v"], strict=True):
            self._put(s, x)
        for n, x in zip(self._sampled_noises, state["noise"], strict=True):
            setattr(self.noise, n.name, floats(x))
        for time in TIMES:
            setattr(self, time, state[time])
        self._tick = state["tick"]
        self._running, self._dirty = state["running"], state["dirty"]
        self._phi, self._phi_h = [list(r) for r in state["phi"]], state["phi_h"]
        self._drawn = state["drawn"]

    # ------------------------------------------------------------------ running
    def initialize(self, t0: float = 0.0) -> None:
        """Check parameters and inputs, run ``start`` and ``outputs``.  Raises ComponentError."""
        self.t = self.step_start = self.step_end = t0
        check_bounds(self, "parameter", "input", "state")
        self._evaluate_start()
        self._require_finite(self._watched, self.t)
        self._running = True

    def _evaluate_start(self) -> None:
        self._tick = 0
        self._draw("start")
        self._draw("step")
        self.start()
        self.outputs()
        self._dirty = False

    def _refresh(self) -> None:
        if self._dirty:
            if self._running:
                self._equations("outputs")
                self._dirty = False
            else:
                self._evaluate_start()

    def do_step(self, t: float, step: float) -> None:
        """Advance from t to t + step with the inputs held.  Raises ComponentError."""
        if not self._running:
            raise ComponentError(f"{self.instance}: a step before initialization has succeeded")
        if not (math.isfinite(t) and math.isfinite(step) and step > 0.0):
            raise ComponentError(f"{self.instance}: a step must be positive and finite, not {step:g} s")
        self._require_finite(self._inputs, t)
        largest = getattr(self, "step", step)
        n = max(1, math.ceil(step / largest - 1e-9))
        h = step / n
        self.h = h
        self.step_start, self.step_end = t, t + n * h
        for k in range(n):
            self.t = t + k * h
            self._tick += 1
            if h >= ROUNDING * self._drawn:
                self._drawn = h
                self._draw("step")
                self._draw("second")
            if self.states:
                advance(self, h)
            self.t = t + (k + 1) * h
            for piece in self.pieces["sampled"]:
                if self._tick % piece.every == 0:
                    self._guard(piece)
        self.outputs()
        self._dirty = False
        self._require_finite(self._watched, self.t)

    def _require_finite(self, watched: Watched, t: float) -> None:
        """Raise ComponentError naming the first scalar that is not finite."""
        values = self.__dict__
        total = sum([values[n] for n in watched.numbers])  # finite only if all of them are
        if math.isfinite(total) and all([is_finite(values[n]) for n in watched.arrays]):
            return
        for s in watched.scalars:
            if not math.isfinite(self._at(s)):
                raise ComponentError(f"{self.instance}: {s.section} {s.name} is {self._at(s):g} at t = {t:.9g} s")

    # ------------------------------------------------------------------ noise
    def _draw(self, per: str) -> None:
        by = math.sqrt(self.h) if per == "second" else 1.0
        for stream, n in self._ports[per]:
            made = OnUse(self, stream, n.name)
            several = [made[k] / by for k in range(math.prod(n.sample_shape))]
            setattr(self.noise, n.name, Vector(several) if n.sample_shape else several[0])

    # ------------------------------------------------------------------ derivatives
    def _flow(self) -> list[float]:
        self._equations("flow")
        d = self.der
        return [float(dig(getattr(d, s.path[0]), s.path[1:])) for s in self.states]

    def jacobian(self) -> list[list[float]]:
        """Return df/dx at the present point, by forward-mode differentiation of ``flow``."""
        columns = self.tangents([{s.name: 1.0} for s in self.states], outputs=False)
        return [list(r) for r in zip(*(der for der, _ in columns), strict=True)]

    def tangent(self, seeds: dict[str, float]) -> tuple[list[float], list[float]]:
        """Return the derivatives of (state derivatives, outputs) along the direction ``{FMI name: weight}``."""
        return self.tangents([seeds])[0]

    def tangents(self, directions: Iterable[dict[str, float]], outputs: bool = True) -> list[Tangent]:
        """Return :meth:`tangent` along each of these directions; outputs: False leaves those out."""
        return tangents(self, directions, outputs)


def _all_placed(placed: dict[str, Placed]) -> Iterable[Placed]:
    for p in placed.values():
        yield p
        yield from _all_placed(p.blocks)
