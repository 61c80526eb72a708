"""Budgets of a table and its surroundings: root of squares, worst case and Monte Carlo side by side.  [ERROR-BUDGET]

    lines = parse("zero 0.5arcsec uniform; tracking 1arcsec", "rad")
    total = combine([line.size for line in lines], [line.kind for line in lines], seed)

A line is a name, a size and a kind: normal (the size is the standard deviation), uniform (half width) or fixed (that
size with either sign).  Root of squares, as in the source: of the sizes themselves, so that it overstates a uniform
line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench import frames, units
from gyrobench.arrays import Array

ERU = units.EARTH_RATE
KINDS = ("normal", "uniform", "fixed")
DRAWS = 20_000
SMALL = math.radians(1.0)  # largest misalignment
#: Hu 1981, section 5.8: misalignments at ten times Earth rate
ALIGN = (
    "table pointing 5arcsec; sensor mount 2arcsec; clamping 5arcsec; plate squareness 1arcsec; axis wobble 1arcsec; "
    "axis squareness 1.5arcsec"
)
#: Hu 1981, eq. 5-61: errors of an angle that a rate is made of
RATE_MODE = "zero 0.5arcsec; electrical 0.5arcsec; tracking 1arcsec; electronics 0.72arcsec; quantization 0.36arcsec"


@dataclass(frozen=True)
class ErrorLine:
    """One line of a budget; size in SI."""

    name: str
    size: float
    kind: str = "normal"


@dataclass(frozen=True)
class Total:
    """each: effects of the sizes.  rss: root of their squares.  worst: their sum.  spread: standard deviation
    of the draws.  within: bound of 95 % of them, from zero.
    """

    each: list[float]
    rss: float
    worst: float
    spread: float
    within: float

    def named(self) -> list[tuple[str, float]]:
        """Return the totals as a table prints them."""
        return [
            ("root of squares", self.rss),
            ("Monte Carlo, standard deviation", self.spread),
            ("Monte Carlo, 95 % within", self.within),
            ("worst case, sum", self.worst),
        ]


def parse(text: str, unit: str) -> list[ErrorLine]:
    """Return the lines of an option value: "name 5arcsec uniform; ...".  Raises ValueError with what is wrong."""
    lines = []
    for entry in filter(None, (e.strip() for e in text.split(";"))):
        words = entry.split()
        kind = words.pop() if words[-1] in KINDS else "normal"
        if len(words) < 2:
            raise ValueError(f"'{entry}': name, size with unit and kind are expected, as in 'tracking 1arcsec normal'")
        try:
            size = units.parse_quantity(words[-1], unit)
        except units.UnitError as error:
            raise ValueError(f"'{entry}': {error}") from None
        if not words[-1][-1:].isalpha():
            raise ValueError(f"'{entry}': the size needs its unit, all lines in units of one kind")
        if size < 0.0:
            raise ValueError(f"'{entry}': a size is not negative")
        lines.append(ErrorLine(" ".join(words[:-1]), size, kind))
    if not lines:
        raise ValueError("no lines: at least one is needed, as in 'tracking 1arcsec'")
    return lines


def draws(lines: Sequence[ErrorLine], seed: int, n: int = DRAWS) -> Array:
    """Return errors (n, lines), drawn by their kinds."""
    rng = np.random.default_rng(seed)

    def one(kind: str) -> Array:
        if kind == "normal":
            return rng.standard_normal(n)
        return rng.uniform(-1.0, 1.0, n) if kind == "uniform" else rng.choice([-1.0, 1.0], n)

    return np.column_stack([line.size * one(line.kind) for line in lines])


def combine(
    lines: Sequence[ErrorLine], seed: int, effect: Callable[[Array], Array] = lambda e: np.asarray(e.sum(axis=1))
) -> Total:
    """Return the totals of a budget.

    effect: errors (n, lines) -> error of the result (n,); without it they add up.
    """
    sizes = np.array([line.size for line in lines])
    scale = np.abs(effect(np.diag(sizes)))  # each alone
    found = effect(draws(lines, seed))
    within = float(np.quantile(np.abs(found), 0.95))
    return Total(scale.tolist(), float(np.sqrt(np.sum(scale**2))), float(np.sum(scale)), float(np.std(found)), within)


def misalignment_rate(angles: Array, n: float, sense: int) -> Array:
    """Return (n +- 1) W sin(sum of the angles): the rates (draws,) on an input axis that leans towards the axis of a
    table on the pole, by parts on one another (draws, lines).

    All lean about the same axis, the worst that a stack of parts can do: their rotations add.  n: table rate over Earth
    rate.  sense: +1 with the Earth (n + 1), -1 against it (n - 1), 0 not known: the larger, n + 1.
    [ALIGN-ERRORS; Hu 1981, eq. 5-59]
    """
    return np.asarray((n + (sense or 1)) * ERU * np.sin(np.sum(angles, axis=1)))


def latitude_problems(latitude: float) -> list[str]:
    """Return why a meridian cannot be found there."""
    if abs(latitude) > math.radians(89.9):
        return ["latitude: at the pole there is no meridian to align the table axis to"]
    return frames.latitude_problems(latitude)
