"""Axes: what a campaign varies, as a person writes it, and the points that follow.

"0deg..80deg:9"                nine values at equal distances      "1e-3..1:7log deg/h"    in equal ratios
"0.1,0.3,1 deg/h/g"            a list; a unit at its end is that of the numbers without one
"analog,pulse"                 texts
"uniform(-1, 1) deg/h/g"       a distribution: uniform, normal (mean, standard deviation), loguniform, triangular
                               (lowest, most likely, highest); all of them are drawn together, see :func:`draw`
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench import reading, units
from gyrobench.bench import UsageError, suggest_names

MOST = 1_000_000  # points of an axis, seeds, runs of a campaign
DESIGNS = ("random", "lhs", "sobol")
LONGEST = 200  # letters of a grid or a distribution: what is longer is a list, and takes the patterns below too long
NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
QUANTITY = re.compile(rf"({NUMBER})\s*(.*)", re.S)
_GRID = re.compile(rf"({NUMBER})\s*(\S*?)\s*\.\.\s*({NUMBER})\s*(\S*?)\s*:\s*(\d+)\s*(log)?\b\s*(.*)", re.S)
_ENDS = re.compile(rf"{NUMBER}\s*\S*?\s*\.\.\s*{NUMBER}\s*[^\s:]*")  # a grid without its number of values
_CALL = re.compile(r"([a-z]+)\s*\((.*)\)\s*(.*)", re.S)


@dataclass(frozen=True)
class AxisValue:
    """A value of an axis: in the axis' unit (or a text), and as it is given to the test."""

    shown: float | str
    given: Any


@dataclass(frozen=True)
class Axis:
    """Values of one quantity, all of which are combined with those of the other axes."""

    name: str
    kind: str  # list, grid, part, data, seed, table
    unit: str  # "" of texts and of numbers in SI
    points: tuple[AxisValue, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of campaign.json."""
        shown = units.display(self.unit) if self.unit else ""
        return {"name": self.name, "kind": self.kind, "unit": shown, "values": [p.shown for p in self.points]}


@dataclass(frozen=True)
class Distribution:
    """Distribution that a quantity is drawn from; numbers in ``unit``."""

    name: str
    family: str
    numbers: tuple[float, ...]
    unit: str

    def quantile(self, p: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        """Return the values below which the part p of all lies."""
        from scipy import stats

        a, b, *c = self.numbers
        match self.family:
            case "uniform":
                return np.asarray(a + (b - a) * p)
            case "normal":
                return np.asarray(stats.norm.ppf(p, a, b))
            case "loguniform":
                return np.asarray(a * (b / a) ** p)
            case _:
                return np.asarray(stats.triang.ppf(p, (b - a) / (c[0] - a), a, c[0] - a))


def point(value: float, unit: str) -> AxisValue:
    """Return a number in a unit; without one as a text, so that its size is questioned as that of --set."""
    return AxisValue(value, f"{value!r} {unit}" if unit else repr(value))


def check_value(given: Any) -> Any:
    """Return a value of a campaign: number, text, list of them or table; raise ValueError for anything else."""
    if hasattr(given, "tolist"):
        given = given.tolist()
    if isinstance(given, dict):
        return {k: check_value(v) for k, v in given.items()}
    if isinstance(given, list | tuple):
        return [check_value(v) for v in given]
    if isinstance(given, str) and "\0" not in given:
        return given
    if isinstance(given, bool) or (isinstance(given, int | float) and -1e300 < given < 1e300):
        return given
    raise ValueError("a number, a text with its unit, or a list of them is expected")


def parse_axis(name: str, given: Any) -> Axis | Distribution:
    """Return what a text, a number or a list of both means.  Raises UsageError."""
    try:
        given = check_value(given)
    except ValueError as error:
        raise UsageError(f"{name} = {reading.shorten(repr(given))}: {error}") from None
    try:
        if isinstance(given, str):
            return _grid(name, given) or _distribution(name, given) or _list(name, _split(given))
        return _list(name, given if isinstance(given, list | tuple) else [given])
    except units.UnitError as error:
        raise UsageError(f"{name}: {error}") from None


def _one_unit(name: str, found: Sequence[tuple[float, str]], tail: str) -> tuple[list[float], str]:
    """Return numbers in one unit, that of the first; those without a unit have the one at the end."""
    named = [(x, u or tail) for x, u in found]
    unit = named[0][1]
    if any(bool(u) != bool(unit) for _, u in named):
        raise UsageError(f"{name}: some values have a unit and some have none; write it at the last or at each")
    if unit:
        units.unit(unit)
    values = [x if u == unit else units.convert(x, u, unit) for x, u in named]
    if not all(map(math.isfinite, values)):
        raise UsageError(f"{name}: a number beyond what a computer holds")
    return values, unit


def _grid(name: str, text: str) -> Axis | None:
    if len(text) > LONGEST:
        return None
    match = _GRID.fullmatch(text.strip())
    if match is None and _ENDS.fullmatch(text.strip()):
        raise UsageError(f"{name}: {text}: how many values? write LOW..HIGH:N, such as {text.strip()}:9")
    if match is None:
        return None
    low_text, low_unit, high_text, high_unit, count, log, tail = match.groups()
    ends = [(float(low_text), low_unit or (high_unit if not tail else "")), (float(high_text), high_unit)]
    (low, high), unit = _one_unit(name, ends, tail.strip())
    n = int(count) if len(count) < 9 else MOST + 1
    if not 2 <= n <= MOST:
        raise UsageError(f"{name}: {reading.shorten(text)}: a grid has 2 to {MOST} points")
    if log and not (low > 0.0 and high > 0.0):
        raise UsageError(f"{name}: {text}: values in equal ratios must be > 0")
    steps = [k / (n - 1) for k in range(n)]
    values = [low * (high / low) ** s if log else low + (high - low) * s for s in steps]
    values[-1] = high
    return Axis(name, "grid", unit, tuple(point(v, unit) for v in values))


def _distribution(name: str, text: str) -> Distribution | None:
    match = _CALL.fullmatch(text.strip()) if len(text) <= LONGEST else None
    if match is None:
        return None
    family, inside, tail = match.groups()
    wanted = {"uniform": 2, "normal": 2, "loguniform": 2, "triangular": 3}
    if family not in wanted:
        raise UsageError(f"{name}: {text}: no such distribution; {suggest_names(family, wanted)}")
    items = [QUANTITY.fullmatch(x.strip()) for x in inside.split(",")]
    numbers = [(float(m[1]), m[2].strip()) for m in items if m]
    if len(items) != wanted[family] or len(numbers) != len(items):
        raise UsageError(f"{name}: {text}: {family} takes {wanted[family]} numbers")
    values, unit = _one_unit(name, numbers, tail.strip())
    low, *_, high = values
    if family == "normal" and not values[1] > 0.0:
        raise UsageError(f"{name}: {text}: the standard deviation must be > 0")
    if family != "normal" and not low < high:
        raise UsageError(f"{name}: {text}: the first number must be below the last")
    if family == "loguniform" and not low > 0.0:
        raise UsageError(f"{name}: {text}: both numbers must be > 0")
    if family == "triangular" and not low <= values[1] <= high:
        raise UsageError(f"{name}: {text}: the most likely value must lie between the others")
    return Distribution(name, family, tuple(values), unit)


def _split(text: str) -> list[str]:
    """Return the items of a list; commas inside of brackets separate nothing."""
    items, depth = [""], 0
    for letter in text:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 0:
            items.append("")
        else:
            items[-1] += letter
    return [i.strip() for i in items]


def _list(name: str, items: Sequence[Any]) -> Axis:
    if not items or (len(items) == 1 and items[0] == ""):
        raise UsageError(f"{name}: an empty value; write for example {name}=0.1,0.3,1 deg/h")
    numbers = []
    for item in items:
        match = QUANTITY.fullmatch(item.strip()) if isinstance(item, str) else None
        if isinstance(item, bool | list | tuple | dict) or (isinstance(item, str) and match is None):
            return Axis(name, "list", "", tuple(AxisValue(_text(v), v) for v in items))
        numbers.append((float(match[1]), match[2].strip()) if match else (float(item), ""))
    tail = numbers[-1][1]
    try:
        values, unit = _one_unit(name, numbers, tail)
    except units.UnitError:
        if all(isinstance(v, str) for v in items) and not _is_unit(tail):  # "5 10 20": a text that begins with a digit
            return Axis(name, "list", "", tuple(AxisValue(v, v) for v in items))
        raise
    given = [
        AxisValue(v, number) if isinstance(number, float | int) else point(v, unit)
        for v, number in zip(values, items, strict=True)
    ]
    return Axis(name, "list", unit, tuple(given))


def _is_unit(name: str) -> bool:
    try:
        units.unit(name)
    except units.UnitError:
        return False
    return True


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def draw(
    axes: Sequence[Distribution], runs: int, design: str = "random", seed: int = 1
) -> list[Mapping[str, AxisValue]]:
    """Return points of several distributions: independent (random), or spread out evenly over the space of all of them.

    design: "random", "lhs" (Latin hypercube) or "sobol" (scrambled Sobol' sequence, of a power of two of points).
    """
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    d = len(axes)
    if design == "random":
        p = rng.random((runs, d))
    elif design == "lhs":
        p = qmc.LatinHypercube(d, seed=rng).random(runs)
    else:
        if runs & (runs - 1):
            lower = 1 << (runs.bit_length() - 1)
            raise UsageError(f"sobol: {runs} points are not balanced; take a power of two, {lower} or {2 * lower}")
        p = qmc.Sobol(d, seed=rng).random(runs)
    p = np.clip(p, 2.0**-53, 1.0 - 2.0**-53)
    with np.errstate(all="ignore"):
        columns = [axis.quantile(p[:, k]).tolist() for k, axis in enumerate(axes)]
    for axis, column in zip(axes, columns, strict=True):
        if not all(map(math.isfinite, column)):
            raise UsageError(f"{axis.name}: the distribution reaches beyond what a computer holds")
    return [
        {axis.name: point(column[k], axis.unit) for axis, column in zip(axes, columns, strict=True)}
        for k in range(runs)
    ]
