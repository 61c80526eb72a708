"""Direct dependencies of the outputs of a part, read from the syntax trees, along all calls."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from typing import TypeAlias

from gyrobench.component import Discrete, Input, Output, Parameter, State
from gyrobench.component.composition import TIMES
from gyrobench.component.math import ARRAY_FUNCTIONS, FUNCTIONS
from gyrobench.packaging.source import Code, PartCode, dotted

Reach: TypeAlias = dict[str, set[str]]  # variable -> the known variables it follows
REFUSAL = "refuse"  # of a reach: whether the part refuses


def called(e: ast.AST, code: Code, source: PartCode) -> Code | None:
    """Return the procedure or function that an expression calls; None where it does not call one of the part's."""
    if not isinstance(e, ast.Call):
        return None
    if isinstance(e.func, ast.Name):
        language = e.func.id in FUNCTIONS or e.func.id in ARRAY_FUNCTIONS
        return None if language else source.function(e.func.id, code)
    if isinstance(e.func, ast.Attribute):
        of = dotted(e.func.value)
        if of == "self":
            return source.method(e.func.attr, code)
        if of == "super()":
            return source.base_method(e.func.attr, code)
        if of.startswith("self."):
            return source.block_method(of.removeprefix("self."), e.func.attr, code)
    return None


class Dependencies:
    """The known variables (declared names) that the variables written by some kinds of equations depend on.

    reach: what is known of them before.
    """

    def __init__(
        self, source: PartCode, kinds: Iterable[str], known: Iterable[str], reach: Reach | None = None
    ) -> None:
        self.source = source
        self.known = set(known)
        self.reach: Reach = reach or {}
        before: Reach | None = None
        while before != self.reach:  # until nothing changes: loops carry values from one turn to the next
            before = {k: set(v) for k, v in self.reach.items()}
            for kind in kinds:
                for _, code in source.equations[kind]:
                    self.run(code.node.body, code, {}, set())

    def read(self, e: ast.AST, code: Code, locals_: Reach) -> set[str]:
        """Return the known variables that an expression follows."""
        if isinstance(e, ast.Name):
            return set(locals_.get(e.id, set()))
        if isinstance(e, ast.Attribute):
            name = flat_name(e, code, self.source)
            if name is not None:
                return self.reach.get(name, set()) | ({name} & self.known)
        inputs: set[str] = set()
        callee = called(e, code, self.source)
        if callee is not None:
            assert isinstance(e, ast.Call)
            args = [self.read(a, code, locals_) for a in e.args]
            inner = dict(zip(callee.arguments, args, strict=False))
            return inputs.union(*args, self.run(callee.node.body, callee, inner, set()))
        for child in ast.iter_child_nodes(e):
            inputs |= self.read(child, code, locals_)
        return inputs

    def run(self, statements: Iterable[ast.stmt], code: Code, locals_: Reach, under: set[str]) -> set[str]:
        """Follow statements; return what their returned values depend on.  under: what decides whether they run."""
        under, given = set(under), set()
        for s in statements:
            if isinstance(s, ast.Assign | ast.AugAssign | ast.AnnAssign) and s.value is not None:
                target = s.targets[0] if isinstance(s, ast.Assign) else s.target
                base = target
                while isinstance(base, ast.Subscript):
                    base = base.value
                follows = self.read(s.value, code, locals_) | self.read(target, code, locals_) | under
                name = flat_name(base, code, self.source)
                where = self.reach if name is not None else locals_
                where.setdefault(name if name is not None else ast.unparse(base), set()).update(follows)
            elif isinstance(s, ast.Expr):
                follows = self.read(s.value, code, locals_)  # of a procedure: what it writes
                if isinstance(s.value, ast.Call) and dotted(s.value.func) == "self.refuse":
                    self.reach.setdefault(REFUSAL, set()).update(follows | under)
                callee = called(s.value, code, self.source)
                if callee is not None and under:
                    for name in written_names(callee, self.source):
                        self.reach.setdefault(name, set()).update(under)
            elif isinstance(s, ast.Return):
                given |= under | (self.read(s.value, code, locals_) if s.value is not None else set())
            elif isinstance(s, ast.If):
                test = self.read(s.test, code, locals_)
                given |= self.run(s.body, code, locals_, under | test)
                given |= self.run(s.orelse, code, locals_, under | test)
                if any(isinstance(n, ast.Return) for n in ast.walk(s)):
                    under |= test  # what follows runs or does not
            elif isinstance(s, ast.For):
                given |= self.run(s.body, code, locals_, under | self.read(s.iter, code, locals_))
        return given


def flat_name(e: ast.AST, code: Code, source: PartCode) -> str | None:
    """Return the part's name of ``self.X``, ``self.der.X``, ``self.noise.X`` or ``self.block.X``; None otherwise."""
    if not isinstance(e, ast.Attribute):
        return None
    of = dotted(e.value)
    if e.attr in TIMES and of == "self":
        return e.attr
    if of == "self":
        return code.flat(e.attr)
    if of in ("self.der", "self.noise"):
        return f"{of.removeprefix('self.')}.{code.flat(e.attr)}"
    blocks = code.placed.blocks if code.placed else source.cls.placed
    placed = blocks.get(of.removeprefix("self.")) if of.startswith("self.") else None
    return placed.names.get(e.attr) if placed else None


def reached(code: Code, source: PartCode) -> Iterator[Code]:
    """Yield a piece of code and all that it calls."""
    codes: list[Code] = [code]
    for c in codes:
        yield c
        for n in c.nodes():
            callee = called(n, c, source)
            if callee is not None and all(
                callee.function is not s.function or callee.placed is not s.placed for s in codes
            ):
                codes.append(callee)


def read_names(code: Code, source: PartCode) -> set[str]:
    """Return every variable that is named in a piece of code and in what it calls."""
    return {name for c in reached(code, source) for n in c.nodes() if (name := flat_name(n, c, source)) is not None}


def written_names(code: Code, source: PartCode) -> set[str]:
    """Return every variable that a piece of code, or what it calls, writes."""
    names: set[str] = set()
    for c in reached(code, source):
        for n in c.nodes():
            if isinstance(n, ast.Assign | ast.AugAssign | ast.AnnAssign):
                base: ast.AST = n.targets[0] if isinstance(n, ast.Assign) else n.target
                while isinstance(base, ast.Subscript):
                    base = base.value
                name = flat_name(base, c, source)
                if name is not None:
                    names.add(name)
    return names


def _declared(source: PartCode, *kinds: type) -> list[str]:
    return [n for n, d in source.cls.declarations.items() if isinstance(d, kinds)]


def dependencies(source: PartCode) -> dict[str, set[str]]:
    """Return output (declared name) -> the inputs that it follows without delay."""
    reach = Dependencies(source, ["outputs"], _declared(source, Input)).reach
    return {n: reach.get(n, set()) for n in _declared(source, Output)}


def initial_dependencies(source: PartCode) -> dict[str, set[str]]:
    """Return what outputs ("y") and derivatives ("der.x") follow during initialization, declared names.

    Parameters, inputs and start values of states; there the equations of the start, of the outputs and of the
    derivatives are evaluated one after another.
    """
    known = _declared(source, Parameter, Input, State)
    drawn = {f"noise.{n.name}": {n.name, "seed"} & set(known) for n in source.cls.noises}
    reach = Dependencies(source, ["start", "outputs", "flow"], known, drawn).reach
    names = [*_declared(source, Output), *(f"der.{n}" for n in _declared(source, State))]
    return {n: reach.get(n, set()) for n in names}


def written(source: PartCode) -> set[str]:
    """Return the discretes that a sampled method writes; the others keep what ``start`` gave them."""
    names: set[str] = set()
    for _, code in source.equations["sampled"]:
        names |= written_names(code, source)
    return {n for n in names if isinstance(source.cls.declarations.get(n), Discrete)}


def moved(source: PartCode) -> set[str]:
    """Return the discretes that follow inputs or states while the part steps."""
    reach = Dependencies(source, ["flow", "outputs", "sampled"], _declared(source, Input, State)).reach
    return {n for n in written(source) if reach.get(n)}


def followed(source: PartCode) -> list[str] | None:
    """Return the inputs and changing discretes that ``outputs`` reads, discretes first; none: the outputs stay.

    None where it reads states, noise or time, with which it changes at every step, and where it is too short (no loop,
    no product of arrays) to be worth looking.
    """
    read = set().union(*(read_names(code, source) for _, code in source.equations["outputs"]))
    declared = source.cls.declarations
    if any(n in TIMES or n.startswith(("der.", "noise.")) or isinstance(declared.get(n), State) for n in read):
        return None
    changing = written(source)
    found = [n for n in declared if n in read & changing] + [
        n for n in declared if n in read and isinstance(declared[n], Input)
    ]
    codes = [c for _, code in source.equations["outputs"] for c in reached(code, source)]
    long = any(isinstance(n, ast.For | ast.MatMult) for c in codes for n in c.nodes())
    return found if long or not found else None
