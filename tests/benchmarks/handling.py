"""Handling errors in records of every measured-data template: named, inconclusive, or passed; and clean records.

    python tests/benchmarks/handling.py [--clean 100] [--errors 36] [--seed 1]

Each record is a co-simulation with a random instrument, latitude and noise (coverage.py) on a shortened plan, written
as a laboratory would write it (laboratory.py) with one mistake in it, and reduced with limits that every coefficient
keeps.  Counted is what the report says: the mistake is named (with those that leave the same residuals), the verdict is
inconclusive or the record is refused, or it passes, harmless where no estimate is off by 3 u; a wrong
mistake named is counted by itself.  Mistakes that no residual shows (diagnosis.handling_errors) are not
among them.  README.md here has the figures.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from asked import asked
from coverage_cases import CASES
from laboratory import Laboratory, Sheet, wide

from gyrobench.errors import GyrobenchError
from gyrobench.result import Result

Rng = np.random.Generator
DEGREE = np.pi / 180.0
HARMLESS = 3.0  # u: a mistake that changes no estimate by more may pass
LEVEL = CASES["servo_vertical_level"]
CASES["servo_vertical_level, twice"] = replace(LEVEL, values={**LEVEL.values, "cycles": 2})


# ---------------------------------------------------------------------------------------------- mistakes
def labels(a: str, b: str) -> Callable[[Sheet, Rng], str]:
    """Two attitudes exchanged in the comments."""

    def make(s: Sheet, _: Rng) -> str:
        other = {a: b, b: a}
        s.comments = {k: other.get(v, v) if k.startswith("phase ") else v for k, v in s.comments.items()}
        return f"{min(a, b)} and {max(a, b)} exchanged"

    return make


def positions(a: int, b: int) -> Callable[[Sheet, Rng], str]:
    def make(s: Sheet, _: Rng) -> str:
        p = s.columns["position"]
        s.columns["position"] = np.where(p == a, b, np.where(p == b, a, p))
        return f"position {a} and position {b} exchanged"

    return make


def times(columns: str, factor: float, words: str, face: str = "", phase: int = 0) -> Callable[[Sheet, Rng], str]:
    """Columns times a factor, everywhere, in one attitude or in one phase."""

    def make(s: Sheet, _: Rng) -> str:
        here = [int(k.split()[1]) for k, v in s.comments.items() if k.startswith("phase ") and v == face]
        rows = np.isin(s.columns["phase"], here or [phase]) if face or phase else slice(None)
        for c in columns.split():
            s.columns[c][rows] *= factor
        return words

    return make


def phases(a: str, b: str) -> Callable[[Sheet, Rng], str]:
    """The labels of two phases exchanged, of attitudes that are taken twice."""

    def make(s: Sheet, _: Rng) -> str:
        x, y = (next(k for k, v in s.comments.items() if k.startswith("phase ") and v == n) for n in (a, b))
        s.comments |= {x: b, y: a}
        x, y = sorted((x, y), key=lambda k: int(k.split()[1]))
        return f"phases {x.split()[1]} and {y.split()[1]} ({s.comments[x]}, {s.comments[y]}) exchanged"

    return make


def reversed_phase(s: Sheet, _: Rng) -> str:
    p = int(s.columns["phase"][0])
    return times(ANGLES, -1.0, f"the rotation reversed in phase {p} ", phase=p)(s, _)


def columns(a: str, b: str, words: str) -> Callable[[Sheet, Rng], str]:
    def make(s: Sheet, _: Rng) -> str:
        for x, y in zip(a.split(), b.split(), strict=True):
            s.columns[x], s.columns[y] = s.columns[y], s.columns[x]
        return words

    return make


def late(column: str, words: str) -> Callable[[Sheet, Rng], str]:
    """A column pasted one row too low."""

    def make(s: Sheet, _: Rng) -> str:
        for c in column.split():
            s.columns[c] = np.roll(s.columns[c], 1)
        return words

    return make


def neighbours(columns: str, words: str) -> Callable[[Sheet, Rng], str]:
    """Two rows, or groups of rows with equal values, that follow one another, exchanged in some columns."""

    def make(s: Sheet, rng: Rng) -> str:
        names = columns.split()
        table = np.column_stack([s.columns[c] for c in names])
        first = [0, *(np.flatnonzero(np.any(np.abs(np.diff(table, axis=0)) > 1e-9, axis=1)) + 1), len(table)]
        k = int(rng.integers(1, len(first) - 3))
        a, b = slice(first[k], first[k + 1]), slice(first[k + 1], first[k + 2])
        for j, c in enumerate(names):
            s.columns[c][a], s.columns[c][b] = table[first[k + 1], j], table[first[k], j]
        return words.format(k + 1, k + 2)

    return make


def block(column: str, factor: float, words: str) -> Callable[[Sheet, Rng], str]:
    def make(s: Sheet, rng: Rng) -> str:
        n = len(s.columns[column])
        a = int(rng.integers(2, n // 2))
        b = min(a + int(rng.integers(1, n // 3)), n)
        s.columns[column][a:b] *= factor
        return words.format(f"rows {a + 1} to {b}" if b > a + 1 else f"row {b}")

    return make


def hemisphere(s: Sheet, _: Rng) -> str:
    value, unit = s.comments["latitude"].split()
    s.comments["latitude"] = f"{-float(value)!r} {unit}"
    return "the latitude of the other sign"


OUTER, INNER = "outer_start outer_end", "inner_start inner_end"
ANGLES = "angle_start angle_end"
UNKNOWN = "a mistake that is not tried"
DEGREES = "the angles in degrees, not in rad"
MISTAKES: list[tuple[str, Callable[[Sheet, Rng], str]]] = [
    ("tumble_single_axis", labels("mount 1", "mount 2")),
    ("tumble_single_axis", labels("static 3", "static 4")),
    ("tumble_single_axis", times("mean", 2.0, "the current twice as large as it was, in mount 2", "mount 2")),
    ("tumble_single_axis", block("mean", 2.0, UNKNOWN)),
    ("tumble_single_axis", times("mean", -1.0, "the current reversed in mount 1", "mount 1")),
    ("tumble_single_axis", late("mean", "the current belonging to the row before")),
    ("tumble_single_axis", hemisphere),
    ("tumble_two_channel, nine", labels("mount 1", "mount 2")),
    ("tumble_two_channel, nine", labels("static 3", "static 4")),
    ("tumble_two_channel, nine", columns("mean_x", "mean_y", "the currents about x and y exchanged")),
    ("tumble_two_channel, simple", late("mean_x mean_y", "the current belonging to the row before")),
    ("tumble_two_axis", times(INNER, -1.0, "the inner rotation reversed")),
    ("tumble_two_axis", columns(OUTER, INNER, "outer and inner angle exchanged")),
    ("tumble_two_axis", neighbours(f"{OUTER} {INNER}", "positions {} and {} exchanged")),
    ("tumble_two_axis", times(f"{OUTER} {INNER}", 1.0 / DEGREE, DEGREES)),
    ("tumble_two_axis", late("mean", "the current belonging to the row before")),
    ("eight_position", positions(2, 4)),
    ("eight_position", positions(1, 5)),
    ("eight_position", columns("mean_x", "mean_y", "the currents about x and y exchanged")),
    ("fixed_position", block("mean", -1.0, "the current of the opposite sign in {}")),
    ("fixed_position", block("mean", 1e3, "the current times 1000 in {}")),
    ("open_loop_drift", late("u", "the pickoff voltage belonging to the row before")),
    ("open_loop_drift", neighbours("angle u", "readings {} and {} exchanged")),
    ("accelerometer_multipoint", neighbours(ANGLES, "angles {} and {} exchanged")),
    ("accelerometer_multipoint", late("mean", "the reading belonging to the row before")),
    ("accelerometer_multipoint, 12", times(ANGLES, 0.5, "the angles half as large as they were")),
    ("servo_vertical_level", block("angle_end", 1.1, UNKNOWN)),
    ("servo_vertical_level, twice", phases("x up", "x down")),
    ("servo_vertical_level, twice", reversed_phase),
    ("servo_polar", labels("polar S", "polar N")),
    ("servo_polar", labels("x east, y up", "x east, y down")),
    ("servo_polar", times(ANGLES, 1.0 / DEGREE, DEGREES)),
    ("servo_two_axis", times(INNER, -1.0, "the inner rotation reversed")),
    ("servo_two_axis", columns(OUTER, INNER, "outer and inner angle exchanged")),
    ("pickoff_scale_factor", late("mean", "the reading belonging to the row before")),
    ("pickoff_scale_factor", neighbours(ANGLES, "angles {} and {} exchanged")),
    ("torquer_scale_factor", neighbours("current", "the currents of rows {} and {} exchanged")),
]


MEASURED = [name for name in CASES if name in dict(MISTAKES)]  # others have no file of laboratory.py


# ---------------------------------------------------------------------------------------------- counting
@dataclass(frozen=True)
class Outcome:
    kind: str  # named, inconclusive, refused, wrong, pass
    said: str


def outcome(sheet: Sheet, mistake: str, clean: Result) -> Outcome:
    """What the report of a sheet says; mistake: words of the true one, "" of a clean record.  clean: of the sheet
    without it.
    """
    try:
        result = sheet.reduce(wide(clean))
    except GyrobenchError as error:
        text = str(error)
        named = "it can be reduced" in text
        kind = "refused" if not named else "named" if mistake and mistake in text else "wrong"
        return Outcome(kind, text.splitlines()[-1].strip())
    found = next((w for w in result.warnings if w.startswith("Handling error")), "")
    if found:
        return Outcome("named" if mistake and mistake in found else "wrong", found)
    both = [(result[c.name], c) for c in clean.coefficients if c.name in result.names]  # not effects of the set-up
    off = max(abs(a.estimate - b.estimate) / a.u for a, b in both)
    if result.verdict == "pass" and mistake and off < HARMLESS:
        return Outcome("harmless", f"{off:.1f} u")
    return Outcome(result.verdict, f"{off:.1f} u; {' '.join(result.withheld)}")


def main() -> int:
    given = asked(
        __doc__, errors=(len(MISTAKES), "records with a mistake, in turn of the list"), clean=100, seed=1,
        only=("", "cases whose name begins so"),
    )  # fmt: skip
    cases = [n for n in MEASURED if n.startswith(given.only)]
    rooms = {name: Laboratory(name, given.seed * 1000 + k) for k, name in enumerate(MEASURED) if name in cases}
    rng = np.random.default_rng(given.seed)
    counts: Counter[str] = Counter()
    for k in range(given.errors):
        name, make = MISTAKES[k % len(MISTAKES)]
        if name in rooms:
            sheet = rooms[name].sheet()
            clean = sheet.reduce(None)
            words = make(sheet, rng)
            found = outcome(sheet, words, clean)
            counts[found.kind] += 1
            print(f"{found.kind:<13}{name}: {words} | {found.said}", flush=True)
    print("records with a mistake:", ", ".join(f"{n} {k}" for k, n in counts.most_common()), flush=True)
    kinds: Counter[str] = Counter()
    for k in range(given.clean):
        name = cases[k % len(cases)]
        sheet = rooms[name].sheet()
        found = outcome(sheet, "", sheet.reduce(None))
        kinds["accused" if found.kind == "wrong" else found.kind] += 1
        if found.kind != "pass":
            print(f"{found.kind:<13}{name} {k} | {found.said}", flush=True)
    print("clean records:", ", ".join(f"{n} {k}" for k, n in kinds.most_common()))
    return 1 if counts["pass"] + counts["wrong"] + kinds["accused"] else 0


if __name__ == "__main__":
    sys.exit(main())
