"""Numbers without a unit that are far outside the usual size: questioned before anything runs.

Asked of what people write, on the command line or in a file.  A number of Python is SI, as the library says.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from gyrobench import drift, units
from gyrobench.system.values import InvalidValueError, flatten

FACTOR = 1000.0  # a number this many times the usual one is taken for one in another unit,
NEAR = 100.0  # and from here on, from LEAST on, where an everyday unit makes it usual to the factor USUAL
LEAST = 0.01  # nobody writes 1e-5 and means degrees
USUAL = 10.0
PER_G = {n: ("", "/g", "/g2")[drift.order(n)] for names in (drift.NAMES, *drift.NAMES_2DOF.values()) for n in names}
ODD = ("us", "ns", "ms", "min", "h", "day", "rev", "km", "degC")  # nobody leaves these out


def usual_size(*sizes: Iterable[float | None]) -> float:
    """Return the usual size: the largest of the first sizes that tell one; 0 where none do."""
    for group in sizes:
        known = [abs(x) for x in group if x is not None and math.isfinite(x) and x != 0.0]
        if known:
            return max(known)
    return 0.0


def question(name: str, given: Any, value: Any, unit: str, usual: float) -> None:
    """Raise InvalidValueError for a text without a unit whose number is far beyond the usual size.

    given: as the user wrote it; value: the same in SI, a number or a list; unit: its SI unit.  A value with its unit is
    what the user means, and a number of unit 1 may have any size.
    """
    if unit in ("", "1") or not usual or not isinstance(given, str) or given.strip(" +-.0123456789eE[],"):
        return
    sizes = {u: units.factor(u) for u in units.fitting(unit)[1:] if u not in ODD}
    for element, x in flatten(name, value).items():
        if not isinstance(x, int | float) or abs(x) <= NEAR * usual:
            continue
        apart = {u: abs(math.log(abs(x) * size / usual)) for u, size in sizes.items()}
        likely = [u for u in apart if u in units.USUAL and apart[u] <= math.log(USUAL)]
        meant = min(likely or apart, key=lambda u: apart[u], default="")
        if abs(x) > FACTOR * usual or (abs(x) >= LEAST and meant and apart[meant] <= math.log(USUAL)):
            raise InvalidValueError(_words(element, float(x), unit, usual, meant, sizes.get(meant, 0.0)))


def _words(name: str, x: float, unit: str, usual: float, meant: str, size: float) -> str:
    """Return what the number is, what it would be in an everyday unit, and what to write."""
    per = PER_G.get(name.rpartition(".")[2], "")
    si = f"{x:g} {unit}{per}"
    times = f"{abs(x) / usual:.2g} times the usual {usual:.3g} {unit}{per}"
    if not meant or abs(x) * size > FACTOR * usual:
        return f"{name} = {x:g}: without a unit this is {si}, {times}; write {x:g}{unit} if that is meant"
    return (
        f"{name} = {x:g}: without a unit this is {si}, that is {x / size:.3g} {meant}{per}, {times}; write "
        f"{x:g}{meant}{per}, or {x:g}{unit}{per} if that is meant"
    )
