"""Vectors and matrices of fixed shape: the values of the language that have elements.

A matrix is a vector of rows.  Products are summed from left to right, first product first, in every target:
``(a[0] b[0] + a[1] b[1]) + a[2] b[2]``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


class Vector(list[Any]):
    """A list with the arithmetic of the language: + - of equal shapes, * / by a number, @, .T, slices."""

    __slots__ = ()

    def __add__(self, o: Any) -> Any:
        return Vector([a + b for a, b in zip(self, o, strict=True)])

    def __radd__(self, o: Any) -> Any:
        return Vector([b + a for a, b in zip(self, o, strict=True)])

    def __sub__(self, o: Any) -> Vector:
        return Vector([a - b for a, b in zip(self, o, strict=True)])

    def __rsub__(self, o: Any) -> Vector:
        return Vector([b - a for a, b in zip(self, o, strict=True)])

    def __mul__(self, x: Any) -> Any:
        return Vector([a * x for a in self])

    def __rmul__(self, x: Any) -> Any:
        return Vector([x * a for a in self])

    def __truediv__(self, x: Any) -> Vector:
        return Vector([a / x for a in self])

    def __neg__(self) -> Vector:
        return Vector([-a for a in self])

    def __pos__(self) -> Vector:
        return self

    def __matmul__(self, o: Any) -> Any:
        columns = o.T if isinstance(next(iter(o)), list) else None  # not o[0]: __getitem__ takes its time
        if not isinstance(next(iter(self)), list):
            return dot(self, o) if columns is None else Vector([dot(self, column) for column in columns])
        if columns is None:
            return Vector([dot(row, o) for row in self])
        return Vector([Vector([dot(row, column) for column in columns]) for row in self])

    @property
    def T(self) -> Vector:
        """The transpose of a matrix."""
        return Vector([Vector(column) for column in zip(*self, strict=True)])

    def __getitem__(self, k: Any, _get: Any = list.__getitem__) -> Any:  # bound here: it is called at every turn
        return Vector(_get(self, k)) if type(k) is slice else _get(self, k)


def is_finite(x: Any) -> bool:
    """Return whether a number, or each element of an array, is finite."""
    if not isinstance(x, list):
        return math.isfinite(x)
    for first in x:
        if isinstance(first, list):
            return all(map(is_finite, x))
        return math.isfinite(sum(x)) or all(map(math.isfinite, x))  # a sum may exceed all numbers
    return True


def copied(x: Any) -> Any:
    """Return a number, or a copy of an array."""
    if not isinstance(x, (list, tuple)):  # quicker than list | tuple
        return x
    for first in x:
        if isinstance(first, (list, tuple)):
            return Vector([copied(e) for e in x])
        break
    return Vector(x)


def vector(x: Sequence[Any]) -> Vector:
    """Return a new vector, or matrix, with the elements of a list or of another one: a copy."""
    new: Vector = copied(list(x))
    return new


def dot(a: Any, b: Any) -> Any:
    """Return the scalar product of two vectors of one length."""
    if len(a) == 3 == len(b):
        a0, a1, a2 = a
        b0, b1, b2 = b
        return a0 * b0 + a1 * b1 + a2 * b2
    pairs = zip(a, b, strict=True)
    x, y = next(pairs)
    total = x * y
    for x, y in pairs:
        total = total + x * y
    return total


def cross(a: Any, b: Any) -> Vector:
    """Return the vector product of two vectors of three."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    return Vector([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])
