"""Functions that equations may call, for numbers and for dual numbers.

A :class:`Dual` carries a value and one directional derivative (forward mode).  The native target
repeats the same rules in C (``packaging/core.h``), operation by operation, so that the linearization,
and with it every integrated state, is bit-equal in both targets.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from gyrobench.component import elementary
from gyrobench.component.vectors import Vector as Vector
from gyrobench.component.vectors import cross as cross
from gyrobench.component.vectors import dot as dot
from gyrobench.component.vectors import vector as vector

pi = math.pi
TWO_PI = 2.0 * math.pi


class Dual:
    """``v`` and its derivative ``d`` along one direction."""

    __slots__ = ("d", "v")

    def __init__(self, v: float, d: float = 0.0) -> None:
        self.v = v
        self.d = d

    def __repr__(self) -> str:
        return f"Dual({self.v!r}, {self.d!r})"

    def __add__(self, o: Any) -> Dual:
        b = lift(o)
        return Dual(self.v + b.v, self.d + b.d)

    def __radd__(self, o: Any) -> Dual:
        return lift(o) + self

    def __sub__(self, o: Any) -> Dual:
        b = lift(o)
        return Dual(self.v - b.v, self.d - b.d)

    def __rsub__(self, o: Any) -> Dual:
        return lift(o) - self

    def __mul__(self, o: Any) -> Dual:
        if isinstance(o, list):  # a number times a vector: the vector knows how
            return NotImplemented
        b = lift(o)
        return Dual(self.v * b.v, self.d * b.v + self.v * b.d)

    def __rmul__(self, o: Any) -> Dual:
        return lift(o) * self

    def __truediv__(self, o: Any) -> Dual:
        b = lift(o)
        q = self.v / b.v
        return Dual(q, (self.d - q * b.d) / b.v)

    def __rtruediv__(self, o: Any) -> Dual:
        return lift(o) / self

    def __neg__(self) -> Dual:
        return Dual(-self.v, -self.d)

    def __pos__(self) -> Dual:
        return self

    def __lt__(self, o: Any) -> bool:
        return self.v < value(o)

    def __le__(self, o: Any) -> bool:
        return self.v <= value(o)

    def __gt__(self, o: Any) -> bool:
        return self.v > value(o)

    def __ge__(self, o: Any) -> bool:
        return self.v >= value(o)

    def __eq__(self, o: object) -> bool:
        return self.v == value(o)

    def __ne__(self, o: object) -> bool:
        return self.v != value(o)

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        return self.v != 0.0


Number: TypeAlias = Any  # float or Dual; equations are checked by the translator, not by types


def lift(x: Any) -> Dual:
    return x if isinstance(x, Dual) else Dual(float(x))


def value(x: Any) -> float:
    return x.v if isinstance(x, Dual) else x


def sin(x: Number) -> Number:
    return Dual(elementary.sin(x.v), elementary.cos(x.v) * x.d) if isinstance(x, Dual) else elementary.sin(x)


def cos(x: Number) -> Number:
    return Dual(elementary.cos(x.v), -elementary.sin(x.v) * x.d) if isinstance(x, Dual) else elementary.cos(x)


def tan(x: Number) -> Number:
    if isinstance(x, Dual):
        y = elementary.tan(x.v)
        return Dual(y, (1.0 + y * y) * x.d)
    return elementary.tan(x)


def asin(x: Number) -> Number:
    return Dual(elementary.asin(x.v), x.d / math.sqrt(1.0 - x.v * x.v)) if isinstance(x, Dual) else elementary.asin(x)


def atan(x: Number) -> Number:
    return Dual(elementary.atan(x.v), x.d / (1.0 + x.v * x.v)) if isinstance(x, Dual) else elementary.atan(x)


def atan2(y: Number, x: Number) -> Number:
    if isinstance(y, Dual) or isinstance(x, Dual):
        a, b = lift(y), lift(x)
        return Dual(elementary.atan2(a.v, b.v), (b.v * a.d - a.v * b.d) / (b.v * b.v + a.v * a.v))
    return elementary.atan2(y, x)


def sqrt(x: Number) -> Number:
    if isinstance(x, Dual):
        y = math.sqrt(x.v)
        return Dual(y, x.d / (2.0 * y))
    return math.sqrt(x)


def exp(x: Number) -> Number:
    if isinstance(x, Dual):
        y = elementary.exp(x.v)
        return Dual(y, y * x.d)
    return elementary.exp(x)


def log(x: Number) -> Number:
    return Dual(elementary.log(x.v), x.d / x.v) if isinstance(x, Dual) else elementary.log(x)


def tanh(x: Number) -> Number:
    if isinstance(x, Dual):
        y = elementary.tanh(x.v)
        return Dual(y, (1.0 - y * y) * x.d)
    return elementary.tanh(x)


def floor(x: Number) -> Number:
    """Return the largest whole number not above x, as a float."""
    return Dual(float(math.floor(x.v))) if isinstance(x, Dual) else float(math.floor(x))


def fabs(x: Number) -> Number:
    return where(x < 0.0, -x, x)


def where(condition: Any, a: Number, b: Number) -> Number:
    """Return ``a`` where the condition holds, else ``b``.  Both are evaluated: guard a division with ``if``."""
    return a if condition else b


def minimum(a: Number, b: Number) -> Number:
    return where(a < b, a, b)


def maximum(a: Number, b: Number) -> Number:
    return where(a > b, a, b)


def clip(x: Number, lo: Number, hi: Number) -> Number:
    """Return x limited to [lo, hi].  A NaN goes through as NaN: it must be seen, not swallowed."""
    return where(x < lo, lo, where(x > hi, hi, x))


def sign(x: Number) -> Number:
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0))


def index(x: Number) -> int:
    """Return a float that holds a whole number, as an array index.  Raises IndexError below 0."""
    n = int(value(x))
    if n < 0:
        raise IndexError(f"an index is {n}")
    return n


FUNCTIONS = (
    "sin", "cos", "tan", "asin", "atan", "atan2", "sqrt", "exp", "log", "tanh", "floor",
    "fabs", "where", "minimum", "maximum", "clip", "sign",
)  # fmt: skip

ARRAY_FUNCTIONS = ("vector", "dot", "cross")
