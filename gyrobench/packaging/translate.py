"""Equations (a small subset of Python) to C, and which inputs an output depends on.

The syntax tree of a part's methods becomes C line by line, twice: once for numbers, once for dual
numbers (the forward-mode derivative).  Nothing is simplified or reordered, so that both targets compute
the same bits.  What is outside the subset is refused with file, line and what to write instead.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State
from gyrobench.math import FUNCTIONS

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
WRITABLE: dict[str, tuple[type, ...]] = {
    "start": (Discrete, State),
    "flow": (),
    "outputs": (Output,),
}
RESERVED = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
    "part", "self", "seed", "dual", "value", "start", "flow", "outputs", "ticks", "main", "errno",
}  # fmt: skip


class SubsetError(Exception):
    """An equation uses Python outside the subset; the text says file, line and what to write instead."""


class Source:
    """The class definition of a part, its constants, and where it stands."""

    def __init__(self, cls: type[Component]) -> None:
        self.cls = cls
        self.path = Path(inspect.getfile(cls))
        tree = ast.parse(self.path.read_text(encoding="utf-8"))
        node = next((n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == cls.__name__), None)
        if node is None:
            raise SubsetError(f"{self.path}: class {cls.__name__} must stand at the top level of its file")
        self.methods = {n.name: n for n in node.body if isinstance(n, ast.FunctionDef)}
        self.constants = {
            k: float(v)
            for k, v in {**vars(sys.modules[cls.__module__]), **vars(cls)}.items()
            if isinstance(v, int | float) and not isinstance(v, bool)
        }
        known = {"start", "flow", "outputs", *(n for n, _ in cls.ticks)}
        self.helpers = [n for n in self.methods if n not in known and not n.startswith("__")]

    def refuse(self, node: ast.AST, what: str) -> SubsetError:
        return SubsetError(f"{self.path}:{getattr(node, 'lineno', 0)}: {what}")


class Method:
    """Translates one method, for numbers (``dual=False``) or for dual numbers."""

    def __init__(self, source: Source, name: str, dual: bool, writes: tuple[type, ...]):
        self.source, self.name, self.dual, self.writes = source, name, dual, writes
        self.node = source.methods.get(name)
        self.locals: dict[str, str] = {}  # python name -> C suffix of its declaration ("", "[3]", "[3][3]")
        self.loops: list[str] = []
        self.arguments = [a.arg for a in self.node.args.args[1:]] if self.node else []
        self.helper = name in source.helpers

    # ------------------------------------------------------------------------------ expressions
    def c_name(self, name: str) -> str:
        return name + "_" if name in RESERVED else name

    def number(self, x: float) -> str:
        text = repr(float(x))
        return f"d_con({text})" if self.dual else text

    def index(self, e: ast.expr) -> str:
        """A whole number: loop variables, literals, + - *, and index(expr)."""
        if isinstance(e, ast.Constant) and isinstance(e.value, int):
            return str(e.value)
        if isinstance(e, ast.Name) and e.id in self.loops:
            return self.c_name(e.id)
        if isinstance(e, ast.Name) and e.id in self.source.constants:
            return str(int(self.source.constants[e.id]))
        if isinstance(e, ast.BinOp) and isinstance(e.op, ast.Add | ast.Sub | ast.Mult):
            return f"({self.index(e.left)} {OPERATORS[type(e.op)][0]} {self.index(e.right)})"
        if isinstance(e, ast.Call) and isinstance(e.func, ast.Name) and e.func.id == "index":
            x = self.expression(e.args[0])
            return f"(int)({x}).v" if self.dual else f"(int)({x})"
        raise self.source.refuse(e, "an index is a loop variable, a whole number, or index(expression)")

    def place(self, e: ast.expr) -> tuple[str, str]:
        """A variable: its C text without the owner, and what it is ("local", "self", "loop", "constant")."""
        if isinstance(e, ast.Subscript):
            text, kind = self.place(e.value)
            items = e.slice.elts if isinstance(e.slice, ast.Tuple) else [e.slice]
            if any(isinstance(i, ast.Slice) for i in items):
                raise self.source.refuse(e, "no slices: write a for loop over the elements")
            return text + "".join(f"[{self.index(i)}]" for i in items), kind
        if isinstance(e, ast.Name):
            if e.id in self.loops:
                return self.c_name(e.id), "loop"
            if e.id in self.locals or e.id in self.arguments:
                return self.c_name(e.id), "local"
            if e.id in self.source.constants:
                return repr(self.source.constants[e.id]), "constant"
            raise self.source.refuse(e, f"unknown name {e.id!r}: a local is assigned before it is read")
        if isinstance(e, ast.Attribute):
            return self.attribute(e)
        raise self.source.refuse(e, f"{ast.unparse(e)!r} is no variable")

    def attribute(self, e: ast.Attribute) -> tuple[str, str]:
        declared = self.source.cls.declarations
        if isinstance(e.value, ast.Name) and e.value.id == "self":
            if e.attr in declared or e.attr in ("t", "h"):
                return e.attr, "self"
            if e.attr in self.source.constants:
                return repr(self.source.constants[e.attr]), "constant"
            raise self.source.refuse(e, f"self.{e.attr} is not declared in {self.source.cls.__name__}")
        if ast.unparse(e.value) in ("self.der", "self.noise"):
            return f"{ast.unparse(e.value)[5:]}.{e.attr}", "self"
        raise self.source.refuse(e, f"{ast.unparse(e)!r}: only self.X, self.der.X and self.noise.X")

    def expression(self, e: ast.expr) -> str:
        d = self.dual
        if isinstance(e, ast.Constant):
            if isinstance(e.value, bool) or not isinstance(e.value, int | float):
                raise self.source.refuse(e, f"{e.value!r} is no number")
            return self.number(e.value)
        if isinstance(e, ast.Name | ast.Attribute | ast.Subscript):
            text, kind = self.place(e)
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
        if isinstance(e, ast.Compare | ast.BoolOp) or (isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not)):
            return f"d_con({self.condition(e)})" if d else f"(double)({self.condition(e)})"
        if isinstance(e, ast.Call):
            return self.call(e)
        raise self.source.refuse(e, f"{ast.unparse(e)!r} is outside the subset of equations")

    def call(self, e: ast.Call) -> str:
        d = self.dual
        if e.keywords:
            raise self.source.refuse(e, "no keyword arguments")
        if isinstance(e.func, ast.Attribute) and ast.unparse(e.func.value) == "self":
            if e.func.attr not in self.source.helpers:
                raise self.source.refuse(e, f"self.{e.func.attr} is no helper method of this part")
            args = ", ".join(self.expression(a) for a in e.args)
            return f"{e.func.attr}_d(part, seed, {args})" if d else f"{e.func.attr}_(part, {args})"
        name = e.func.id if isinstance(e.func, ast.Name) else ""
        if name == "where" and len(e.args) == 3:
            a, b = self.expression(e.args[1]), self.expression(e.args[2])
            return f"({self.condition(e.args[0])} ? {a} : {b})"
        if name not in FUNCTIONS:
            known = ", ".join(FUNCTIONS)
            raise self.source.refuse(e, f"{ast.unparse(e.func)!r} is not callable in equations; these are: {known}")
        args = ", ".join(self.expression(a) for a in e.args)
        if d:
            return f"d_{name}({args})"
        return f"f_{name}({args})" if name in OWN_C else f"{name}({args})"

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

    # ------------------------------------------------------------------------------- statements
    def body(self, statements: Iterable[ast.stmt], depth: int) -> list[str]:
        return [line for s in statements for line in self.statement(s, depth)]

    def statement(self, s: ast.stmt, depth: int) -> list[str]:
        pad = "    " * depth
        if isinstance(s, ast.Pass) or (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)):
            return []
        if isinstance(s, ast.Expr) and isinstance(s.value, ast.Call) and ast.unparse(s.value.func) == "self.refuse":
            return self.refusal(s.value, pad)
        if isinstance(s, ast.Assign | ast.AnnAssign):
            target = s.targets[0] if isinstance(s, ast.Assign) else s.target
            if isinstance(s, ast.Assign) and (len(s.targets) > 1 or isinstance(target, ast.Tuple)):
                raise self.source.refuse(s, "one target an assignment")
            if s.value is None:
                return []
            if isinstance(s.value, ast.List):
                return self.array(target, s.value, pad)
            return self.assign(target, self.expression(s.value), pad)
        if isinstance(s, ast.AugAssign):
            value = ast.copy_location(ast.BinOp(s.target, s.op, s.value), s)
            return self.assign(s.target, self.expression(value), pad)
        if isinstance(s, ast.If):
            lines = [f"{pad}if ({self.condition(s.test)}) {{", *self.body(s.body, depth + 1)]
            if s.orelse:
                lines += [f"{pad}}} else {{", *self.body(s.orelse, depth + 1)]
            return [*lines, f"{pad}}}"]
        if isinstance(s, ast.For):
            return self.loop(s, depth)
        if isinstance(s, ast.Return):
            if s.value is None:
                return [f"{pad}return;"]
            if not self.helper:
                raise self.source.refuse(s, f"{self.name} returns nothing")
            return [f"{pad}return {self.expression(s.value)};"]
        raise self.source.refuse(s, f"`{ast.unparse(s).splitlines()[0]}` is outside the subset of equations")

    def loop(self, s: ast.For, depth: int) -> list[str]:
        pad = "    " * depth
        call = s.iter
        if (
            not isinstance(s.target, ast.Name)
            or not isinstance(call, ast.Call)
            or ast.unparse(call.func) != "range"
            or not 1 <= len(call.args) <= 2
            or s.orelse
        ):
            raise self.source.refuse(s, "only `for k in range(n)` and `for k in range(a, b)`")
        bounds = [self.index(a) for a in call.args]
        first, last = bounds if len(bounds) == 2 else ("0", bounds[0])
        self.loops.append(s.target.id)
        k = self.c_name(s.target.id)
        lines = [
            f"{pad}for (int {k} = {first}; {k} < {last}; {k}++) {{",
            *self.body(s.body, depth + 1),
            f"{pad}}}",
        ]
        self.loops.pop()
        return lines

    def assign(self, target: ast.expr, value: str, pad: str) -> list[str]:
        if isinstance(target, ast.Name):
            if target.id in self.loops:
                raise self.source.refuse(target, f"the loop variable {target.id!r} is not assigned to")
            if target.id not in self.arguments:
                self.locals.setdefault(target.id, "")
            return [f"{pad}{self.c_name(target.id)} = {value};"]
        text, kind = self.place(target)
        if kind == "local":
            return [f"{pad}{text} = {value};"]
        if kind != "self" or not self.may_write(text):
            raise self.source.refuse(target, f"{self.name}() does not write {ast.unparse(target)}")
        if self.dual:
            return [f"{pad}{{ dual r_ = {value}; self->{text} = r_.v; seed->{text} = r_.d; }}"]
        return [f"{pad}self->{text} = {value};"]

    def may_write(self, text: str) -> bool:
        if text.startswith("der."):
            return self.name == "flow"
        decl = self.source.cls.declarations.get(re.split(r"[.\[]", text)[0])
        return isinstance(decl, self.writes) and not isinstance(decl, Parameter)

    def array(self, target: ast.expr, value: ast.List, pad: str) -> list[str]:
        if not isinstance(target, ast.Name):
            raise self.source.refuse(target, "only a local array is made from a list: write self.X[i] = ...")
        rows = [(f"[{i}]", e) for i, e in enumerate(value.elts)]
        size = f"[{len(rows)}]"
        if rows and isinstance(rows[0][1], ast.List):
            width = len(rows[0][1].elts)
            cells = [(f"{i}[{j}]", e) for i, r in rows if isinstance(r, ast.List) for j, e in enumerate(r.elts)]
            size, rows = f"[{len(rows)}][{width}]", cells
        self.locals.setdefault(target.id, size)
        name = self.c_name(target.id)
        return [f"{pad}{name}{i} = {self.expression(e)};" for i, e in rows]

    def refusal(self, call: ast.Call, pad: str) -> list[str]:
        if self.helper:
            raise self.source.refuse(call, "a helper method does not refuse: do it in start, flow, outputs or a tick")
        if len(call.args) != 2 or not isinstance(call.args[1], ast.Constant) or not isinstance(call.args[1].value, str):
            raise self.source.refuse(call, 'write self.refuse(condition, "message with {H}")')
        message = call.args[1].value
        names = re.findall(r"\{(\w+)\}", message)
        for n in names:
            if n not in self.source.cls.declarations or self.source.cls.declarations[n].shape:
                raise self.source.refuse(call, f"{{{n}}} is no scalar of this part")
        text = re.sub(r"\{\w+\}", "%g", message.replace("%", "%%")).replace("\\", "\\\\").replace('"', '\\"')
        values = "".join(f"plain(self->{n}), " for n in names)
        return [
            f"{pad}if ({self.condition(call.args[0])}) {{",
            f'{pad}    fail(part, "{text} (t = %.9g s)", {values}self->t);',
            f"{pad}    return;",
            f"{pad}}}",
        ]

    # --------------------------------------------------------------------------------- function
    def function(self) -> str:
        number = "dual" if self.dual else "double"
        seed = ", Vars *seed" if self.dual else ""
        if self.helper:
            suffix = "_d" if self.dual else "_"
            args = "".join(f", {number} {self.c_name(a)}" for a in self.arguments)
            head = f"static {number} {self.name}{suffix}(Part *part{seed}{args})"
        else:
            head = f"static void {self.name}{'_d' if self.dual else ''}(Part *part{seed})"
        lines = self.body(self.node.body, 1) if self.node else []
        zero = "{0.0, 0.0}" if self.dual else "0.0"
        declared = [
            f"    {number} {self.c_name(n)}{size}{'' if size else f' = {zero}'};" for n, size in self.locals.items()
        ]
        opening = ["    Vars *self = &part->n.v;"]
        if not any("self->" in x for x in lines):
            opening.append("    (void)self;")
        if self.dual and not any("seed" in x for x in lines):
            opening.append("    (void)seed;")
        return "\n".join([f"{head} {{", *opening, *declared, *lines, "}"])


def method_names(source: Source) -> list[str]:
    return ["start", "flow", "outputs", *(n for n, _ in source.cls.ticks)]


def equations(source: Source) -> str:
    """Every method of the part as C, helpers first."""
    out = []
    for h in source.helpers:
        out += [Method(source, h, False, ()).function(), Method(source, h, True, ()).function()]
    for name in method_names(source):
        writes = WRITABLE.get(name, (Discrete, State))
        out.append(Method(source, name, False, writes).function())
    for name in ("flow", "outputs"):
        out.append(Method(source, name, True, WRITABLE[name]).function())
    turns = []
    for name, every in source.cls.ticks:
        turn = f"    if (fmod(part->n.v.tick, {every}.0) == 0.0) {name}(part);"
        turns.append(turn if every > 1 else f"    {name}(part);")
    out.append("\n".join(["static void ticks(Part *part) {", *(turns or ["    (void)part;"]), "}"]))
    return "\n\n".join(out)


# -------------------------------------------------------------------------------------- dependencies
def dependencies(source: Source, method: str = "outputs") -> dict[str, set[str]]:
    """Which inputs (declared names) each written variable of ``method`` depends on, without delay."""
    inputs = {n for n, d in source.cls.declarations.items() if isinstance(d, Input)}
    reach: dict[str, set[str]] = {}

    def key(e: ast.expr) -> str:
        while isinstance(e, ast.Subscript):
            e = e.value
        return ast.unparse(e)

    def read(e: ast.AST) -> set[str]:
        found: set[str] = set()
        for n in ast.walk(e):
            if isinstance(n, ast.Attribute | ast.Name):
                text = ast.unparse(n)
                found |= reach.get(text, set())
                if text.startswith("self.") and text[5:] in inputs:
                    found.add(text[5:])
                if text.startswith("self.") and text[5:] in source.helpers:
                    found |= {i for h in [source.methods[text[5:]]] for i in read(h) if i in inputs}
        return found

    def run(statements: Iterable[ast.stmt], under: set[str]) -> None:
        for s in statements:
            if isinstance(s, ast.Assign | ast.AugAssign | ast.AnnAssign) and s.value is not None:
                target = s.targets[0] if isinstance(s, ast.Assign) else s.target
                reach.setdefault(key(target), set()).update(read(s.value) | read(target) | under)
            elif isinstance(s, ast.If):
                run(s.body, under | read(s.test))
                run(s.orelse, under | read(s.test))
            elif isinstance(s, ast.For):
                run(s.body, under)

    node = source.methods.get(method)
    before = None
    while before != (before := {k: frozenset(v) for k, v in reach.items()}) or not reach:  # loops carry values
        run(node.body if node else [], set())
        if not reach:
            break
    names = {n: d for n, d in source.cls.declarations.items() if isinstance(d, Output)}
    return {n: reach.get(f"self.{n}", set()) for n in names}
