"""Expressions of equations as C: for numbers and, with the same text, for dual numbers (value, derivative)."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import TYPE_CHECKING

from gyrobench.component.math import ARRAY_FUNCTIONS, FUNCTIONS
from gyrobench.packaging.c_arrays import CExpression, CVariable, words
from gyrobench.packaging.places import OPERATORS, Places
from gyrobench.packaging.source import Code, SubsetError, gives_value, returns

if TYPE_CHECKING:
    from gyrobench.packaging.translate import Procedure

COMPARISONS: dict[type[ast.AST], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
LIBRARY_C = {"sqrt", "floor"}  # exact in every library of C; the others are written in functions.h and elementary.h
ARGUMENTS = {"atan2": 2, "minimum": 2, "maximum": 2, "clip": 3, "where": 3, "dot": 2, "cross": 2}  # the others take one
WRITE = {"int": "floor", "round": "floor(x + 0.5)", "abs": "fabs", "min": "minimum", "max": "maximum"}


class Expressions(Places):
    """Translates the expressions of one method, for numbers (``dual=False``) or for dual numbers."""

    def expression(self, e: ast.expr) -> str:
        """Return the text of a number."""
        value = self.value(e)
        if value.shape:
            raise self.refuse(e, f"{ast.unparse(e)} is {words(value.shape)}: take one element of it")
        return value.text

    def value(self, e: ast.expr) -> CExpression:
        d = self.dual
        if isinstance(e, ast.Constant):
            if isinstance(e.value, bool) or not isinstance(e.value, int | float):
                raise self.refuse(e, f"{e.value!r} is not a number: equations contain numbers only")
            if abs(e.value) > 1.7e308:
                raise self.refuse(e, f"{e.value!r} is not finite")
            return self.number(f"d_con({float(e.value)!r})" if d else repr(float(e.value)), plain=True)
        if isinstance(e, ast.Attribute) and self.transposes(e):
            return self.transposed(e)
        if isinstance(e, ast.Name | ast.Attribute | ast.Subscript):
            return self.of_place(self.place(e))
        if isinstance(e, ast.BinOp):
            return self.binary(e)
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.USub):
            return self.each((self.value(e.operand),), lambda a: f"d_neg({a})" if d else f"(-{a})")
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.UAdd):
            return self.value(e.operand)
        if isinstance(e, ast.IfExp):
            return self.choice(e, e.test, e.body, e.orelse)
        if logical(e):
            return self.number(f"d_con({self.condition(e)})" if d else f"(double)({self.condition(e)})")
        if isinstance(e, ast.Call):
            return self.call(e)
        if isinstance(e, ast.BoolOp):
            raise self.refuse(e, f"write 1.0 if {ast.unparse(e)} else 0.0")
        if isinstance(e, ast.List):
            raise self.refuse(e, f"write vector({ast.unparse(e)}), from gyrobench.component.math")
        raise self.refuse(e, f"{ast.unparse(e)!r} is outside the subset of equations")

    def number(self, text: str, plain: bool = False) -> CExpression:
        return CExpression((), lambda: text, plain)

    def of_place(self, p: CVariable) -> CExpression:
        d = self.dual
        if p.kind == "constant":
            return self.number(f"d_con({p.base})" if d else p.base, plain=True)
        if p.kind == "drawn":
            return CExpression(p.shape, lambda *i: p.at(*i).replace("[", "").replace("]", ")"))
        if p.kind == "loop":
            return self.number(f"d_con({p.base})" if d else f"(double){p.base}", plain=True)
        p = self.settled(p)
        reads = frozenset([f"{p.kind}.{p.name}"])
        if p.kind == "local":
            storage = p.at() if p.whole and p.shape else ""
            return CExpression(p.shape, p.at, True, p.whole, storage, reads)
        storage = f"self->{p.at()}" if p.whole and p.shape and not d else ""

        def element(*i: str) -> str:
            return f"d_of(self->{p.at(*i)}, seed->{p.at(*i)})" if d else f"self->{p.at(*i)}"

        return CExpression(p.shape, element, True, p.whole, storage, reads)

    def each(self, of: tuple[CExpression, ...], text: Callable[..., str]) -> CExpression:
        """Return the value made of the elements of ``of`` (numbers serve all elements)."""
        shape = next((v.shape for v in of if v.shape), ())

        def element(*i: str) -> str:
            return text(*(v.element(*i) if v.shape else v.text for v in of))

        return CExpression(shape, element, False, all(v.aligned for v in of), "", _reads(of))

    def binary(self, e: ast.BinOp) -> CExpression:
        if isinstance(e.op, ast.Pow):
            raise self.refuse(e, "no `**` (its rounding differs between targets): write x * x")
        if isinstance(e.op, ast.MatMult):
            return self.product(e, self.operand(e.left), self.operand(e.right))
        if type(e.op) not in OPERATORS:
            raise self.refuse(e, "only + - * / @ (for remainders write x - y * floor(x / y))")
        a, b = self.value(e.left), self.value(e.right)
        if a.shape or b.shape:
            self.check_arithmetic(e, a, b)
            a, b = (v if v.shape or v.plain else self.named(v) for v in (a, b))
        infix, function = OPERATORS[type(e.op)]
        return self.each((a, b), lambda x, y: f"{function}({x}, {y})" if self.dual else f"({x} {infix} {y})")

    def check_arithmetic(self, e: ast.BinOp, a: CExpression, b: CExpression) -> None:
        for side in (e.left, e.right):
            if isinstance(side, ast.Name) and side.id in self.bare:
                raise self.refuse(side, f"{side.id} is a list: write {side.id} = vector([...]), which has arithmetic")
        text, shapes = ast.unparse(e), f"{words(a.shape)} and {words(b.shape)}"
        if isinstance(e.op, ast.Add | ast.Sub) and a.shape != b.shape:
            raise self.refuse(e, f"{text}: {shapes} are not added")
        if isinstance(e.op, ast.Mult) and a.shape and b.shape:
            raise self.refuse(e, f"{text}: {shapes}: write @, dot or cross, or a for loop over the elements")
        if isinstance(e.op, ast.Div) and b.shape:
            raise self.refuse(e, f"{text}: only a number divides")

    def operand(self, e: ast.expr) -> CExpression:
        """Return an array whose elements are read several times: a temporary where it is computed."""
        if isinstance(e, ast.Name) and e.id in self.bare:
            raise self.refuse(e, f"{e.id} is a list: write {e.id} = vector([...]), which has arithmetic")
        value = self.value(e)
        if not value.shape:
            raise self.refuse(e, f"{ast.unparse(e)} is a number: a vector or a matrix is needed here")
        return value if value.plain else self.of_place(self.kept(value))

    def product(self, e: ast.expr, a: CExpression, b: CExpression) -> CExpression:
        """Return a @ b, summed from left to right."""
        if a.shape[-1] != b.shape[0]:
            raise self.refuse(e, f"{ast.unparse(e)}: {words(a.shape)} and {words(b.shape)} do not fit")
        shape = a.shape[:-1] + b.shape[1:]
        rows = len(a.shape) - 1

        def element(*i: str) -> str:
            terms = [(a.element(*i[:rows], str(k)), b.element(str(k), *i[rows:])) for k in range(b.shape[0])]
            total = self.times(*terms[0])
            for x, y in terms[1:]:
                total = f"d_add({total}, {self.times(x, y)})" if self.dual else f"({total} + {self.times(x, y)})"
            return total

        return CExpression(shape, element, False, False, "", _reads((a, b)))

    def times(self, x: str, y: str) -> str:
        return f"d_mul({x}, {y})" if self.dual else f"({x} * {y})"

    def transposed(self, e: ast.Attribute) -> CExpression:
        of = self.operand(e.value)
        if len(of.shape) != 2:
            raise self.refuse(e, f"{ast.unparse(e.value)} is {words(of.shape)}: only a matrix is transposed")
        return CExpression(of.shape[::-1], lambda i, j: of.element(j, i), of.plain, False, "", of.reads)

    def choice(self, e: ast.expr, test: ast.expr, then: ast.expr, other: ast.expr) -> CExpression:
        condition = self.condition(test)
        before = len(self.pre)
        a, b = self.value(then), self.value(other)
        if len(self.pre) > before:
            raise self.refuse(e, "an array is computed in one branch only: assign it to a local before, or use `if`")
        if a.shape != b.shape:
            raise self.refuse(e, f"{ast.unparse(e)}: {words(a.shape)} or {words(b.shape)}: both must be of one shape")
        return self.each((a, b), lambda x, y: f"({condition} ? {x} : {y})")

    # ------------------------------------------------------------------------------ calls
    def call(self, e: ast.Call) -> CExpression:
        if e.keywords:
            raise self.refuse(e, "no keyword arguments")
        code = self.callee(e)
        if code is not None:
            if not gives_value(code.node):
                raise self.refuse(e, f"{ast.unparse(e.func)} returns nothing: call it on a line of its own")
            return self.returned(e, code)
        name = e.func.id if isinstance(e.func, ast.Name) else ""
        if name in ARRAY_FUNCTIONS:
            return self.array_function(e, name)
        if name not in FUNCTIONS:
            raise self.unknown_function(e)
        self.count(e, name, ARGUMENTS.get(name, 1))
        if name == "where":
            return self.choice(e, *e.args)
        args = ", ".join(self.expression(a) for a in e.args)
        if self.dual:
            return self.number(f"d_{name}({args})")
        if name in ("sin", "cos") and self.is_paired(e, name):
            name = f"paired_{name}"
        return self.number(f"{name}({args})" if name in LIBRARY_C else f"f_{name}({args})")

    def is_paired(self, e: ast.Call, name: str) -> bool:
        """Return whether this piece of code asks for the other one of sine and cosine of the same text, too."""
        other = f"{'cos' if name == 'sin' else 'sin'}({ast.unparse(e.args[0])})"
        return any(isinstance(n, ast.Call) and ast.unparse(n) == other for n in ast.walk(self.code.node))

    def callee(self, e: ast.Call) -> Code | None:
        """Return the procedure or function that is called; None where it is one of the language."""
        source = self.translation.source
        if isinstance(e.func, ast.Name):
            if e.func.id in FUNCTIONS or e.func.id in ARRAY_FUNCTIONS:
                return None
            code = source.function(e.func.id, self.code)
            if code is not None and not (gives_value(code.node) and returns(code.node.body)):
                raise self.refuse(e, f"{e.func.id} is a function: it returns a value on every path")
            return code
        if not isinstance(e.func, ast.Attribute):
            return None
        of = ast.unparse(e.func.value)
        if of == "self":
            code = source.method(e.func.attr, self.code)
            if code is None:
                raise self.refuse(e, f"self.{e.func.attr} is not a procedure of this part")
            return code
        if of == "super()":
            code = source.base_method(e.func.attr, self.code)
            if code is None:
                raise self.refuse(e, f"{of}.{e.func.attr} is not a procedure of the bases of this class")
            return code
        if of.startswith("super("):
            raise self.refuse(e, f"write super().{e.func.attr}(...): the bases of this class, in their order")
        blocks = self.code.placed.blocks if self.code.placed else source.cls.placed
        if of.removeprefix("self.") in blocks:
            code = source.block_method(of.removeprefix("self."), e.func.attr, self.code)
            if code is None:
                raise self.refuse(e, f"{of}.{e.func.attr} is not a procedure of this block")
            return code
        return None

    def unknown_function(self, e: ast.Call) -> SubsetError:
        text = ast.unparse(e.func)
        if text.removeprefix("math.") in FUNCTIONS:
            name = text.removeprefix("math.")
            return self.refuse(e, f"write {name}(...) with `from gyrobench.component.math import {name}`")
        if text in WRITE:
            return self.refuse(e, f"no {text}(): write {WRITE[text]}, from gyrobench.component.math")
        known = ", ".join((*FUNCTIONS, *ARRAY_FUNCTIONS))
        return self.refuse(e, f"{text!r} is not callable in equations; these are: {known}")

    def invoke(self, e: ast.Call, code: Code) -> tuple[Procedure, str]:
        """Translate what is called for arguments of these shapes; return it and the text of its arguments."""
        self.count(e, ast.unparse(e.func), len(code.arguments))
        values = [self.value(a) for a in e.args]
        procedure = self.translation.procedure(code, tuple(v.shape for v in values), self.dual, e, self.code)
        head = ["part"] + (["seed"] if self.dual else [])
        args = [v.text if not v.shape else (v.storage or self.kept(v).at()) for v in values]
        return procedure, ", ".join([*head, *args])

    def returned(self, e: ast.Call, code: Code) -> CExpression:
        procedure, args = self.invoke(e, code)
        self.touched |= procedure.touched
        if not procedure.shape:
            return self.number(f"{procedure.name}({args})")
        at = self.temporary(procedure.shape)
        self.pre.append(f"{procedure.name}({args}, {at.base});")
        return self.of_place(at)

    def array_function(self, e: ast.Call, name: str) -> CExpression:
        self.count(e, name, ARGUMENTS.get(name, 1))
        if name == "vector":
            if isinstance(e.args[0], ast.Name) and (constant := self.code.array(e.args[0].id)) is not None:
                return self.literal(constant)
            if not isinstance(e.args[0], ast.List):
                value = self.value(e.args[0])
                if not value.shape:
                    raise self.refuse(
                        e, f"{ast.unparse(e.args[0])} is a number: write vector([...]), or an array to copy"
                    )
                return CExpression(value.shape, value.element, False, value.aligned, "", value.reads)
            return self.literal(e.args[0])
        a, b = (self.operand(x) for x in e.args)
        if name == "dot":
            if len(a.shape) != 1 or a.shape != b.shape:
                raise self.refuse(e, f"dot of {words(a.shape)} and {words(b.shape)}: two vectors of one length")
            return self.product(e, a, b)
        if a.shape != (3,) or b.shape != (3,):
            raise self.refuse(e, f"cross of {words(a.shape)} and {words(b.shape)}: two vectors of three")

        def element(i: str) -> str:
            j, k = (int(i) + 1) % 3, (int(i) + 2) % 3
            x = self.times(a.element(str(j)), b.element(str(k)))
            y = self.times(a.element(str(k)), b.element(str(j)))
            return f"d_sub({x}, {y})" if self.dual else f"({x} - {y})"

        return CExpression((3,), element, False, False, "", _reads((a, b)))

    def literal(self, e: ast.List) -> CExpression:
        """Return the value of [a, b, c], or of a list of such lists or vectors."""
        rows = [self.literal(r) if isinstance(r, ast.List) else self.value(r) for r in e.elts]
        if len({r.shape for r in rows}) != 1:
            raise self.refuse(e, "an array is a list of numbers, or of lists of equal length")
        shape = (len(rows), *rows[0].shape)
        return CExpression(shape, lambda i, *more: rows[int(i)].element(*more), False, False, "", _reads(tuple(rows)))

    def count(self, e: ast.Call, name: str, n: int) -> None:
        if len(e.args) != n:
            raise self.refuse(e, f"{name} takes {n} argument{'s' if n != 1 else ''}, not {len(e.args)}")

    def named(self, v: CExpression) -> CExpression:
        """Compute a number before the current statement, so that all elements share it."""
        at = self.temporary(())
        self.pre.append(f"{at.base} = {v.text};")
        return self.of_place(at)

    # ------------------------------------------------------------------------------ conditions
    def condition(self, e: ast.expr) -> str:
        if isinstance(e, ast.BoolOp):
            word = " && " if isinstance(e.op, ast.And) else " || "
            first = self.condition(e.values[0])
            before = len(self.pre)
            further = [self.condition(v) for v in e.values[1:]]
            if len(self.pre) > before:
                raise self.refuse(e, "an array is computed behind and/or: assign it to a local before")
            return "(" + word.join([first, *further]) + ")"
        if isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not):
            return f"!({self.condition(e.operand)})"
        if isinstance(e, ast.Compare):
            sides = [self.scalar(x) for x in (e.left, *e.comparators)]
            parts = []
            for a, op, b in zip(sides, e.ops, sides[1:], strict=False):
                if type(op) not in COMPARISONS:
                    raise self.refuse(e, "only < <= > >= == != compare numbers")
                parts.append(f"{a} {COMPARISONS[type(op)]} {b}")
            return "(" + " && ".join(parts) + ")"
        return f"({self.scalar(e)} != 0.0)"

    def scalar(self, e: ast.expr) -> str:
        text = self.expression(e)
        return f"({text}).v" if self.dual else text


def _reads(of: tuple[CExpression, ...]) -> frozenset[str]:
    return frozenset().union(*(v.reads for v in of)) if of else frozenset()


def logical(e: ast.expr) -> bool:
    """Return whether an expression is true or false in Python (`a and b` of numbers is one of the numbers)."""
    if isinstance(e, ast.BoolOp):
        return all(logical(v) for v in e.values)
    return isinstance(e, ast.Compare) or (isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not))
