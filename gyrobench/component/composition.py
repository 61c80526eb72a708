"""Composition of a part: what its class, its bases and its blocks declare and do, in one flat order.

Declarations and equations (``start``, ``flow``, ``outputs``, ``@sampled`` methods) are collected along the inheritance
order, bases first; within a class those of its blocks come before its own.  All of them run: an equation of a subclass
adds to those of its bases.  Procedures (all other methods) are overridden as in Python, and called by ``super()``.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from types import FunctionType
from typing import TYPE_CHECKING, Any, ClassVar

from gyrobench.component.declarations import Declaration, floats, shape_of
from gyrobench.component.math import value
from gyrobench.component.vectors import copied
from gyrobench.errors import GyrobenchError

EQUATIONS = ("start", "flow", "outputs")
TIMES = ("t", "h", "step_start", "step_end")  # present, internal step, start and end of the communication step
Function = Callable[..., Any]


class ComponentError(GyrobenchError):
    """A part is declared in a way that cannot work, or refuses its parameters, its inputs or its states."""


def sampled(every: int = 1) -> Callable[[Function], Function]:
    """Mark a method that runs after each ``every``-th internal step."""

    def mark(method: Function) -> Function:
        method._every = every  # type: ignore[attr-defined]
        return method

    return mark


class Block:
    """A reusable piece of a part: declarations, equations and procedures that stand in a part as a class attribute.

        class Wander(Block):
            suffixes = {"rms": ""}
            rms = Noise(1.0, "V", "rms", per="step")
            tau = Parameter(10.0, "s", "correlation time", above=0.0)

        class Meter(Component):
            noise_1 = Wander()                   # declares noise_1 (the rms) and noise_1_tau
            noise_2 = Wander(tau="noise_1_tau")  # shares a declaration of the part

    A declaration ``x`` of a block that stands in a part as ``name`` is the part's ``name_x``; ``suffixes`` gives
    another ending, or none.  Keywords of the constructor replace declarations: by another one of the same kind, by a
    start value, or by the name of a declaration of the part, which is then shared.  Equations of a block know its own
    names (and the times, ``self.der``, ``self.noise``); the part calls its procedures by
    ``self.name.procedure(...)``.  In the text of a refusal ``{self}`` is the name under which the block stands.
    """

    suffixes: ClassVar[dict[str, str]] = {}
    nonlinear: ClassVar[bool] = False  # True: its equations are not linear in the states

    if TYPE_CHECKING:  # what its equations find in the part

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...

    def __init__(self, **given: Any) -> None:
        self.given = given
        self.name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, part: Any, owner: type) -> Any:
        return self if part is None else part._view(part.placed[self.name])


@dataclass
class Placed:
    """A block in its part: where its names lead."""

    block: Block
    name: str  # in the part
    names: dict[str, str] = field(default_factory=dict)  # declaration of the block -> of the part
    blocks: dict[str, Placed] = field(default_factory=dict)
    view: type[View] | None = None  # made when it is first looked at


@dataclass(frozen=True)
class Piece:
    """One equation method: who defines it, and the block it belongs to (None: the part itself)."""

    function: Function
    owner: type
    placed: Placed | None
    every: int = 0  # of a sampled method


class View:
    """A block of one instance of a part: ``self`` of its equations.  Each block in a part has a class of its own."""

    __slots__ = ("_part",)
    _part: Any
    _placed: ClassVar[Placed]

    def __init__(self, part: Any) -> None:
        object.__setattr__(self, "_part", part)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._placed.names:
            raise AttributeError(f"{self._placed.name}: {name} is not declared in {type(self._placed.block).__name__}")
        setattr(self._part, self._placed.names[name], value)

    def refuse(self, condition: Any, message: str) -> None:
        """End the run with ``message`` if the condition holds, as :meth:`Component.refuse`."""
        if condition:
            placed = self._placed
            values = {n: getattr(self._part, flat) for n, flat in placed.names.items()}
            shown = {n: f"{float(value(x)):g}" for n, x in values.items() if not isinstance(x, list)}
            self._part._refused(message.format(self=placed.name, **shown))


def view_of(placed: Placed) -> type[View]:
    """Return the class of the views of a block: its names lead to those of the part."""
    kind = type(placed.block)
    inside: dict[str, Any] = {n: property(attrgetter(f"_part.{n}")) for n in TIMES}
    inside["der"] = property(lambda view: _Names(view._part.der, placed.names))
    inside["noise"] = property(lambda view: _Names(view._part.noise, placed.names))
    for n, inner in placed.blocks.items():
        inside[n] = property(lambda view, inner=inner: view._part._view(inner))  # type: ignore[misc]
    for n, flat in placed.names.items():
        inside[n] = property(attrgetter(f"_part.{flat}"))
    # a subclass of the block's class, so that super() finds its bases
    return type(kind.__name__, (View, kind), {**inside, "__slots__": (), "_placed": placed})


class _Names:
    """The derivatives, or the noise samples, of a block."""

    __slots__ = ("_names", "_of")

    def __init__(self, of: Any, names: dict[str, str]) -> None:
        object.__setattr__(self, "_of", of)
        object.__setattr__(self, "_names", names)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._of, self._names[name])

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._of, self._names[name], value)


def stored(name: str) -> str:
    """Return the name under which an array stands in the ``__dict__`` of its part."""
    return f"{name}[]"


class ArraySlot(property):
    """An array of a part: what is assigned to it is copied, as in C."""

    def __init__(self, name: str) -> None:
        def assign(part: Any, value: Any, name: str = stored(name)) -> None:
            part.__dict__[name] = copied(value)

        super().__init__(attrgetter(stored(name)), assign)  # reading it calls no Python


class Derivatives:
    """``self.der``: the derivatives of the states."""

    def __setattr__(self, name: str, value: Any) -> None:
        self.__dict__[name] = copied(value)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"der.{name}: no such state")


# ------------------------------------------------------------------------------------------ collection
def own_items(cls: type) -> dict[str, Any]:
    """Return what a class itself declares: name -> Declaration or Block."""
    if "_own" in vars(cls):
        items: dict[str, Any] = vars(cls)["_own"]
        return items
    return {n: v for n, v in vars(cls).items() if isinstance(v, Declaration | Block)}


def own_equations(cls: type) -> dict[str, Function]:
    """Return the equation methods that a class itself defines, in their order."""
    if "_functions" in vars(cls):
        functions: dict[str, Function] = vars(cls)["_functions"]
        return functions
    return {n: f for n, f in vars(cls).items() if callable(f) and (n in EQUATIONS or hasattr(f, "_every"))}


def lineage(cls: type, base: type) -> Iterator[type]:
    """Yield the classes that make up ``cls``, bases first, without ``base`` and object."""
    return (k for k in reversed(cls.__mro__) if k not in (object, base, Block))


def items_of(cls: type, base: type) -> dict[str, tuple[type, Any]]:
    """Return name -> (class that declares it, declaration or block), along the inheritance order.

    Raises ComponentError where a declaration would be lost: two bases that declare one name, a method or a constant
    that hides a declaration, a declaration of another kind or shape in a subclass, one that stands in a list.
    """
    items: dict[str, tuple[type, Any]] = {}
    for klass in lineage(cls, base):
        declared_here = own_items(klass)
        for name, item in vars(klass).items():
            if hasattr(base, name):
                continue
            if name in items and name not in declared_here and not isinstance(item, ArraySlot):
                where = items[name][0].__name__
                raise ComponentError(
                    f"{klass.__name__}.{name} hides a declaration of {where}: take another name, or declare it again "
                    f"({name} = {type(items[name][1]).__name__}(...)) to change its start or bounds"
                )
            inside = list(item.values()) if isinstance(item, dict) else item
            if isinstance(inside, list | tuple) and any(isinstance(x, Declaration | Block) for x in inside):
                raise ComponentError(f"{klass.__name__}.{name}: a declaration inside a list is lost: give it a name")
        for name, item in declared_here.items():
            if name in items:
                _redeclared(klass, name, item, *items[name])
            items[name] = (klass, item)
    return items


def _redeclared(klass: type, name: str, item: Any, before: type, old: Any) -> None:
    if not issubclass(klass, before):
        raise ComponentError(
            f"{klass.__name__} and {before.__name__} both declare {name!r}: rename one, or declare it in a common base"
        )
    same = type(item) is type(old) or (isinstance(item, type(old)) or isinstance(old, type(item)))
    if not same or (isinstance(item, Declaration) and item.shape != old.shape):
        raise ComponentError(
            f"{klass.__name__}.{name} must be declared as in {before.__name__}: {type(old).__name__}"
            + (f" of shape {old.shape}" if isinstance(old, Declaration) and old.shape else "")
        )


def flatten(cls: type, base: type) -> tuple[dict[str, Declaration], dict[str, Placed], dict[type, list[Placed]]]:
    """Return the declarations of a part by flat name, its blocks by name, and the blocks that each class brings."""
    declarations: dict[str, Declaration] = {}
    placed: dict[str, Placed] = {}
    by_class: dict[type, list[Placed]] = {}
    taken: dict[str, str] = {}

    def add(flat: str, d: Declaration, where: str) -> None:
        if flat in declarations:
            raise ComponentError(f"{cls.__name__}: {flat!r} is declared by {taken[flat]} and by {where}")
        declarations[flat], taken[flat] = copy.copy(d), where
        declarations[flat].name = flat

    def place(block: Block, name: str, outside: dict[str, str], where: str) -> Placed:
        kind = type(block)
        p = Placed(block, name)
        items = {n: item for n, (_, item) in items_of(kind, Block).items()}
        unknown = [n for n in block.given if n not in items]
        if unknown:
            raise ComponentError(f"{where}: {kind.__name__} declares no {unknown[0]!r}; it has {', '.join(items)}")
        for n, item in items.items():
            suffix = kind.suffixes.get(n, n)
            flat = f"{name}_{suffix}" if suffix else name
            if isinstance(item, Block):
                p.blocks[n] = place(item, flat, p.names, where)
                continue
            given = block.given.get(n, item)
            if isinstance(given, str):
                shared = outside.get(given, given)
                p.names[n] = shared
                continue
            if not isinstance(given, Declaration):
                given = _restarted(item, given, f"{where}, {n}")
            elif not isinstance(given, type(item)):
                raise ComponentError(
                    f"{where}: {n} is a {type(item).__name__} of {kind.__name__}, not {type(given).__name__}"
                )
            add(flat, given, where)
            p.names[n] = flat
        return p

    for name, (klass, item) in items_of(cls, base).items():
        where = f"{klass.__name__}.{name}"
        if isinstance(item, Block):
            placed[name] = place(item, name, {}, where)
            by_class.setdefault(klass, []).append(placed[name])
        else:
            add(name, item, where)
    for p in placed.values():
        missing = [n for n in p.names.values() if n not in declarations]
        if missing:
            raise ComponentError(
                f"{cls.__name__}.{p.name} shares {missing[0]!r}, which {cls.__name__} does not declare"
            )
    return declarations, placed, by_class


def _restarted(d: Declaration, start: Any, where: str) -> Declaration:
    new = copy.copy(d)
    new.start = floats(start)
    new.shape = shape_of(new.start)
    if new.shape != d.shape:
        raise ComponentError(f"{where}: the start value has shape {new.shape}, not {d.shape}")
    return new


def pieces(cls: type, base: type, by_class: dict[type, list[Placed]]) -> dict[str, list[Piece]]:
    """Return the equations by kind (EQUATIONS and "sampled"), in the order in which they run."""
    by_kind: dict[str, list[Piece]] = {kind: [] for kind in (*EQUATIONS, "sampled")}

    def collect(klass: type, placed: Placed | None) -> None:
        _refuse_super(klass, base if placed is None else Block)
        for name, f in own_equations(klass).items():
            every = getattr(f, "_every", 0)
            by_kind["sampled" if every else name].append(Piece(f, klass, placed, every))

    def block(p: Placed) -> None:
        for inner in p.blocks.values():
            block(inner)
        for klass in lineage(type(p.block), Block):
            collect(klass, p)

    for klass in lineage(cls, base):
        for p in by_class.get(klass, []):
            block(p)
        collect(klass, None)
    return by_kind


def _refuse_super(klass: type, base: type) -> None:
    """Raise ComponentError where a class calls an equation of its bases, which would run twice."""
    equations = {*EQUATIONS, *(n for k in lineage(klass, base) for n in own_equations(k))}
    for name, f in {**vars(klass), **own_equations(klass)}.items():
        if not isinstance(f, FunctionType) or name.startswith("__") or "super" not in f.__code__.co_names:
            continue
        import dis  # costs a hundredth of a second, which few parts need

        for call in dis.get_instructions(f):
            attribute = call.opname in ("LOAD_METHOD", "LOAD_ATTR", "LOAD_SUPER_ATTR")
            if attribute and call.argval in equations and call.positions is not None:
                raise ComponentError(
                    f"{f.__code__.co_filename}:{call.positions.lineno}: {klass.__name__}.{name}: the equations of the "
                    f"bases run by themselves, before those of this class: leave out super().{call.argval}(); what a "
                    "subclass is to change stands in a procedure, which super() may call"
                )
