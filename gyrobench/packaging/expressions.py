"""Expressions of equations as C: for numbers and, with the same text, for dual numbers (value, derivative)."""

from __future__ import annotations

import ast
from dataclasses import dataclass

from gyrobench.component import State
from gyrobench.component.math import FUNCTIONS
from gyrobench.packaging.source import Source, local, member

OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "d_add"),
    ast.Sub: ("-", "d_sub"),
    ast.Mult: ("*", "d_mul"),
    ast.Div: ("/", "d_div"),
}
COMPARISONS: dict[type[ast.AST], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
OWN_C = {"fabs", "minimum", "maximum", "clip", "sign"}  # written in core.h, the others are libm's
ARGUMENTS = {"atan2": 2, "minimum": 2, "maximum": 2, "clip": 3, "where": 3}  # the others take one
Shape = tuple[int, ...]
Range = tuple[int | None, int | None]  # smallest and largest value of an index; None: known when it runs


@dataclass
class Place:
    """A variable: its C text without the owner, what it is, and the shape that is left to be indexed."""

    text: str
    kind: str  # "local", "self", "loop" or "constant"
    shape: Shape = ()
    name: str = ""


class Expressions:
    """Translates the expressions of one method, for numbers (``dual=False``) or for dual numbers."""

    def __init__(self, source: Source, name: str, dual: bool, writes: tuple[type, ...]):
        self.source, self.name, self.dual, self.writes = source, name, dual, writes
        self.node = source.methods.get(name)
        self.locals: dict[str, Shape] = {}
        self.loops: dict[str, Range] = {}
        self.arguments = [a.arg for a in self.node.args.args[1:]] if self.node else []
        self.assigned = set(self.arguments)  # locals that surely have a value here
        self.helper = name in source.helpers

    # ------------------------------------------------------------------------------ expressions
    def index(self, e: ast.expr) -> tuple[str, Range]:
        """A whole number, counted from 0: loop variables, literals, + - *, and index(expr)."""
        if isinstance(e, ast.Constant) and isinstance(e.value, int):
            return str(e.value), (e.value, e.value)
        if isinstance(e, ast.Name) and e.id in self.loops:
            return local(e.id), self.loops[e.id]
        if isinstance(e, ast.Name) and e.id in self.source.constants:
            n = int(self.source.constants[e.id])
            return str(n), (n, n)
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
        raise self.source.refuse(
            e, f"{ast.unparse(e)!r}: an index is a loop variable, a whole number from 0 on, or index(expression)"
        )

    def place(self, e: ast.expr) -> Place:
        if isinstance(e, ast.Subscript):
            return self.element(e)
        if isinstance(e, ast.Name):
            if e.id in self.loops:
                return Place(local(e.id), "loop")
            if e.id in self.locals or e.id in self.arguments:
                if e.id not in self.assigned:
                    raise self.source.refuse(e, f"{e.id!r} is not assigned on every path before it is read")
                return Place(local(e.id), "local", self.locals.get(e.id, ()), e.id)
            if e.id in self.source.constants:
                return Place(repr(self.source.constants[e.id]), "constant")
            raise self.source.refuse(e, f"unknown name {e.id!r}: a local is assigned before it is read")
        if isinstance(e, ast.Attribute):
            return self.attribute(e)
        raise self.source.refuse(e, f"{ast.unparse(e)!r} is no variable")

    def element(self, e: ast.Subscript) -> Place:
        of = self.place(e.value)
        if isinstance(e.slice, ast.Slice):
            raise self.source.refuse(e, "no slices: write a for loop over the elements")
        if isinstance(e.slice, ast.Tuple):
            raise self.source.refuse(e, f"write {ast.unparse(e.value)}[i][j]")
        if not of.shape:
            raise self.source.refuse(e, f"{ast.unparse(e.value)} is a number: it has no elements")
        size = of.shape[0]
        text, (first, last) = self.index(e.slice)
        if first is None or last is None:
            text = f"at(part, {text}, {size})"
        elif first <= last and not (first >= 0 and last < size):
            which = f"is {first}" if first == last else f"runs over {first} to {last}"
            have = f"{ast.unparse(e.value)} has the elements 0 to {size - 1}"
            raise self.source.refuse(e, f"the index {ast.unparse(e.slice)} {which}: {have}")
        return Place(f"{of.text}[{text}]", of.kind, of.shape[1:], of.name)

    def attribute(self, e: ast.Attribute) -> Place:
        declared = self.source.cls.declarations
        if isinstance(e.value, ast.Name) and e.value.id == "self":
            if e.attr in ("t", "h"):
                return Place(e.attr, "self", (), e.attr)
            if e.attr in declared:
                return Place(member(e.attr), "self", declared[e.attr].shape, e.attr)
            if e.attr in self.source.constants:
                return Place(repr(self.source.constants[e.attr]), "constant")
            raise self.source.refuse(e, f"self.{e.attr} is not declared in {self.source.cls.__name__}")
        if ast.unparse(e.value) == "self.der" and isinstance(declared.get(e.attr), State):
            return Place(f"der.{member(e.attr)}", "self", declared[e.attr].shape, f"der.{e.attr}")
        if ast.unparse(e.value) == "self.noise" and any(n.name == e.attr for n in self.source.cls.noises):
            return Place(f"noise.{member(e.attr)}", "self", (), f"noise.{e.attr}")
        raise self.source.refuse(
            e, f"{ast.unparse(e)!r}: only self.X, self.der.X of a State and self.noise.X of a Noise"
        )

    def expression(self, e: ast.expr) -> str:
        d = self.dual
        if isinstance(e, ast.Constant):
            if isinstance(e.value, bool) or not isinstance(e.value, int | float):
                raise self.source.refuse(e, f"{e.value!r} is no number: equations are of numbers only")
            if abs(e.value) > 1.7e308:
                raise self.source.refuse(e, f"{e.value!r} is not finite")
            return f"d_con({float(e.value)!r})" if d else repr(float(e.value))
        if isinstance(e, ast.Name | ast.Attribute | ast.Subscript):
            found = self.place(e)
            text, kind = found.text, found.kind
            if found.shape:
                dimensions = " x ".join(map(str, found.shape))
                raise self.source.refuse(e, f"{ast.unparse(e)} is an array ({dimensions}): take one element of it")
            if kind == "constant":
                return f"d_con({text})" if d else text
            if kind == "loop":
                return f"d_con({text})" if d else f"(double){text}"
            if kind == "local":
                return text
            return f"d_of(self->{text}, seed->{text})" if d else f"self->{text}"
        if isinstance(e, ast.BinOp):
            if isinstance(e.op, ast.Pow):
                raise self.source.refuse(e, "no `**` (its rounding differs between targets): write x * x")
            if type(e.op) not in OPERATORS:
                raise self.source.refuse(e, "only + - * / (for remainders write x - y * floor(x / y))")
            infix, call = OPERATORS[type(e.op)]
            a, b = self.expression(e.left), self.expression(e.right)
            return f"{call}({a}, {b})" if d else f"({a} {infix} {b})"
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.USub):
            return f"d_neg({self.expression(e.operand)})" if d else f"(-{self.expression(e.operand)})"
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.UAdd):
            return self.expression(e.operand)
        if isinstance(e, ast.IfExp):
            return f"({self.condition(e.test)} ? {self.expression(e.body)} : {self.expression(e.orelse)})"
        if logical(e):
            return f"d_con({self.condition(e)})" if d else f"(double)({self.condition(e)})"
        if isinstance(e, ast.Call):
            return self.call(e)
        if isinstance(e, ast.BoolOp):
            raise self.source.refuse(e, f"write 1.0 if {ast.unparse(e)} else 0.0")
        raise self.source.refuse(e, f"{ast.unparse(e)!r} is outside the subset of equations")

    def call(self, e: ast.Call) -> str:
        d = self.dual
        if e.keywords:
            raise self.source.refuse(e, "no keyword arguments")
        if isinstance(e.func, ast.Attribute) and ast.unparse(e.func.value) == "self":
            name = e.func.attr
            if name not in self.source.helpers:
                raise self.source.refuse(e, f"self.{name} is no helper method of this part")
            self.count(e, f"self.{name}", len(self.source.methods[name].args.args) - 1)
            args = "".join(f", {self.expression(a)}" for a in e.args)
            return f"{name}_d(part, seed{args})" if d else f"{name}_(part{args})"
        name = e.func.id if isinstance(e.func, ast.Name) else ""
        if name not in FUNCTIONS:
            known = ", ".join(FUNCTIONS)
            text = ast.unparse(e.func)
            if text.removeprefix("math.") in FUNCTIONS:
                name = text.removeprefix("math.")
                raise self.source.refuse(e, f"write {name}(...) with `from gyrobench.component.math import {name}`")
            if text in ("int", "round", "abs", "min", "max"):
                write = {"int": "floor", "round": "floor(x + 0.5)", "abs": "fabs", "min": "minimum", "max": "maximum"}
                raise self.source.refuse(e, f"no {text}(): write {write[text]}, from gyrobench.component.math")
            raise self.source.refuse(e, f"{text!r} is not callable in equations; these are: {known}")
        self.count(e, name, ARGUMENTS.get(name, 1))
        if name == "where":
            a, b = self.expression(e.args[1]), self.expression(e.args[2])
            return f"({self.condition(e.args[0])} ? {a} : {b})"
        args = ", ".join(self.expression(a) for a in e.args)
        if d:
            return f"d_{name}({args})"
        return f"f_{name}({args})" if name in OWN_C else f"{name}({args})"

    def count(self, e: ast.Call, name: str, n: int) -> None:
        if len(e.args) != n:
            raise self.source.refuse(e, f"{name} takes {n} argument{'s' if n != 1 else ''}, not {len(e.args)}")

    def condition(self, e: ast.expr) -> str:
        if isinstance(e, ast.BoolOp):
            word = " && " if isinstance(e.op, ast.And) else " || "
            return "(" + word.join(self.condition(v) for v in e.values) + ")"
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not):
            return f"!({self.condition(e.operand)})"
        if isinstance(e, ast.Compare):
            sides = [self.scalar(x) for x in (e.left, *e.comparators)]
            parts = []
            for a, op, b in zip(sides, e.ops, sides[1:], strict=False):
                if type(op) not in COMPARISONS:
                    raise self.source.refuse(e, "only < <= > >= == != compare numbers")
                parts.append(f"{a} {COMPARISONS[type(op)]} {b}")
            return "(" + " && ".join(parts) + ")"
        return f"({self.scalar(e)} != 0.0)"

    def scalar(self, e: ast.expr) -> str:
        text = self.expression(e)
        return f"({text}).v" if self.dual else text


def logical(e: ast.expr) -> bool:
    """Whether an expression is true or false in Python (`a and b` of numbers is one of the numbers)."""
    if isinstance(e, ast.BoolOp):
        return all(logical(v) for v in e.values)
    return isinstance(e, ast.Compare) or (isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not))
