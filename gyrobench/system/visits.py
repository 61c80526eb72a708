"""Visits of a test as text, "a 30deg 20s; b 45deg": a place in one or more words, and the time averaged there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from gyrobench.system.values import InvalidValueError, parse_number

SEPARATOR = ";"


@dataclass(frozen=True)
class Visit:
    """place: words as they are, angles in rad.  dwell: s."""

    place: tuple[Any, ...]
    dwell: float


def parse_visits(option: str, text: str, units: Sequence[str], dwell: float) -> list[Visit]:
    """Return the visits of ``text``; [] where it is empty.

    units: of each word of a place, "" for a name.  dwell: s, of a visit that gives none.  Raises InvalidValueError.
    """
    found = []
    for number, entry in enumerate((e for e in text.split(SEPARATOR) if e.strip()), 1):
        words = entry.split()
        where = f"{option}, visit {number} '{entry.strip()}'"
        if not len(units) <= len(words) <= len(units) + 1:
            shape = " ".join("NAME" if not u else f"ANGLE{'deg' if u == 'rad' else u}" for u in units)
            raise InvalidValueError(f"{where}: write '{shape}' or '{shape} TIME', visits apart by '{SEPARATOR}'")
        place = tuple(
            w if not u else parse_number(where, w if w.strip("-+.0123456789e") else f"{w}deg", u)
            for w, u in zip(words, units, strict=False)
        )
        time = parse_number(where, words[-1], "s") if len(words) > len(units) else dwell
        if not time > 0.0:
            raise InvalidValueError(f"{where}: the time must be above 0")
        found.append(Visit(place, time))
    return found


def format_time(seconds: float) -> str:
    """Return a time as :func:`parse_visits` reads it, to the millisecond."""
    return f"{round(seconds, 3):.10g}s"


def nearest_turn(angle: float, before: float, turn: float) -> float:
    """Return the angle plus whole turns that is nearest to ``before``."""
    return angle + turn * round((before - angle) / turn)
