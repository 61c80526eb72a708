"""Equations (a small subset of Python) to C.

The syntax tree of a part's methods becomes C line by line, twice: once for numbers, once for dual
numbers (the forward-mode derivative).  Nothing is simplified or reordered, so that both targets compute
the same bits.  What is outside the subset is refused with file, line and what to write instead.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from gyrobench.component import Discrete, Input, Output, Parameter, State
from gyrobench.packaging.expressions import Expressions, Shape
from gyrobench.packaging.source import Source, SubsetError, local, member, returns

WRITABLE: dict[str, tuple[type, ...]] = {
    "start": (Discrete, State),
    "flow": (),
    "outputs": (Output,),
}


class Method(Expressions):
    """Translates one method."""

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
                raise self.source.refuse(s, "one target an assignment: write one line for each")
            if s.value is None:
                return []
            if isinstance(s.value, ast.List):
                return self.array(target, s.value, pad)
            return self.assign(target, self.expression(s.value), pad)
        if isinstance(s, ast.AugAssign):
            value = ast.copy_location(ast.BinOp(s.target, s.op, s.value), s)
            return self.assign(s.target, self.expression(value), pad)
        if isinstance(s, ast.If):
            return self.branch(s, depth)
        if isinstance(s, ast.For):
            return self.loop(s, depth)
        if isinstance(s, ast.Return):
            if s.value is None:
                return [f"{pad}return;"]
            if not self.helper:
                raise self.source.refuse(s, f"{self.name} returns nothing")
            return [f"{pad}return {self.expression(s.value)};"]
        if isinstance(s, ast.While):
            raise self.source.refuse(s, "no while: write `for k in range(n)` with a fixed n, and `if` inside")
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
        (first, (lo, _)), (last, (_, end)) = bounds if len(bounds) == 2 else (("0", (0, 0)), bounds[0])
        k = s.target.id
        if k in self.locals or k in self.arguments or k in self.loops:
            raise self.source.refuse(s, f"the loop variable {k!r} has a name that is in use")
        self.loops[k] = (lo, None if end is None else end - 1)
        before = set(self.assigned)
        lines = [
            f"{pad}for (int {local(k)} = {first}; {local(k)} < {last}; {local(k)}++) {{",
            *self.body(s.body, depth + 1),
            f"{pad}}}",
        ]
        if lo is None or end is None or end <= lo:  # perhaps not one turn
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

    def assign(self, target: ast.expr, value: str, pad: str) -> list[str]:
        if isinstance(target, ast.Name):
            if target.id in self.loops:
                raise self.source.refuse(target, f"the loop variable {target.id!r} is not assigned to")
            if self.locals.get(target.id, ()):
                raise self.source.refuse(target, f"{target.id!r} is an array: write its elements")
            if target.id not in self.arguments:
                self.locals.setdefault(target.id, ())
            self.assigned.add(target.id)
            return [f"{pad}{local(target.id)} = {value};"]
        to = self.place(target)
        if to.shape:
            raise self.source.refuse(target, f"{ast.unparse(target)} is an array: write its elements")
        if to.kind == "local":
            return [f"{pad}{to.text} = {value};"]
        if to.kind != "self" or not self.may_write(to.name):
            raise self.refuse_write(target, to.name)
        if self.dual:
            return [f"{pad}{{ dual r_ = {value}; self->{to.text} = r_.v; seed->{to.text} = r_.d; }}"]
        return [f"{pad}self->{to.text} = {value};"]

    def may_write(self, name: str) -> bool:
        if name.startswith("der."):
            return self.name == "flow"
        decl = self.source.cls.declarations.get(name)
        return isinstance(decl, self.writes) and not isinstance(decl, Parameter)

    def refuse_write(self, target: ast.expr, name: str) -> SubsetError:
        text = f"{self.name}() does not write {ast.unparse(target)}"
        if isinstance(self.source.cls.declarations.get(name), Parameter | Input):
            return self.source.refuse(target, f"{text}: parameters and inputs are only read; use a local or a Discrete")
        may = {"flow": "self.der.X", "outputs": "outputs", "start": "discretes and states"}
        return self.source.refuse(target, f"{text}: it writes {may.get(self.name, 'discretes and states')} only")

    def array(self, target: ast.expr, value: ast.List, pad: str) -> list[str]:
        if not isinstance(target, ast.Name):
            raise self.source.refuse(target, "only a local array is made from a list: write self.X[i] = ...")
        rows = [r.elts if isinstance(r, ast.List) else None for r in value.elts]
        widths = {None if r is None else len(r) for r in rows}
        if len(widths) != 1 or 0 in widths:
            raise self.source.refuse(value, "an array is a list of numbers, or of lists of equal length")
        (width,) = widths
        shape: Shape = (len(rows),) if width is None else (len(rows), width)
        name = target.id
        if name in self.loops or name in self.arguments or self.locals.get(name, shape) != shape:
            raise self.source.refuse(target, f"{name!r} is something else already")
        cells = [(f"[{i}]", e) for i, e in enumerate(value.elts)]
        if width is not None:
            cells = [(f"[{i}][{j}]", e) for i, r in enumerate(rows) for j, e in enumerate(r or [])]
        lines = [f"{pad}{local(name)}{i} = {self.expression(e)};" for i, e in cells]
        self.locals[name] = shape
        self.assigned.add(name)
        return lines

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
        values = "".join(f"plain(self->{member(n)}), " for n in names)
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
            head = self.prototype()
        else:
            head = f"static inline void {self.name}{'_d' if self.dual else ''}(Part *part{seed})"
        lines = self.body(self.node.body, 1) if self.node else []
        zero = "{0.0, 0.0}" if self.dual else "0.0"
        declared = [
            f"    {number} {local(n)}{''.join(f'[{k}]' for k in shape)}{'' if shape else f' = {zero}'};"
            for n, shape in self.locals.items()
        ]
        opening = ["    Vars *self = &part->n.v;"]
        if not any("self->" in x for x in lines):
            opening.append("    (void)self;")
        if self.dual and not any("seed" in x for x in lines):
            opening.append("    (void)seed;")
        return "\n".join([f"{head} {{", *opening, *declared, *lines, "}"])

    def prototype(self) -> str:
        """The head of a helper method; inline, for not every helper is used by both flow and outputs."""
        number, seed, suffix = ("dual", ", Vars *seed", "_d") if self.dual else ("double", "", "_")
        args = "".join(f", {number} {local(a)}" for a in self.arguments)
        return f"static inline {number} {self.name}{suffix}(Part *part{seed}{args})"


def method_names(source: Source) -> list[str]:
    return ["start", "flow", "outputs", *(n for n, _ in source.cls.ticks)]


def equations(source: Source) -> str:
    """Every method of the part as C, helpers first."""
    out = []
    heads = [Method(source, h, dual, ()).prototype() + ";" for h in source.helpers for dual in (False, True)]
    if heads:
        out.append("\n".join(heads))
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
    out.append("\n".join(["static inline void ticks(Part *part) {", *(turns or ["    (void)part;"]), "}"]))
    return "\n\n".join(out)
