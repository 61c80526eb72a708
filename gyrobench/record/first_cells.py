"""Tell what the first cells of a column are: its level, whether it rises, times since 1970, units of whole times."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

from gyrobench import units

FIRST = 200  # numbers of a column: it is put into other positions later
EPOCH = (1e9, 4.1e9)  # s since 1970: 2001 and 2100
COUNTS = re.compile(r"\b(?:counts?|lsb|digits)\b", re.IGNORECASE)  # how the unit of a number of steps, 1, is called
SLOW = 0.5  # s between the rows of a record: more of it are rare


def numbers(cells: Sequence[str]) -> list[float]:
    """Return the numbers of these cells, [] where one holds another text."""
    with suppress(ValueError):
        return [float(c.replace(",", ".")) for c in cells]
    return []


def level(cells: Sequence[str]) -> float:
    """Return the median of the first numbers."""
    return statistics.median(numbers(cells[:FIRST]) or [math.nan])


def whole(cells: Sequence[str]) -> bool:
    """Return whether the first numbers have no fractions, and are not all the same."""
    first = numbers(cells[:FIRST])
    return len({*first}) > 1 and all(x.is_integer() for x in first)


def rises(cells: Sequence[str]) -> bool:
    """Return whether the numbers rise from row to row."""
    found = numbers(cells)
    return len(found) > 9 and all(a < b for a, b in pairwise(found))


def epoch(cells: Sequence[str]) -> str:
    """Return the unit of times since 1970, "" of other numbers."""
    with suppress(ValueError, IndexError):
        ends = float(cells[0]), float(cells[-1])
        for unit in ("s", "ms", "us", "ns"):
            first, last = (units.convert(end, unit, "s") for end in ends)
            if EPOCH[0] <= first <= last < EPOCH[1]:
                return unit
    return ""


def unit_of_times(cells: Sequence[str]) -> str:
    """Return the unit that times may be in: "s", or where whole numbers rise by more than one the first of ms, us and
    ns in which the rows are less than half a second apart.
    """
    first = numbers(cells[:FIRST])
    step = statistics.median(b - a for a, b in pairwise(first)) if len(first) > 2 and whole(cells) else 1.0
    if step <= 1.0:
        return "s"
    return next((u for u in ("ms", "us", "ns") if units.convert(step, u, "s") < SLOW), "s")
