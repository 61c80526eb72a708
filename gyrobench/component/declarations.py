"""Declarations of a part (parameters, inputs, states ...) and their layout as a list of scalars."""

from __future__ import annotations

import itertools
import math
import operator
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, overload

from gyrobench.component.vectors import Vector

Shape = tuple[int, ...]


def shape_of(start: Any) -> Shape:
    return (len(start), *shape_of(start[0])) if isinstance(start, list | tuple) else ()


def full(value: Any, shape: Shape) -> Any:
    return Vector([full(value, shape[1:]) for _ in range(shape[0])]) if shape else value


def floats(x: Any) -> Any:
    return Vector([floats(e) for e in x]) if isinstance(x, list | tuple) else float(x)


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
        quantity: str = "",
    ) -> None:
        if not isinstance(unit, str | type) or not isinstance(doc, str):
            raise TypeError(f"unit {unit!r}, description {doc!r}: texts are expected: Parameter(0.2, 'N.m', 'torque')")
        self.start = floats(start)
        self.shape = shape_of(start)
        self.type: type = unit if isinstance(unit, type) else float
        self.unit = "1" if isinstance(unit, type) else unit
        self.doc = doc
        self.quantity = quantity  # "angle", "rate": what a signal in V or A stands for; goes into the model description
        self.min, self.max, self.above, self.below = min, max, above, below

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    if TYPE_CHECKING:  # in the equations a declared name is a number, or a vector

        @overload
        def __get__(self, part: None, owner: type) -> Declaration: ...
        @overload
        def __get__(self, part: object, owner: type) -> Any: ...
        def __get__(self, part: object, owner: type) -> Any: ...
        def __set__(self, part: object, value: Any) -> None: ...

    def bound_broken(self, x: float) -> str | None:
        """Return the bound that x violates, in words; NaN breaks every bound."""
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
    """Not changed by the part.  ``min``/``max`` are inclusive bounds, ``above``/``below`` exclusive."""


class Input(Declaration):
    """Held over a communication step."""


class State(Declaration):
    """Continuous; ``flow`` writes its derivative to ``self.der.<name>``."""


class Discrete(Declaration):
    """Changed by ``start`` and by ``@sampled`` methods only."""


class Output(Declaration):
    """Written by ``outputs``."""

    def __init__(self, unit: str | type, doc: str = "", shape: Shape = ()) -> None:
        super().__init__(full(0.0, shape), unit, doc)


DRAWN = ("start", "step", "second", "use")  # when noise is drawn


class Noise(Parameter):
    """A noise port; its size is a parameter of the same name, its sample is ``self.noise.<name>``.

    ``per="second"``: white, the size is the two-sided density (unit/sqrt(Hz)); a sample is
    ``size * xi / sqrt(h)``, so the mean over a time T has variance ``size**2 / T`` whatever the step.
    ``per="step"``: ``size * xi``, one for each internal step.  ``per="start"``: drawn once.
    ``per="use"``: as ``step``, but made only where ``start`` or a sampled method reads it: a step needs few of many.
    A port of size 0 draws nothing.  ``samples=n``: the sample is a vector of n independent numbers of that size.
    """

    def __init__(self, start: float, unit: str, doc: str = "", *, per: str = "second", samples: int = 0) -> None:
        if per not in DRAWN:
            raise ValueError(f'Noise(per="{per}"): one of "start", "step", "second", "use"')
        if per == "use" and not samples:
            raise ValueError('Noise(per="use"): of samples=n numbers, of which each is made where it is read')
        super().__init__(start, unit, doc, min=0.0)
        self.per = per
        self.sample_shape: Shape = (samples,) if samples else ()


MEMORY = 64  # elements; a larger discrete array is a memory
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

    @property
    def is_memory(self) -> bool:
        """An element of a large discrete array: its content is not checked until it is read."""
        return self.section == "discrete" and math.prod(self.decl.shape) > MEMORY


def _flat(x: Any, path: tuple[int, ...] = ()) -> Iterator[tuple[tuple[int, ...], float]]:
    if isinstance(x, list):
        for i, e in enumerate(x):
            yield from _flat(e, (*path, i))
    else:
        yield path, x


def element_names(name: str, shape: Shape) -> list[str]:
    """FMI names of the elements of an array, row by row: ``face[1,1]``, ``face[1,2]``, ``der(q[1])``."""
    if not shape:
        return [name]
    if name.startswith("der("):
        return [f"der({n})" for n in element_names(name[4:-1], shape)]
    return [f"{name}[{','.join(map(str, at))}]" for at in itertools.product(*(range(1, n + 1) for n in shape))]


def make_layout(decls: dict[str, Declaration]) -> list[Scalar]:
    kind = {"parameter": Parameter, "input": Input, "output": Output, "state": State, "discrete": Discrete}
    out: list[Scalar] = []
    for section in SECTIONS:
        for d in decls.values():
            if not isinstance(d, kind.get(section, State)):
                continue
            derivative = section == "derivative"
            names = element_names(f"der({d.name})" if derivative else d.name, d.shape)
            for name, (p, start) in zip(names, _flat(d.start), strict=True):
                path = ("der", d.name, *p) if derivative else (d.name, *p)
                out.append(Scalar(name, section, path, d, len(out), 0.0 if derivative else start))
    return out
