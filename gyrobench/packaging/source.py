"""The source text of a part: the syntax trees of its equations and procedures, its constants, its names in C."""

from __future__ import annotations

import ast
import functools
import math
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any

from gyrobench.component import Block, Component
from gyrobench.component import math as language
from gyrobench.component.composition import EQUATIONS, Piece, Placed
from gyrobench.component.declarations import floats
from gyrobench.errors import GyrobenchError

KEYWORDS = {
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "float", "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed",
    "sizeof", "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
    # macros of the C library and of core.h
    "NAN", "INFINITY", "HUGE_VAL", "NULL", "EOF", "BUFSIZ", "errno", "stdin", "stdout", "stderr", "GAMMA", "AHEAD",
    "PATIENCE", "NEVER_INLINE", "COLD", "OF_MATRIX", "BY_PROCESSOR", "CAN_BE_LINKED", "APART", "SHARED", "LINKED_FORM",
    "MODEL_GUID", "N_REFERENCES", "U0", "Y0", "X0", "DX0", "N_U", "N_Y", "N_X", "N_PORTS", "N_STREAMS",
    "N_BOUNDS", "N_WATCHED", "N_STEPPED", "N_FOLLOWED", "N_DERIVED", "NONLINEAR", "MIDPOINT", "RK4_SUBSTEPS",
    "LARGEST_STEP",
}  # fmt: skip
MEMBERS = KEYWORDS | {"tick"}  # of struct Vars
LOCALS = KEYWORDS | {"part", "self", "seed", "dual", "Vars", "Part", "plain", "fail", "at", "whole"}


class SubsetError(GyrobenchError):
    """An equation uses Python outside the subset; the text says file, line and what to write instead."""


def member(name: str) -> str:
    """Return the C name of a declared quantity in struct Vars."""
    return name + "_" if name in MEMBERS or name.endswith("_") or name.startswith("EF_") else name


def local(name: str) -> str:
    """Return the C name of a local variable or an argument."""
    return name + "_" if name in LOCALS or name.endswith("_") or name.startswith(("d_", "f_", "EF_")) else name


@functools.lru_cache(maxsize=256)
def _functions(path: str, _changed: float) -> dict[tuple[str, int], ast.FunctionDef]:
    """Return the functions and methods of a file by name and first line, that of a decorator where there is one."""
    tree = ast.parse(Path(path).read_text(encoding="utf-8"))
    found = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
    return {(n.name, min([n.lineno, *(d.lineno for d in n.decorator_list)])): n for n in found}


@functools.lru_cache(maxsize=4096)
def _nodes(function: ast.FunctionDef) -> list[ast.AST]:
    return [n for s in function.body for n in ast.walk(s)]


def dotted(e: ast.expr) -> str:
    """Return the text of an expression, without the detour of :func:`ast.unparse` where it is a name with dots."""
    if isinstance(e, ast.Name):
        return e.id
    if isinstance(e, ast.Attribute) and isinstance(e.value, ast.Name | ast.Attribute):
        return f"{dotted(e.value)}.{e.attr}"
    return ast.unparse(e)


@dataclass(frozen=True)
class Code:
    """One method or function: its syntax tree, and where its names lead.

    owner: the class (of the part or of a block) whose method it is; None for a function of a module.  placed: the
    block in which it stands.
    """

    function: FunctionType
    node: ast.FunctionDef
    owner: type | None
    placed: Placed | None

    @property
    def path(self) -> str:
        return self.function.__code__.co_filename

    def refuse(self, node: ast.AST, what: str) -> SubsetError:
        return SubsetError(f"{self.path}:{getattr(node, 'lineno', 0)}: {what}")

    def flat(self, name: str) -> str:
        """Return the part's name of ``self.name``."""
        return self.placed.names.get(name, f"{self.placed.name}.{name}") if self.placed else name

    def constant(self, name: str, of_self: bool = False) -> float | None:
        """Return the number that a name stands for: of the class (``self.name`` too), or of the module."""
        x = getattr(self.owner, name, None) if self.owner is not None else None
        if x is None and not of_self:
            x = self.function.__globals__.get(name)
        return float(x) if isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x) else None

    def array(self, name: str) -> ast.List | None:
        """Return the list of numbers that the module gives a name to; None where it gives none."""
        x = self.function.__globals__.get(name)
        return ast.parse(repr(floats(x)), mode="eval").body if isinstance(x, list) else None  # type: ignore[return-value]

    def nodes(self) -> list[ast.AST]:
        """Return every node of the body."""
        return _nodes(self.node)

    @property
    def arguments(self) -> list[str]:
        names = [a.arg for a in self.node.args.args]
        return names[1:] if self.owner is not None else names


def read_code(function: Any, owner: type | None, placed: Placed | None) -> Code:
    """Return the code of a function.  Raises SubsetError where there is no file to read it from."""
    at = function.__code__
    path = Path(at.co_filename)
    if not path.is_file():
        raise SubsetError(f"{function.__qualname__}: equations must stand in a file, this one is in {at.co_filename}")
    node = _functions(str(path), path.stat().st_mtime).get((function.__name__, at.co_firstlineno))
    if node is not None:
        return Code(function, node, owner, placed)
    raise SubsetError(f"{path}:{at.co_firstlineno}: {function.__qualname__} is not found in its file: was it changed?")


class PartCode:
    """The code of a part: its equations, and the procedures and functions that they call."""

    def __init__(self, cls: type[Component]) -> None:
        self.cls = cls
        self.equations: dict[str, list[tuple[Piece, Code]]] = {}
        for kind, pieces in cls.pieces.items():
            self.equations[kind] = [(p, self.code_of(p)) for p in pieces]

    def code_of(self, piece: Piece) -> Code:
        """Return the code of an equation.  Raises SubsetError where it takes more than self."""
        owner = type(piece.placed.block) if piece.placed else self.cls
        code = read_code(piece.function, owner, piece.placed)
        _plain_arguments(code)
        if code.arguments:
            raise code.refuse(code.node, f"{code.node.name}() takes self only")
        return code

    def uncalled(self) -> list[Code]:
        """Return the procedures of the part and of its blocks, called or not.  Raises SubsetError."""
        procedures: list[Code] = []
        pending = list(self.cls.placed.values())
        classes: list[tuple[type, Placed | None]] = [(self.cls, None)]
        while pending:
            inner = pending.pop()
            classes.append((type(inner.block), inner))
            pending += inner.blocks.values()
        for owner, p in classes:
            for klass in owner.__mro__:
                if klass in (object, Component, Block):
                    continue
                for name, f in vars(klass).items():
                    if isinstance(f, FunctionType) and procedure_name(name, f):
                        code = read_code(f, owner, p)
                        _plain_arguments(code)
                        if gives_value(code.node) and not returns(code.node.body):
                            raise code.refuse(code.node, f"{name}() returns a number on every path, or on none")
                        procedures.append(code)
        return procedures

    def method(self, name: str, code: Code) -> Code | None:
        """Return the procedure that ``self.name(...)`` calls in ``code``; None where there is none of that name."""
        return self._procedure(getattr(code.owner, name, None), name, code)

    def base_method(self, name: str, code: Code) -> Code | None:
        """Return the procedure that ``super().name(...)`` calls in ``code``; None where the bases have none."""
        inside = dict(zip(code.function.__code__.co_freevars, code.function.__closure__ or (), strict=True))
        if code.owner is None or "__class__" not in inside:
            return None
        return self._procedure(getattr(super(inside["__class__"].cell_contents, code.owner), name, None), name, code)

    def _procedure(self, f: Any, name: str, code: Code) -> Code | None:
        if not isinstance(f, FunctionType) or f is vars(Component).get(name) or not procedure_name(name, f):
            return None
        return read_code(f, code.owner, code.placed)

    def block_method(self, block: str, name: str, code: Code) -> Code | None:
        """Return the procedure that ``self.block.name(...)`` calls in ``code``."""
        blocks = code.placed.blocks if code.placed else self.cls.placed
        placed = blocks.get(block)
        f = getattr(type(placed.block), name, None) if placed else None
        if placed is None or not isinstance(f, FunctionType) or not procedure_name(name, f):
            return None
        return read_code(f, type(placed.block), placed)

    def function(self, name: str, code: Code) -> Code | None:
        """Return the function of a module that ``name(...)`` calls in ``code``; None for one of the language."""
        f = code.function.__globals__.get(name)
        if not isinstance(f, FunctionType) or f is getattr(language, name, None):
            return None
        callee = read_code(f, None, None)
        _plain_arguments(callee)
        return callee


def procedure_name(name: str, f: Any) -> bool:
    """Return whether a method is a procedure: not an equation, not one of Python's own."""
    return name not in EQUATIONS and not hasattr(f, "_every") and not name.startswith("__")


def _plain_arguments(code: Code) -> None:
    a = code.node.args
    if a.defaults or a.kwonlyargs or a.vararg or a.kwarg or a.posonlyargs:
        raise code.refuse(code.node, f"{code.node.name}() takes plain arguments without defaults")


def gives_value(node: ast.FunctionDef) -> bool:
    """Return whether a function returns a value anywhere."""
    return any(isinstance(n, ast.Return) and n.value is not None for n in ast.walk(node))


def returns(statements: list[ast.stmt]) -> bool:
    """Return whether these statements end in a return on every path."""
    last = statements[-1] if statements else None
    if isinstance(last, ast.If):
        return returns(last.body) and returns(last.orelse)
    return isinstance(last, ast.Return)
