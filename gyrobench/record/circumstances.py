"""Circumstances of a measured file: its lines ``# key = value``, and what is wrong with them.

    # latitude = 45.75deg
    # phase 1 = static 3
    # The room was cooled in the afternoon: a remark, and any line without "key =" is one.

A key has at most three words (letters, digits, ``_ . -``), the first of which begins with a letter.  A key that no
reader knows is a fault, as is one given twice: a misprint must not leave a value at its default.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import shorten

WORD = r"[^\W\d][\w.-]*"
KEY = rf"{WORD}(?: [\w.-]+){{0,2}}"
VALUE = r"(?:[-+.\d]\S* )?[^\s'\"();:]+"  # a quantity, or one word; words in quotes are quoted
BEGIN = r"[#\s]*+(?:[•*-]\s++)?"  # possessive: ten thousand spaces took seconds to be given back
STATED = re.compile(rf"{BEGIN}({KEY})\s*=(.*)", re.S)
COLON = re.compile(rf"{BEGIN}({KEY})\s*:\s*({VALUE})\s*")
WITHIN = re.compile(rf"{BEGIN}[^=]*\s({WORD})\s*=\s*({VALUE})\s*")
PHASE = re.compile(r"phase (0|[1-9]\d*)")
NEAR = 0.6  # of difflib: u_atitude and u_attitude 0.95, temp and temperature 0.53
MISPRINT = 0.8  # of a key that another program may have written for itself


@dataclass(frozen=True)
class Statement:
    """A comment line that states ``key = value``.

    line: its number, 0 in metadata, where other programs have keys of their own.  remark: the line is not of that
    form, but would be with little change ("key: value"): it states nothing, and must not look as if it did.
    """

    line: int
    key: str
    value: str
    remark: bool = False


@dataclass(frozen=True)
class Keys:
    """Keys that a reader knows; phases: ``phase N`` too.  elsewhere: keys of other tests -> why not here."""

    names: Sequence[str]
    phases: bool = False
    elsewhere: Mapping[str, str] = field(default_factory=dict)

    def __contains__(self, key: str) -> bool:
        return key in self.names or (self.phases and PHASE.fullmatch(key) is not None)

    def nearest(self, key: str, cutoff: float = NEAR) -> list[str]:
        """Return the known key that is most like this one, several that are equally so, or none."""
        if self.phases and (number := re.fullmatch(r"phase_?0*(\d+)", _plain(key))):
            return [f"phase {number[1]}"]
        of = {_plain(n): n for n in (*self.names, *(["phase 1"] if self.phases else []))}
        near = difflib.get_close_matches(_plain(key), of, n=3, cutoff=cutoff)
        alike = [difflib.SequenceMatcher(None, n, _plain(key)).ratio() for n in near]
        return sorted(of[n] for n, ratio in zip(near, alike, strict=True) if ratio == alike[0])


def _plain(key: str) -> str:
    return re.sub(r"[\s_.-]+", "_", key).casefold()


def statement(text: str, line: int) -> Statement | None:
    """Return what a comment line states, or nearly states; None for a remark."""
    if match := STATED.match(text):
        return Statement(line, match[1], match[2].strip().rstrip(",;\t").rstrip())
    match = COLON.fullmatch(text) or ("--" not in text and WITHIN.fullmatch(text)) or None
    return Statement(line, match[1], match[2], remark=True) if match else None


def values_of(statements: Iterable[Statement]) -> dict[str, str]:
    """Return key -> value."""
    return {s.key: s.value for s in statements if not s.remark}


def faults(statements: Iterable[Statement], keys: Keys) -> list[str]:
    """Return what is wrong with the keys: unknown ones, with the nearest that is known, and those given twice."""
    problems = []
    first: dict[str, int] = {}
    for s in statements:
        where = f"row {s.line}: " if s.line else ""
        shown = shorten(f"# {s.key} = {s.value}", 60, placeholder=" ...")
        if s.remark:
            if s.key in keys:
                problems.append(
                    f"{where}states nothing, though it names '{s.key}': write '{shown}' on a line of its own (a remark "
                    "ends otherwise than in a value)"
                )
            continue
        if s.key not in keys and s.key in keys.elsewhere:
            problems.append(f"{where}'{shown}': {keys.elsewhere[s.key]}")
            continue
        if s.key not in keys:
            near = keys.nearest(s.key, NEAR if s.line else MISPRINT)
            if near or s.line:
                names = " or ".join(map(repr, near)) or ", ".join(keys.names)
                there = f"did you mean {names}?" if near else f"there are: {names}"
                problems.append(
                    f"{where}'{shown}': unknown key '{s.key}'; {there} (a remark is a comment line without 'key =')"
                )
            continue
        if s.key in first:
            problems.append(
                f"rows {first[s.key]} and {s.line}: '{s.key}' is given twice; keep one of the two lines, with all that "
                "is to be said"
            )
        first.setdefault(s.key, s.line)
        inside = [k for k in re.findall(rf"[\s,;]({WORD})\s*=", s.value) if k in keys]
        if inside:
            problems.append(f"{where}'{shown}': states '{inside[0]}' too: write a line for each key")
    return problems
