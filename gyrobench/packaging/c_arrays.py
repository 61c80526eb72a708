"""Scalars and arrays of the equations as C text, element by element."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

Shape = tuple[int, ...]
Range = tuple[int | None, int | None]  # smallest and largest value of an index; None: known when it runs
Span = tuple[int, int]  # a slice: first element, number of elements


@dataclass(frozen=True)
class CExpression:
    """An expression: its shape and the C text of each of its elements.

    plain: reading an element again computes nothing.  aligned: element [i] is made of elements [i] of what it reads.
    storage: the C text of the array itself, where it is one (of numbers).  reads: the arrays that it is made of.
    """

    shape: Shape
    element: Callable[..., str]
    plain: bool = False
    aligned: bool = True
    storage: str = ""
    reads: frozenset[str] = frozenset()

    @property
    def text(self) -> str:
        return self.element()


@dataclass(frozen=True)
class CVariable:
    """A variable, or a piece of one: its C text without the owner, what it is, and how far it is indexed."""

    base: str
    kind: str  # "local", "self", "loop" or "constant"
    name: str = ""  # of the whole variable
    dims: Shape = ()
    taken: tuple[str | Span, ...] = ()  # index or slice of the first dimensions

    @property
    def shape(self) -> Shape:
        spans = tuple(t[1] for t in self.taken if not isinstance(t, str))
        return spans + self.dims[len(self.taken) :]

    @property
    def whole(self) -> bool:
        """Return True if the elements are contiguous from the first on: no slice."""
        return all(isinstance(t, str) for t in self.taken)

    def at(self, *indices: str) -> str:
        """Return the text of one element."""
        remaining = iter(indices)
        text = self.base
        for t in self.taken:
            text += f"[{t}]" if isinstance(t, str) else f"[{_shifted(next(remaining), t[0])}]"
        return text + "".join(f"[{i}]" for i in remaining)

    def indexed(self, index: str | Span) -> CVariable:
        """Return the piece at an index, or a slice, of the first dimension that is left."""
        taken: list[str | Span] = list(self.taken)
        for k, t in enumerate(taken):
            if not isinstance(t, str):
                taken[k] = _shifted(index, t[0]) if isinstance(index, str) else (t[0] + index[0], index[1])
                return CVariable(self.base, self.kind, self.name, self.dims, tuple(taken))
        return CVariable(self.base, self.kind, self.name, self.dims, (*self.taken, index))


def _shifted(index: str, by: int) -> str:
    if by == 0:
        return index
    return str(int(index) + by) if index.isdigit() else f"({index} + {by})"


def cells(shape: Shape) -> Iterator[tuple[str, ...]]:
    """Yield the indices of all elements, as texts."""
    return itertools.product(*([str(k) for k in range(n)] for n in shape))


def dimensions(shape: Shape) -> str:
    """Return the dimensions as C declares them: [3][3]."""
    return "".join(f"[{n}]" for n in shape)


def words(shape: Shape) -> str:
    """Return a shape as text."""
    return "a number" if not shape else f"an array ({' x '.join(map(str, shape))})"
