"""Closed formulas as text: sums, products, powers and a few functions of named quantities, in Python and in a web page.

Not modelled: units (every quantity is SI), conditions (``step(x)`` is 1 from x = 0 on, else 0).
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from gyrobench.errors import GyrobenchError

Values = np.ndarray[Any, np.dtype[np.float64]]
#: name -> the function in Python, and in a page
FUNCTIONS: dict[str, tuple[Callable[..., Any], str]] = {
    "sin": (np.sin, "Math.sin"), "cos": (np.cos, "Math.cos"), "tan": (np.tan, "Math.tan"), "exp": (np.exp, "Math.exp"),
    "log": (np.log, "Math.log"), "sqrt": (np.sqrt, "Math.sqrt"), "atan": (np.arctan, "Math.atan"),
    "acos": (np.arccos, "Math.acos"), "abs": (np.abs, "Math.abs"),
    "step": (lambda x: np.heaviside(x, 1.0), "((x) => Number(x >= 0))"),
}  # fmt: skip
CONSTANTS = {"pi": np.pi}
SIGNS: dict[type[ast.operator], tuple[Callable[[Any, Any], Any], str]] = {
    ast.Add: (np.add, "+"), ast.Sub: (np.subtract, "-"), ast.Mult: (np.multiply, "*"), ast.Div: (np.divide, "/"),
    ast.Pow: (np.power, "**"),
}  # fmt: skip


class FormulaError(GyrobenchError, ValueError):
    """A text that is no formula; the message says which part."""


class Formula:
    """A formula.  names: of the quantities in it, sorted.  Raises FormulaError."""

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            self._tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError):
            raise FormulaError(f"'{text}': not a formula; write it like a*sin(b*t) + c/2") from None
        names: set[str] = set()
        self._walk(self._tree, lambda x: x, names.add, lambda *_: None, lambda *_: None)
        self.names = sorted(names - CONSTANTS.keys())

    def value(self, given: Mapping[str, float | Values]) -> Values:
        """Return its value; quantities are numbers or arrays of one shape, SI.  Raises KeyError for one that lacks."""
        known = {**CONSTANTS, **given}
        return np.asarray(
            self._walk(
                self._tree, np.float64, lambda n: known[n], lambda sign, a, b: SIGNS[sign][0](a, b),
                lambda name, x: FUNCTIONS[name][0](x),
            ),
            dtype=float,
        )  # fmt: skip

    def script(self, place: Callable[[str], str]) -> str:
        """Return it for a web page.  place: name of a quantity -> where it stands there."""

        def named(name: str) -> str:
            return repr(CONSTANTS[name]) if name in CONSTANTS else place(name)

        made: str = self._walk(
            self._tree, lambda x: f"({x!r})", named, lambda sign, a, b: f"({a} {SIGNS[sign][1]} {b})",
            lambda name, x: f"{FUNCTIONS[name][1]}({x})",
        )  # fmt: skip
        return made

    def _walk(
        self, node: ast.expr, number: Callable[[float], Any], name: Callable[[str], Any],
        joined: Callable[[type[ast.operator], Any, Any], Any], called: Callable[[str, Any], Any],
    ) -> Any:  # fmt: skip
        def inner(child: ast.expr) -> Any:
            return self._walk(child, number, name, joined, called)

        match node:
            case ast.Constant(value=int() | float() as x) if not isinstance(x, bool):
                return number(float(x))
            case ast.Name(id=word):
                return name(word)
            case ast.UnaryOp(op=ast.USub(), operand=x):
                return joined(ast.Sub, number(0.0), inner(x))
            case ast.BinOp(left=a, op=sign, right=b) if type(sign) in SIGNS:
                return joined(type(sign), inner(a), inner(b))
            case ast.Call(func=ast.Name(id=word), args=[x], keywords=[]) if word in FUNCTIONS:
                return called(word, inner(x))
        raise FormulaError(f"'{self.text}': {ast.unparse(node)} has no place in a formula")
