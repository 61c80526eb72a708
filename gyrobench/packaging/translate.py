"""Equations (a small subset of Python) to C.

The syntax tree of a part's methods becomes C line by line, twice: once for numbers, once for dual
numbers (the forward-mode derivative).  Nothing is simplified or reordered, so that both targets compute
the same bits.  What is outside the subset is an error with file, line and what to write instead.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from gyrobench.component import Discrete, Input, Output, Parameter, State
from gyrobench.packaging.c_arrays import CExpression, CVariable, Shape, cells, dimensions, words
from gyrobench.packaging.expressions import Expressions
from gyrobench.packaging.source import Code, SubsetError, gives_value, local, member, returns

if TYPE_CHECKING:
    from gyrobench.packaging.translation import Translation

WRITABLE: dict[str, tuple[type, ...]] = {
    "start": (Discrete, State),
    "flow": (),
    "outputs": (Output,),
    "sampled": (Discrete, State),
}
PROCEDURE = "procedure"
TEMPORARY = re.compile(r"t\d+_")
HINTS = {"flow": "self.der.X", "outputs": "outputs"}


@dataclass
class Procedure:
    """A translated procedure: its C name, what it returns (None: nothing), what it writes."""

    name: str
    shape: Shape | None = None
    touched: set[str] = field(default_factory=set)
    refuses: bool = False


class Method(Expressions):
    """Translates one equation, procedure or function.  kind: of WRITABLE, or "procedure"."""

    def __init__(
        self, translation: Translation, code: Code, dual: bool, kind: str, shapes: tuple[Shape, ...] = ()
    ) -> None:
        super().__init__(translation, code, dual, shapes)
        self.kind = kind
        self.name = code.node.name
        self.returns_value = kind == PROCEDURE and gives_value(code.node)
        self.result: Shape | None = None
        self.refuses = False
        self.views: set[str] = set()  # locals that are an input or a parameter under another name

    # ------------------------------------------------------------------------------- statements
    def body(self, statements: Iterable[ast.stmt], depth: int) -> list[str]:
        return [line for s in statements for line in self.whole_statement(s, depth)]

    def whole_statement(self, s: ast.stmt, depth: int) -> list[str]:
        """Return a statement, preceded by what must be computed before it."""
        outside, self.pre = self.pre, []
        lines = self.statement(s, depth)
        lines = ["    " * depth + x for x in self.pre] + lines
        self.pre = outside
        return lines

    def statement(self, s: ast.stmt, depth: int) -> list[str]:
        pad = "    " * depth
        if isinstance(s, ast.Pass) or (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)):
            return []
        if isinstance(s, ast.Expr) and isinstance(s.value, ast.Call):
            if ast.unparse(s.value.func) == "self.refuse":
                return self.refusal(s.value, pad)
            return self.procedure_call(s.value, pad)
        if isinstance(s, ast.Assign | ast.AnnAssign):
            target = s.targets[0] if isinstance(s, ast.Assign) else s.target
            if isinstance(s, ast.Assign) and (len(s.targets) > 1 or isinstance(target, ast.Tuple)):
                raise self.refuse(s, "one target an assignment: write one line for each")
            if s.value is None:
                return []
            return self.assign(target, s.value, pad)
        if isinstance(s, ast.AugAssign):
            return self.assign(s.target, ast.copy_location(ast.BinOp(s.target, s.op, s.value), s), pad)
        if isinstance(s, ast.If):
            return self.branch(s, depth)
        if isinstance(s, ast.For):
            return self.loop(s, depth)
        if isinstance(s, ast.Return):
            return self.return_value(s, pad)
        if isinstance(s, ast.While):
            raise self.refuse(s, "no while: write `for k in range(n)` with a fixed n, and `if` inside")
        raise self.refuse(s, f"`{ast.unparse(s).splitlines()[0]}` is outside the subset of equations")

    def procedure_call(self, e: ast.Call, pad: str) -> list[str]:
        """Return the call of a procedure on a line of its own: it writes, and may refuse."""
        code = None if e.keywords else self.callee(e)
        if code is None:
            raise self.refuse(e, f"`{ast.unparse(e)}` is outside the subset of equations")
        if gives_value(code.node):
            raise self.refuse(e, f"{ast.unparse(e.func)} returns a value: assign it")
        if self.returns_value:
            raise self.refuse(e, f"{self.name} returns a value and so writes nothing: {code.node.name} may write")
        procedure, args = self.invoke(e, code)
        for name in sorted(procedure.touched):
            if not self.may_write(name):
                raise self.refuse_write(e, name, ast.unparse(e.func))
        self.touched |= procedure.touched
        self.refuses |= procedure.refuses
        return [f"{pad}{procedure.name}({args});", *([f"{pad}if (part->failed) return;"] * procedure.refuses)]

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
            raise self.refuse(s, "only `for k in range(n)` and `for k in range(a, b)`")
        bounds = [self.index(a) for a in call.args]
        (first, (lo, _)), (last, (_, end)) = bounds if len(bounds) == 2 else (("0", (0, 0)), bounds[0])
        k = s.target.id
        if k in self.locals or k in self.arguments or k in self.loops:
            raise self.refuse(s, f"the loop variable {k!r} has a name that is in use")
        self.loops[k] = (lo, None if end is None else end - 1)
        before = set(self.assigned)
        lines = [
            f"{pad}for (int {local(k)} = {first}; {local(k)} < {last}; {local(k)}++) {{",
            *self.body(s.body, depth + 1),
            f"{pad}}}",
        ]
        if lo is None or end is None or end <= lo:  # possibly no iteration
            self.assigned = before
        del self.loops[k]
        return lines

    def branch(self, s: ast.If, depth: int) -> list[str]:
        pad = "    " * depth
        before = set(self.assigned)
        lines = [f"{pad}if ({self.condition(s.test)}) {{", *self.body(s.body, depth + 1)]
        then, self.assigned = self.assigned, before
        if s.orelse:
            lines += [f"{pad}}} else {{", *self.body(s.orelse, depth + 1)]
        if returns(s.orelse):
            self.assigned = then
        elif not returns(s.body):
            self.assigned = then & self.assigned
        return [*lines, f"{pad}}}"]

    def return_value(self, s: ast.Return, pad: str) -> list[str]:
        if s.value is None:
            return [f"{pad}return;"]
        if not self.returns_value:
            raise self.refuse(s, f"{self.name} returns nothing")
        self.no_view(s.value, "returned")
        result = self.value(s.value)
        if self.result is not None and result.shape != self.result:
            raise self.refuse(s, f"{self.name} returns {words(self.result)} above and {words(result.shape)} here")
        self.result = result.shape
        if not result.shape:
            return [f"{pad}return {result.text};"]
        if not result.aligned:
            result = self.of_place(self.kept(result))
        return [*(f"{pad}out_{''.join(f'[{k}]' for k in i)} = {result.element(*i)};" for i in cells(result.shape)),
                f"{pad}return;"]  # fmt: skip

    # ------------------------------------------------------------------------------- assignments
    def assign(self, target: ast.expr, value: ast.expr, pad: str) -> list[str]:
        if isinstance(target, ast.Name):
            return self.assign_local(target, value, pad)
        to = self.place(target)
        if to.kind == "local":
            if to.name in self.arguments or to.name in self.views:
                raise self.refuse(target, f"the elements of {to.name!r} are only read: copy it by vector()")
            if to.name not in self.bare and self.locals.get(to.name) is None:
                raise self.refuse(target, f"{to.name!r} is not an array")
        elif to.kind != "self" or not self.may_write(to.name):
            raise self.refuse_write(target, to.name, ast.unparse(target))
        if to.kind == "self":
            self.touched.add(to.name)
        if not to.shape:
            return self.store(to, self.number(self.expression(value)), pad)
        if to.taken:
            self.no_view(value, "stored in another", even_inputs=True)
        return self.store(to, self.fitting(target, value, to), pad)

    def assign_local(self, target: ast.Name, value: ast.expr, pad: str) -> list[str]:
        name = target.id
        if name in self.loops:
            raise self.refuse(target, f"the loop variable {name!r} is not assigned to")
        if isinstance(value, ast.List):
            assigned = self.literal(value)
            self.bare.add(name)
        else:
            if isinstance(value, ast.Call) and (direct := self.direct(name, value, pad)) is not None:
                return direct
            is_view = self.no_view(value, "assigned to a local")
            self.views = self.views | {name} if is_view else self.views - {name}
            assigned = self.value(value)
            if assigned.shape:
                self.bare.discard(name)
        known = self.arguments.get(name, self.locals.get(name, assigned.shape))
        if known != assigned.shape or (assigned.shape and name in self.arguments):
            raise self.refuse(target, f"{name!r} is something else already, {words(known)}")
        if name not in self.arguments:
            self.locals.setdefault(name, assigned.shape)
        to = CVariable(local(name), "local", name, assigned.shape)
        if assigned.shape and not assigned.aligned and f"local.{name}" in assigned.reads:
            assigned = self.of_place(self.kept(assigned))
        self.assigned.add(name)
        return self.store(to, assigned, pad)

    def direct(self, name: str, e: ast.Call, pad: str) -> list[str] | None:
        """Return ``w = procedure(...)`` where the procedure writes into the local itself; None where it does not."""
        code = None if e.keywords else self.callee(e)
        read = {n.id for n in ast.walk(e) if isinstance(n, ast.Name)}
        if code is None or not gives_value(code.node) or name in read or name in self.arguments:
            return None
        procedure, args = self.invoke(e, code)
        if not procedure.shape:
            self.touched |= procedure.touched
            self.locals.setdefault(name, ())
            if self.locals[name]:
                raise self.refuse(e, f"{name!r} is {words(self.locals[name])} already: take another name")
            self.assigned.add(name)
            return [f"{pad}{local(name)} = {procedure.name}({args});"]
        if self.locals.setdefault(name, procedure.shape) != procedure.shape:
            raise self.refuse(e, f"{name!r} is {words(self.locals[name])} already: take another name")
        self.bare.discard(name)
        self.assigned.add(name)
        return [f"{pad}{procedure.name}({args}, {local(name)});"]

    def no_view(self, value: ast.expr, what: str, even_inputs: bool = False) -> bool:
        """Refuse an array that is handed on as it is: the same one in Python, a copy in C.

        Return True for an input or a parameter, which does not change: a local that only reads it is the same in both.
        """
        if isinstance(value, ast.Name | ast.Attribute | ast.Subscript) and not self.transposes(value):
            before = len(self.pre), self.temporaries
            at = self.place(value)
            del self.pre[before[0] :]
            self.temporaries = before[1]
            if at.shape and not TEMPORARY.fullmatch(at.name):
                fixed = at.kind == "self" and isinstance(self.declared.get(at.name), Parameter | Input)
                if fixed and not even_inputs:
                    return True
                text = ast.unparse(value)
                raise self.refuse(value, f"{text} is an array, {what} as it is: write vector({text}), a copy")
        return False

    def fitting(self, target: ast.expr, value: ast.expr, to: CVariable) -> CExpression:
        assigned = self.literal(value) if isinstance(value, ast.List) else self.value(value)
        if assigned.shape != to.shape:
            text = ast.unparse(target)
            raise self.refuse(target, f"{text} is {words(to.shape)}, what is assigned to it {words(assigned.shape)}")
        if not assigned.aligned and f"{to.kind}.{to.name}" in assigned.reads:
            assigned = self.of_place(self.kept(assigned))
        return assigned

    def store(self, to: CVariable, value: CExpression, pad: str) -> list[str]:
        lines: list[str] = []
        to = self.settled(to)
        for i in cells(to.shape):
            text, at = value.element(*i), to.at(*i)
            if to.kind == "local":
                lines.append(f"{pad}{at} = {text};")
            elif self.dual:
                lines.append(f"{pad}{{ dual r_ = {text}; self->{at} = r_.v; seed->{at} = r_.d; }}")
            else:
                lines.append(f"{pad}self->{at} = {text};")
        return lines

    def may_write(self, name: str) -> bool:
        if name.startswith("noise.") or (self.kind == PROCEDURE and self.returns_value):
            return False
        if name.startswith("der."):
            return self.kind in ("flow", PROCEDURE)
        decl = self.declared.get(name)
        allowed = (Discrete, State, Output) if self.kind == PROCEDURE else WRITABLE[self.kind]
        return isinstance(decl, allowed) and not isinstance(decl, Parameter)

    def refuse_write(self, node: ast.AST, name: str, source: str) -> SubsetError:
        text = f"{self.name}() does not write {source}"
        if self.kind == PROCEDURE and self.returns_value:
            return self.refuse(node, f"{text}: a procedure that returns a value writes nothing")
        if isinstance(self.declared.get(name), Parameter | Input):
            return self.refuse(node, f"{text}: parameters and inputs are only read; use a local or a Discrete")
        return self.refuse(node, f"{text}: it writes {HINTS.get(self.kind, 'discretes and states')} only")

    def refusal(self, call: ast.Call, pad: str) -> list[str]:
        if self.returns_value or self.code.owner is None:
            raise self.refuse(call, "a procedure that returns a value does not refuse: do it where it is called")
        if len(call.args) != 2 or not isinstance(call.args[1], ast.Constant) or not isinstance(call.args[1].value, str):
            raise self.refuse(call, 'write self.refuse(condition, "message with {H}")')
        self.refuses = True
        message = call.args[1].value
        if self.code.placed:
            message = message.replace("{self}", self.code.placed.name)
        names = [self.code.flat(n) for n in re.findall(r"\{(\w+)\}", message)]
        for n in names:
            if n not in self.declared or self.declared[n].shape:
                raise self.refuse(call, f"{{{n}}} is not a scalar of this part")
        text = re.sub(r"\{\w+\}", "%g", message.replace("%", "%%")).replace("\\", "\\\\").replace('"', '\\"')
        values = "".join(f"plain(self->{member(n)}), " for n in names)
        return [
            f"{pad}if ({self.condition(call.args[0])}) {{",
            f'{pad}    fail(part, "{text} (t = %.9g s)", {values}self->t);',
            f"{pad}    return;",
            f"{pad}}}",
        ]

    # --------------------------------------------------------------------------------- function
    def text(self, name: str) -> tuple[str, str]:
        """Return the C function under ``name``: its head and the whole."""
        number = "dual" if self.dual else "double"
        seed = ", Vars *seed" if self.dual else ""
        lines = self.body(self.code.node.body, 1)
        args = "".join(f", {number} {local(a)}{dimensions(s)}" for a, s in self.arguments.items())
        args += f", {number} out_{dimensions(self.result)}" if self.result else ""
        kind = number if self.returns_value and not self.result else "void"
        head = f"static inline {kind} {name}(Part *part{seed}{args})"
        zero = "{0.0, 0.0}" if self.dual else "0.0"
        declared = [
            f"    {number} {c_name}{dimensions(shape)}{'' if shape else f' = {zero}'};"
            for n, shape in self.locals.items()
            for c_name in [n if TEMPORARY.fullmatch(n) else local(n)]
        ]
        opening = ["    Vars *self = &part->n.v;"]
        if not any("self->" in x for x in lines):
            opening.append("    (void)self;")
        if self.dual and not any("seed" in x for x in lines):
            opening.append("    (void)seed;")
        return head, "\n".join([f"{head} {{", *opening, *declared, *lines, "}"])
