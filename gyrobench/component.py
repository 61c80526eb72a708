"""What a component (a part of the bench) is.

A part is one class of declarations and equations.  The class is the single source of the plain Python
part, the Python FMU, the native FMU (its equations translated to C), the model description and the
linearization.  This module and ``math.py`` are all that a part needs to run: a Python FMU carries
copies of these two files and nothing else of gyrobench.

Stepping, identical in every target.  A communication step ``[t, t + H]`` is cut into
``n = ceil(H / step)`` equal internal steps ``h = H / n`` with the inputs held.  In each one

1.  the noise of this internal step is drawn (counter-based: it depends on ``seed``, the port and the
    count of internal steps, on nothing else);
2.  the states advance, by the exponential Euler step ``x+ = x + h phi1(h A) f(x)`` with
    ``A = df/dx`` (exact when f is linear in x) or by RK4 with declared substeps;
3.  the ``@sampled`` methods whose turn it is run, with ``self.t`` at the end of the internal step.

After the last one ``outputs`` is evaluated and everything is checked to be finite.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from statistics import NormalDist
from types import SimpleNamespace
from typing import Any, ClassVar

from gyrobench.math import Dual

Shape = tuple[int, ...]
MASK = (1 << 64) - 1
GAMMA = 0x9E3779B97F4A7C15
TAYLOR = 18  # terms of phi1: the first left out is below 1e-17 for a norm of 1/2
_normal = NormalDist().inv_cdf


class PartError(Exception):
    """A part refuses its parameters, its inputs, or what became of its states."""


# ---------------------------------------------------------------------------------- declarations
def _shape(start: Any) -> Shape:
    return (len(start), *_shape(start[0])) if isinstance(start, list | tuple) else ()


def _full(value: Any, shape: Shape) -> Any:
    return [_full(value, shape[1:]) for _ in range(shape[0])] if shape else value


def _floats(x: Any) -> Any:
    return [_floats(e) for e in x] if isinstance(x, list | tuple) else float(x)


class Declaration:
    """A named quantity of a part: ``unit`` is a unit string, or ``int`` or ``bool`` for those types."""

    name = ""

    def __init__(
        self,
        start: Any,
        unit: str | type,
        doc: str = "",
        *,
        min: float | None = None,
        max: float | None = None,
        above: float | None = None,
        below: float | None = None,
    ) -> None:
        self.start = _floats(start)
        self.shape = _shape(start)
        self.type: type = unit if isinstance(unit, type) else float
        self.unit = "1" if isinstance(unit, type) else unit
        self.doc = doc
        self.min, self.max, self.above, self.below = min, max, above, below

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def bound_broken(self, x: float) -> str | None:
        """The bound that x breaks, in words; NaN breaks every bound."""
        if not math.isfinite(x):
            return "finite"
        for limit, word, ok in (
            (self.min, ">=", operator.ge),
            (self.max, "<=", operator.le),
            (self.above, ">", operator.gt),
            (self.below, "<", operator.lt),
        ):
            if limit is not None and not ok(x, limit):
                return f"{word} {limit:g}"
        return None


class Parameter(Declaration):
    """Fixed from initialization on.  ``min``/``max`` are inclusive bounds, ``above``/``below`` exclusive."""


class Input(Declaration):
    """Held over a communication step."""


class State(Declaration):
    """Continuous; ``flow`` writes its derivative to ``self.der.<name>``."""


class Discrete(Declaration):
    """Changed by ``start`` and by ``@sampled`` methods only."""


class Output(Declaration):
    """Written by ``outputs``."""

    def __init__(self, unit: str | type, doc: str = "", shape: Shape = ()) -> None:
        super().__init__(_full(0.0, shape), unit, doc)


class Noise(Parameter):
    """A noise port; its size is a parameter of the same name, its sample is ``self.noise.<name>``.

    ``per="second"``: white, the size is the two-sided density (unit/sqrt(Hz)); a sample is
    ``size * xi / sqrt(h)``, so the mean over a time T has variance ``size**2 / T`` whatever the step.
    ``per="step"``: ``size * xi``, one for each internal step.  ``per="start"``: drawn once.
    A port of size 0 draws nothing.
    """

    def __init__(self, start: float, unit: str, doc: str = "", *, per: str = "second") -> None:
        if per not in ("second", "step", "start"):
            raise ValueError(f'Noise(per="{per}"): one of "second", "step", "start"')
        super().__init__(start, unit, doc, min=0.0)
        self.per = per


def sampled(every: int = 1) -> Callable[[Callable[[Any], None]], Callable[[Any], None]]:
    """Marks a method that runs after each ``every``-th internal step."""

    def mark(method: Callable[[Any], None]) -> Callable[[Any], None]:
        method._every = every  # type: ignore[attr-defined]
        return method

    return mark


# ---------------------------------------------------------------------------------------- layout
SECTIONS = ("parameter", "input", "output", "state", "derivative", "discrete")


@dataclass(frozen=True)
class Scalar:
    """One scalar of a part: its FMI name, its place, its value reference."""

    name: str  # "omega[1]", "der(b)"
    section: str  # one of SECTIONS
    path: tuple[Any, ...]  # ("omega", 0) or ("der", "b")
    decl: Declaration
    reference: int
    start: float


def _flat(x: Any, path: tuple[int, ...] = ()) -> Iterator[tuple[tuple[int, ...], float]]:
    if isinstance(x, list):
        for i, e in enumerate(x):
            yield from _flat(e, (*path, i))
    else:
        yield path, x


def _layout(decls: dict[str, Declaration]) -> list[Scalar]:
    kind = {"parameter": Parameter, "input": Input, "output": Output, "state": State, "discrete": Discrete}
    out: list[Scalar] = []
    for section in SECTIONS:
        for d in decls.values():
            if not isinstance(d, kind.get(section, State)):
                continue
            derivative = section == "derivative"
            for p, start in _flat(d.start):
                name = d.name + ("[" + ",".join(str(i + 1) for i in p) + "]" if p else "")
                path = ("der", d.name, *p) if derivative else (d.name, *p)
                name = f"der({name})" if derivative else name
                out.append(Scalar(name, section, path, d, len(out), 0.0 if derivative else start))
    return out


class Component:
    """Base of every part: collects the declarations and steps the equations (see the module's text)."""

    version: ClassVar[str] = "1.0.0"
    integrator: ClassVar[str] = "exponential"  # or "rk4"
    rk4_substeps: ClassVar[int] = 20  # of one internal step
    nonlinear: ClassVar[bool] = False  # True: A is taken anew at each internal step
    declarations: ClassVar[dict[str, Declaration]] = {}
    layout: ClassVar[list[Scalar]] = []
    states: ClassVar[list[Scalar]] = []
    noises: ClassVar[list[Noise]] = []
    ticks: ClassVar[list[tuple[str, int]]] = []

    t = 0.0
    h = 0.0

    def __init_subclass__(cls) -> None:
        found = {n: d for n, d in vars(cls).items() if isinstance(d, Declaration)}
        if any(isinstance(d, Noise) for d in found.values()):
            found["seed"] = Parameter(1, int, "seed of the noise of this instance", min=0)
        methods = {n: m for n, m in vars(cls).items() if hasattr(m, "_every")}
        if "step" not in found and (methods or any(isinstance(d, State) for d in found.values())):
            found["step"] = Parameter(1e-3, "s", "largest internal step", above=0.0)
        for n, d in found.items():
            d.name = n
        cls.declarations = found
        cls.layout = _layout(found)
        cls.states = [s for s in cls.layout if s.section == "state"]
        cls.noises = [d for d in found.values() if isinstance(d, Noise)]
        cls.ticks = [(n, m._every) for n, m in methods.items()]
        cls._by_name = {s.name: s for s in cls.layout}

    _by_name: ClassVar[dict[str, Scalar]] = {}

    def __init__(self, name: str = "", **parameters: Any) -> None:
        self.instance = name or type(self).__name__
        self.reset()
        for key, x in parameters.items():
            if not isinstance(self.declarations.get(key), Parameter):
                known = ", ".join(n for n, d in self.declarations.items() if isinstance(d, Parameter))
                raise PartError(f"{self.instance}: no parameter {key!r}; it has {known}")
            if _shape(x) != self.declarations[key].shape:
                raise PartError(f"{self.instance}: {key} has shape {self.declarations[key].shape}")
            setattr(self, key, _floats(x))

    # ------------------------------------------------------------------ equations of a part
    def start(self) -> None:
        """Once, when initialization ends: derived values, and refusals."""

    def flow(self) -> None:
        """``self.der.<state>`` from states, discretes, parameters, inputs, noise."""

    def outputs(self) -> None:
        """Outputs, at the present instant."""

    def refuse(self, condition: Any, message: str) -> None:
        """Ends the run with ``message`` if the condition holds; ``{H}`` in it prints self.H with %g."""
        if condition:
            values = {s.name: f"{self._at(s):g}" for s in self.layout if len(s.path) == 1}
            raise PartError(f"{self.instance}: {message.format(**values)} (t = {self.t:.9g} s)")

    # ------------------------------------------------------------------ values
    def _at(self, s: Scalar) -> float:
        x: Any = self
        for key in s.path:
            x = getattr(x, key) if isinstance(key, str) else x[key]
        return float(x)

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
        """Sets a scalar by its FMI name, SI."""
        self._put(self._find(name), x)

    def get(self, name: str) -> float:
        """A scalar by its FMI name; outputs follow the present inputs."""
        s = self._find(name)
        if s.section == "output":
            self._refresh()
        return self._at(s)

    def _find(self, name: str) -> Scalar:
        s = self._by_name.get(name)
        if s is None:
            raise PartError(f"{self.instance}: no variable {name!r}; it has {', '.join(self._by_name)}")
        return s

    def reset(self) -> None:
        """Back to before initialization, every value at its start."""
        self.der = SimpleNamespace()
        self.noise = SimpleNamespace(**{n.name: 0.0 for n in self.noises})
        for d in self.declarations.values():
            setattr(self, d.name, _floats(d.start))
            if isinstance(d, State):
                setattr(self.der, d.name, _floats(_full(0.0, d.shape)))
        self.t = self.h = 0.0
        self._tick = 0
        self._running = False
        self._dirty = True
        self._phi: list[list[float]] = []
        self._phi_h = 0.0

    def get_state(self) -> dict[str, Any]:
        """Everything that decides the future, as plain numbers (exact through JSON)."""
        return {
            "v": [self._at(s) for s in self.layout],
            "noise": [getattr(self.noise, n.name) for n in self.noises],
            "t": self.t,
            "h": self.h,
            "tick": self._tick,
            "running": self._running,
            "dirty": self._dirty,
            "phi": [list(r) for r in self._phi],
            "phi_h": self._phi_h,
        }

    def set_state(self, state: dict[str, Any]) -> None:
        for s, x in zip(self.layout, state["v"], strict=True):
            self._put(s, x)
        for n, x in zip(self.noises, state["noise"], strict=True):
            setattr(self.noise, n.name, x)
        self.t, self.h, self._tick = state["t"], state["h"], state["tick"]
        self._running, self._dirty = state["running"], state["dirty"]
        self._phi, self._phi_h = [list(r) for r in state["phi"]], state["phi_h"]

    # ------------------------------------------------------------------ running
    def initialize(self, t0: float = 0.0) -> None:
        """Checks parameters and inputs, runs ``start`` and ``outputs``.  Raises PartError."""
        self.t = t0
        for s in self.layout:
            if s.section in ("parameter", "input", "state"):
                x = self._at(s)
                wrong = s.decl.bound_broken(x)
                if wrong:
                    raise PartError(f"{self.instance}: {s.section} {s.name} = {x:g} {s.decl.unit} must be {wrong}")
        self._evaluate_start()
        self._finite()
        self._running = True

    def _evaluate_start(self) -> None:
        self._tick = 0
        self._draw("start")
        self._draw("step")
        self._guard(self.start)
        self._guard(self.outputs)
        self._dirty = False

    def _refresh(self) -> None:
        if self._dirty:
            if self._running:
                self._guard(self.outputs)
                self._dirty = False
            else:
                self._evaluate_start()

    def do_step(self, t: float, step: float) -> None:
        """Advances from t to t + step with the inputs held.  Raises PartError."""
        if not (math.isfinite(t) and math.isfinite(step) and step > 0.0):
            raise PartError(f"{self.instance}: a step must be positive and finite, not {step:g} s")
        for s in self.layout:
            if s.section == "input":
                x = self._at(s)
                if not math.isfinite(x):
                    raise PartError(f"{self.instance}: input {s.name} is {x:g} at t = {t:.9g} s")
        largest = getattr(self, "step", step)
        n = max(1, math.ceil(step / largest - 1e-9))
        h = step / n
        self.h = h
        for k in range(n):
            self.t = t + k * h
            self._tick += 1
            self._draw("step")
            self._draw("second")
            if self.states:
                self._advance(h)
            self.t = t + (k + 1) * h
            for name, every in self.ticks:
                if self._tick % every == 0:
                    self._guard(getattr(self, name))
        self._guard(self.outputs)
        self._dirty = False
        self._finite()

    def _guard(self, method: Callable[[], None]) -> None:
        try:
            method()
        except (ArithmeticError, ValueError) as e:
            where = f"{method.__name__} at t = {self.t:.9g} s"
            raise PartError(f"{self.instance}: {e} in {where}") from e

    def _finite(self) -> None:
        for s in self.layout:
            if s.section in ("state", "output", "discrete"):
                x = self._at(s)
                if not math.isfinite(x):
                    raise PartError(f"{self.instance}: {s.section} {s.name} is {x:g} at t = {self.t:.9g} s")

    # ------------------------------------------------------------------ noise
    def _draw(self, per: str) -> None:
        for port, n in enumerate(self.noises):
            if n.per != per:
                continue
            size = getattr(self, n.name)
            x = 0.0
            if size != 0.0:
                x = size * normal(int(self.seed), port, self._tick)  # type: ignore[attr-defined]
                if per == "second":
                    x = x / math.sqrt(self.h)
            setattr(self.noise, n.name, x)

    # ------------------------------------------------------------------ integration
    def _flow(self) -> list[float]:
        self._guard(self.flow)
        d = self.der
        return [float(_dig(getattr(d, s.path[0]), s.path[1:])) for s in self.states]

    def jacobian(self) -> list[list[float]]:
        """df/dx at the present point, by forward-mode differentiation of ``flow``."""
        return [list(r) for r in zip(*(self.tangent({s.name: 1.0})[0] for s in self.states), strict=True)]

    def tangent(self, seeds: dict[str, float]) -> tuple[list[float], list[float]]:
        """Derivatives of (state derivatives, outputs) along the direction ``{FMI name: weight}``."""
        twin = object.__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.der = SimpleNamespace()
        for name, d in self.declarations.items():
            setattr(twin, name, _dual(getattr(self, name)))
            if isinstance(d, State):
                setattr(twin.der, name, _dual(getattr(self.der, name)))
        twin.noise = SimpleNamespace(**{k: Dual(v) for k, v in vars(self.noise).items()})
        for name, weight in seeds.items():
            s = self._find(name)
            _dig(getattr(twin, s.path[0]), s.path[1:]).d = weight
        twin._guard(twin.flow)
        twin._guard(twin.outputs)
        der = [_dig(getattr(twin.der, s.path[0]), s.path[1:]).d for s in self.states]
        out = [_dig(getattr(twin, s.path[0]), s.path[1:]) for s in self.layout if s.section == "output"]
        return der, [y.d if isinstance(y, Dual) else 0.0 for y in out]

    def _advance(self, h: float) -> None:
        if self.integrator == "rk4":
            self._advance_rk4(h)
            return
        if self.nonlinear or h != self._phi_h:
            self._phi = phi1([[a * h for a in row] for row in self.jacobian()])
            self._phi_h = h
        f = self._flow()
        for s, row in zip(self.states, self._phi, strict=True):
            dx = 0.0
            for p, fj in zip(row, f, strict=True):
                dx = dx + p * fj
            self._put(s, self._at(s) + h * dx)

    def _advance_rk4(self, h: float) -> None:
        t, dt = self.t, h / self.rk4_substeps
        for k in range(self.rk4_substeps):
            x = [self._at(s) for s in self.states]

            def move(f: list[float], by: float, x: list[float] = x) -> None:
                for s, xi, fi in zip(self.states, x, f, strict=True):
                    self._put(s, xi + by * fi)

            self.t = t + k * dt
            k1 = self._flow()
            self.t = t + (k + 0.5) * dt
            move(k1, 0.5 * dt)
            k2 = self._flow()
            move(k2, 0.5 * dt)
            k3 = self._flow()
            self.t = t + (k + 1) * dt
            move(k3, dt)
            k4 = self._flow()
            sums = [a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
            move(sums, dt / 6.0)


# ------------------------------------------------------------------------------------ numerics
def _dig(x: Any, path: tuple[Any, ...]) -> Any:
    for i in path:
        x = x[i]
    return x


def _dual(x: Any) -> Any:
    return [_dual(e) for e in x] if isinstance(x, list) else Dual(float(x))


def _mix(z: int) -> int:
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def normal(seed: int, port: int, count: int) -> float:
    """A standard normal number that depends on its three arguments alone.

    Counter-based: the SplitMix64 output function over (key + count * gamma), where the key is itself a
    hash of seed and port; then the inverse normal distribution function (Wichura's AS 241).
    """
    key = _mix((_mix((seed + 1) * GAMMA & MASK) + (port + 1) * GAMMA) & MASK)
    z = _mix((key + count * GAMMA) & MASK)
    return _normal(((z >> 11) + 0.5) * 2.0**-53)


def _product(a: list[list[float]], b: list[list[float]]) -> list[list[float]]:
    n = len(a)
    out = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total = total + a[i][k] * b[k][j]
            out[i][j] = total
    return out


def phi1(z: list[list[float]]) -> list[list[float]]:
    """phi1(z) = sum z^k / (k+1)!  by Taylor on z / 2^s and doubling phi1(2z) = phi1(z) (I + z phi1(z) / 2)."""
    n = len(z)
    norm = max(sum(abs(a) for a in row) for row in z)
    if not norm < 1e300:
        norm = 0.0  # not finite: found by the check of the states
    s = 0
    while norm > 0.5:
        norm = norm * 0.5
        s += 1
    scale = 0.5**s
    z = [[a * scale for a in row] for row in z]
    out = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    for k in range(TAYLOR, 1, -1):  # Horner: I + z/2 (I + z/3 (I + ...))
        out = _product(z, out)
        out = [[out[i][j] / k + (1.0 if i == j else 0.0) for j in range(n)] for i in range(n)]
    for _ in range(s):
        g = _product(z, out)
        g = [[0.5 * g[i][j] + (1.0 if i == j else 0.0) for j in range(n)] for i in range(n)]
        out = _product(out, g)
        z = [[2.0 * a for a in row] for row in z]
    return out
