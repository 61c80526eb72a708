"""Places of equations in C: variables of a part, locals, elements and slices of arrays, temporaries."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from gyrobench.component import Noise, State
from gyrobench.component.composition import TIMES
from gyrobench.packaging.c_arrays import CExpression, CVariable, Range, Shape, Span, cells
from gyrobench.packaging.source import Code, SubsetError, dotted, local, member

if TYPE_CHECKING:
    from gyrobench.packaging.translation import Translation

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "d_add"),
    ast.Sub: ("-", "d_sub"),
    ast.Mult: ("*", "d_mul"),
    ast.Div: ("/", "d_div"),
}


class Places(ABC):
    """Finds what the names, attributes and subscripts of one method stand for."""

    def __init__(self, translation: Translation, code: Code, dual: bool, shapes: tuple[Shape, ...] = ()) -> None:
        self.translation, self.code, self.dual = translation, code, dual
        self.declared = translation.source.cls.declarations
        self.locals: dict[str, Shape] = {}  # temporaries too, under their C names
        self.bare: set[str] = set()  # locals made from a list: no arithmetic in Python
        self.loops: dict[str, Range] = {}
        self.arguments = dict(zip(code.arguments, shapes, strict=True))
        self.assigned = set(self.arguments)  # locals that surely have a value here
        self.pre: list[str] = []  # statements that come before the current one
        self.temporaries = 0
        self.touched: set[str] = set()  # flat names that are written, here or in what is called

    def refuse(self, node: ast.AST, what: str) -> SubsetError:
        return self.code.refuse(node, what)

    def index(self, e: ast.expr) -> tuple[str, Range]:
        """Return an index, counted from 0, and its range: loop variables, literals, + - *, and index(expr)."""
        if isinstance(e, ast.Constant) and isinstance(e.value, int):
            return str(e.value), (e.value, e.value)
        if isinstance(e, ast.Name) and e.id in self.loops:
            return local(e.id), self.loops[e.id]
        if isinstance(e, ast.Name) and (x := self.code.constant(e.id)) is not None:
            return str(int(x)), (int(x), int(x))
        if isinstance(e, ast.BinOp) and isinstance(e.op, ast.Add | ast.Sub | ast.Mult):
            (a, (a0, a1)), (b, (b0, b1)) = self.index(e.left), self.index(e.right)
            text = f"({a} {OPERATORS[type(e.op)][0]} {b})"
            if a0 is None or a1 is None or b0 is None or b1 is None:
                return text, (None, None)
            if isinstance(e.op, ast.Add):
                return text, (a0 + b0, a1 + b1)
            if isinstance(e.op, ast.Sub):
                return text, (a0 - b1, a1 - b0)
            ends = [x * y for x in (a0, a1) for y in (b0, b1)]
            return text, (min(ends), max(ends))
        if isinstance(e, ast.Call) and isinstance(e.func, ast.Name) and e.func.id == "index" and len(e.args) == 1:
            return f"whole({self.scalar(e.args[0])})", (None, None)
        raise self.refuse(
            e, f"{ast.unparse(e)!r}: an index is a loop variable, a whole number from 0 on, or index(expression)"
        )

    def place(self, e: ast.expr) -> CVariable:
        if isinstance(e, ast.Subscript):
            return self.element(e)
        if isinstance(e, ast.Name):
            if e.id in self.loops:
                return CVariable(local(e.id), "loop")
            if e.id in self.locals or e.id in self.arguments:
                if e.id not in self.assigned:
                    raise self.refuse(e, f"{e.id!r} is not assigned on every path before it is read")
                shape = self.locals[e.id] if e.id in self.locals else self.arguments[e.id]
                return CVariable(local(e.id), "local", e.id, shape)
            if (x := self.code.constant(e.id)) is not None:
                return CVariable(repr(x), "constant")
            raise self.refuse(e, f"unknown name {e.id!r}: a local is assigned before it is read")
        if isinstance(e, ast.Attribute) and not self.transposes(e):
            return self.attribute(e)
        value = self.value(e)
        if not value.shape:
            raise self.refuse(e, f"{ast.unparse(e)} is a number: it has no elements")
        return self.kept(value)

    def element(self, e: ast.Subscript) -> CVariable:
        of = self.place(e.value)
        if isinstance(e.slice, ast.Tuple):
            raise self.refuse(e, f"write {ast.unparse(e.value)}[i][j]")
        if not of.shape:
            raise self.refuse(e, f"{ast.unparse(e.value)} is a number: it has no elements")
        size = of.shape[0]
        if isinstance(e.slice, ast.Slice):
            return of.indexed(self.span(e, e.slice, size))
        text, (first, last) = self.index(e.slice)
        if first is None or last is None:
            text = f"at(part, {text}, {size})"
        elif first <= last and not (first >= 0 and last < size):
            which = f"is {first}" if first == last else f"runs over {first} to {last}"
            have = f"{ast.unparse(e.value)} has the elements 0 to {size - 1}"
            raise self.refuse(e, f"the index {ast.unparse(e.slice)} {which}: {have}")
        return of.indexed(text)

    def span(self, e: ast.Subscript, s: ast.Slice, size: int) -> Span:
        ends = [(0, 0) if s.lower is None else self.index(s.lower)[1], (size, size)]
        if s.upper is not None:
            ends[1] = self.index(s.upper)[1]
        (first, same), (last, end) = ends
        if s.step is not None or first is None or last is None or first != same or last != end:
            raise self.refuse(e, f"the slice {ast.unparse(e)} must be [a:b] with whole numbers that are fixed")
        if not 0 <= first < last <= size:
            raise self.refuse(e, f"the slice {ast.unparse(e)}: {ast.unparse(e.value)} has the elements 0 to {size - 1}")
        return first, last - first

    def attribute(self, e: ast.Attribute) -> CVariable:
        source = dotted(e.value)
        name = self.code.flat(e.attr)
        d = self.declared.get(name)
        if source == "self":
            if e.attr in TIMES:
                return CVariable(e.attr, "self", e.attr)
            if d is not None:
                return CVariable(member(name), "self", name, d.shape)
            if (x := self.code.constant(e.attr, of_self=True)) is not None:
                return CVariable(repr(x), "constant")
            owner = self.code.owner or self.translation.source.cls
            raise self.refuse(e, f"self.{e.attr} is not declared in {owner.__name__}")
        if source == "self.der" and isinstance(d, State):
            return CVariable(f"der.{member(name)}", "self", f"der.{name}", d.shape)
        if source == "self.noise" and isinstance(d, Noise) and d.per == "use":
            if self.dual:
                raise self.refuse(e, f"{ast.unparse(e)} is made where it is read: in start and sampled methods only")
            cls = self.translation.source.cls
            draw = f"on_use(part, self->{member(name)}, {cls.streams[cls.noises.index(d)]}, "
            return CVariable(draw, "drawn", f"noise.{name}", d.sample_shape)
        if source == "self.noise" and isinstance(d, Noise):
            return CVariable(f"noise.{member(name)}", "self", f"noise.{name}", d.sample_shape)
        if source.startswith("self.") and (place := self.of_block(e, source)) is not None:
            return place
        raise self.refuse(e, f"{ast.unparse(e)!r}: only self.X, self.der.X of a State and self.noise.X of a Noise")

    def of_block(self, e: ast.Attribute, source: str) -> CVariable | None:
        """Return ``self.block.x``, a declaration of a block; None where there is no such block."""
        blocks = self.code.placed.blocks if self.code.placed else self.translation.source.cls.placed
        placed = blocks.get(source.removeprefix("self."))
        if placed is None:
            return None
        if e.attr not in placed.names:
            raise self.refuse(e, f"{ast.unparse(e)} is not declared in {type(placed.block).__name__}")
        name = placed.names[e.attr]
        return CVariable(member(name), "self", name, self.declared[name].shape)

    @abstractmethod
    def value(self, e: ast.expr) -> CExpression:
        """Return the value of an expression."""

    @abstractmethod
    def scalar(self, e: ast.expr) -> str:
        """Return the text of a number without its derivative."""

    def transposes(self, e: ast.expr) -> bool:
        """Return whether ``x.T`` is a transpose, not a quantity called T."""
        if not isinstance(e, ast.Attribute) or e.attr != "T":
            return False
        blocks = self.code.placed.blocks if self.code.placed else self.translation.source.cls.placed
        of = dotted(e.value)
        block = of.removeprefix("self.")
        named = block in blocks and self.code.flat(block) not in self.declared  # not a block that is one array
        return of not in ("self", "self.der", "self.noise") and not named

    # ------------------------------------------------------------------------------ temporaries
    def temporary(self, shape: Shape) -> CVariable:
        self.temporaries += 1
        name = f"t{self.temporaries}_"
        self.locals[name] = shape
        return CVariable(name, "local", name, shape)

    def settled(self, p: CVariable) -> CVariable:
        """Return a place whose run-time indices are computed once for all its elements."""
        if not p.shape or not any(isinstance(t, str) and t.startswith("at(") for t in p.taken):
            return p
        taken: list[str | Span] = []
        for t in p.taken:
            if isinstance(t, str) and t.startswith("at("):
                self.temporaries += 1
                self.pre.append(f"const int t{self.temporaries}_ = {t};")
                t = f"t{self.temporaries}_"
            taken.append(t)
        return CVariable(p.base, p.kind, p.name, p.dims, tuple(taken))

    def kept(self, v: CExpression) -> CVariable:
        """Compute an array before the current statement, into a temporary."""
        at = self.temporary(v.shape)
        self.pre += [f"{at.at(*i)} = {v.element(*i)};" for i in cells(v.shape)]
        return at
