"""The source text of a part: its methods, its constants, its names in C, and what its outputs depend on."""

from __future__ import annotations

import ast
import inspect
import math
import sys
from collections.abc import Iterable
from pathlib import Path

from gyrobench.component import Component, Discrete, Input, Output, State
from gyrobench.errors import GyrobenchError

KEYWORDS = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
    # macros of the C library and of core.h
    "NAN", "INFINITY", "HUGE_VAL", "NULL", "EOF", "BUFSIZ", "errno", "stdin", "stdout", "stderr", "GAMMA", "AHEAD",
    "MODEL_GUID", "N_REFERENCES", "U0", "Y0", "X0", "DX0", "N_U", "N_Y", "N_X", "N_PORTS", "N_BOUNDS",
    "N_WATCHED", "N_STEPPED", "N_FOLLOWED", "NONLINEAR", "RK4_SUBSTEPS", "LARGEST_STEP",
}  # fmt: skip
MEMBERS = KEYWORDS | {"tick"}  # of struct Vars
LOCALS = KEYWORDS | {"part", "self", "seed", "dual", "Vars", "Part", "plain", "fail", "at", "whole"}


class SubsetError(GyrobenchError):
    """An equation uses Python outside the subset; the text says file, line and what to write instead."""


def member(name: str) -> str:
    """The C name of a declared quantity in struct Vars."""
    return name + "_" if name in MEMBERS or name.endswith("_") else name


def local(name: str) -> str:
    """The C name of a local variable or an argument."""
    return name + "_" if name in LOCALS or name.endswith("_") or name.startswith(("d_", "f_")) else name


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
            if isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v)
        }
        known = {"start", "flow", "outputs", *(n for n, _ in cls.ticks)}
        self.helpers = [n for n in self.methods if n not in known and not n.startswith("__")]
        for name, method in self.methods.items():
            a = method.args
            if a.defaults or a.kwonlyargs or a.vararg or a.kwarg or a.posonlyargs:
                raise self.refuse(method, f"{name}() takes plain arguments without defaults")
            if name in known and len(a.args) != 1:
                raise self.refuse(method, f"{name}() takes self only")
            if name in self.helpers and not returns(method.body):
                raise self.refuse(method, f"{name}() is a helper method: it returns a number on every path")

    def refuse(self, node: ast.AST, what: str) -> SubsetError:
        return SubsetError(f"{self.path}:{getattr(node, 'lineno', 0)}: {what}")


def returns(statements: list[ast.stmt]) -> bool:
    """Whether these statements end in a return on every path."""
    last = statements[-1] if statements else None
    if isinstance(last, ast.If):
        return returns(last.body) and returns(last.orelse)
    return isinstance(last, ast.Return)


# -------------------------------------------------------------------------------------- dependencies
class Dependencies:
    """Which inputs (declared names) the variables written by one method depend on, without delay."""

    def __init__(self, source: Source, method: str) -> None:
        self.source = source
        self.inputs = {n for n, d in source.cls.declarations.items() if isinstance(d, Input)}
        self.reach: dict[str, set[str]] = {}
        self.inside: set[str] = set()  # helpers being read
        node = source.methods.get(method)
        before: dict[str, set[str]] | None = None
        while before != self.reach:  # until nothing changes: loops carry values from one turn to the next
            before = {k: set(v) for k, v in self.reach.items()}
            self.run(node.body if node else [], set())

    def read(self, e: ast.AST) -> set[str]:
        found: set[str] = set()
        for n in ast.walk(e):
            if not isinstance(n, ast.Attribute | ast.Name):
                continue
            text = ast.unparse(n)
            name = text.removeprefix("self.")
            found |= self.reach.get(text, set())
            if text == name:
                continue
            if name in self.inputs:
                found.add(name)
            elif name in self.source.helpers and name not in self.inside:
                self.inside.add(name)
                found |= self.read(self.source.methods[name])
                self.inside.discard(name)
        return found

    def run(self, statements: Iterable[ast.stmt], under: set[str]) -> None:
        """``under``: what decides whether these statements run."""
        under = set(under)
        for s in statements:
            if isinstance(s, ast.Assign | ast.AugAssign | ast.AnnAssign) and s.value is not None:
                target = s.targets[0] if isinstance(s, ast.Assign) else s.target
                base = target
                while isinstance(base, ast.Subscript):
                    base = base.value
                self.reach.setdefault(ast.unparse(base), set()).update(self.read(s.value) | self.read(target) | under)
            elif isinstance(s, ast.If):
                test = self.read(s.test)
                self.run(s.body, under | test)
                self.run(s.orelse, under | test)
                if any(isinstance(n, ast.Return) for n in ast.walk(s)):
                    under |= test  # what follows runs or does not
            elif isinstance(s, ast.For):
                self.run(s.body, under | self.read(s.iter))


def dependencies(source: Source, method: str = "outputs") -> dict[str, set[str]]:
    """Output (declared name) -> the inputs it follows without delay."""
    reach = Dependencies(source, method).reach
    return {n: reach.get(f"self.{n}", set()) for n, d in source.cls.declarations.items() if isinstance(d, Output)}


# ------------------------------------------------------------------------------- what changes, what follows
def _members(source: Source, method: str, inside: frozenset[str] = frozenset()) -> set[str]:
    """Every `X` of a `self.X` in a method and in the helpers that it calls."""
    node = source.methods.get(method)
    names = {n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)} if node else set()
    for h in names & (set(source.helpers) - inside):
        names |= _members(source, h, inside | {method, h})
    return names


def written(source: Source) -> set[str]:
    """The discretes that a sampled method writes; the others keep what ``start`` gave them."""
    names: set[str] = set()
    for tick, _ in source.cls.ticks:
        for n in ast.walk(source.methods[tick]):
            if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store):
                names.add(n.attr)
            elif isinstance(n, ast.Subscript) and isinstance(n.ctx, ast.Store):
                names |= {a.attr for a in ast.walk(n.value) if isinstance(a, ast.Attribute)}
    return {n for n in names if isinstance(source.cls.declarations.get(n), Discrete)}


def followed(source: Source) -> list[str] | None:
    """The inputs and changing discretes that ``outputs`` reads, discretes first.  None where it reads states, noise or
    time, with which it changes at every step, and where it is too short (no loop) to be worth looking.
    """
    read = _members(source, "outputs")
    node = source.methods.get("outputs")
    if node is None or not any(isinstance(n, ast.For) for n in ast.walk(node)):
        return None
    declared = source.cls.declarations
    if read & {"t", "h", "der", "noise"} or any(isinstance(declared.get(n), State) for n in read):
        return None
    changing = written(source)
    return [n for n in declared if n in read & changing] + [
        n for n in declared if n in read and isinstance(declared[n], Input)
    ]
