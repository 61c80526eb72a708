"""Thirty kinds of handling errors in records of six tests with measured data, by seeds: none may end in "pass".

    python tests/benchmarks/handling_kinds.py [--seeds 20] [--first 1] [--only tumble_single_axis] [--kinds 3,21]

Each record is a co-simulation with a random instrument, latitude and noise, written as a laboratory writes it
(laboratory.py), with one mistake, and with no word that its arrangement was checked: nobody looked.  It is reduced with
limits that every coefficient keeps.  Counted is what the report says:

named         the mistake, with those that leave the same residuals
refused       with a reason, before anything was reduced
asked         nothing passes without arrangement = checked: no residual shows this mistake
inconclusive  for another reason
harmless      it passes, and no estimate is off by 3 u
pass          it passes

Clean records with arrangement = checked are reduced beside: those must pass.
"""

from __future__ import annotations

import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable

import numpy as np
from asked import asked
from laboratory import Laboratory, Sheet, wide

from gyrobench.errors import GyrobenchError
from gyrobench.reduction.diagnosis.handling_errors import HANDLING
from gyrobench.reduction.diagnosis.unshown import ARRANGEMENT
from gyrobench.reduction.estimation.verdict import WITHHELD
from gyrobench.result import Result

Rng = np.random.Generator
Kind = Callable[[Sheet, Rng], bool]  # False: this test has nothing that could be so mistaken
SIX = (
    "tumble_single_axis", "servo_vertical_level", "eight_position", "accelerometer_multipoint", "pickoff_scale_factor",
    "torquer_scale_factor",
)  # fmt: skip
HARMLESS = 3.0  # u
DEGREE = np.pi / 180.0


# ---------------------------------------------------------------------------------------------- what a sheet has
def readings(s: Sheet) -> list[str]:
    """Return the columns that an instrument gave: currents, voltages; of a servo test the angles."""
    own = [n for n in s.columns if n.startswith("mean") or n in ("current", "u")]
    return own or angles(s)


def angles(s: Sheet) -> list[str]:
    return [n for n in s.columns if n.startswith(("angle", "outer", "inner", "rate"))]


def places(s: Sheet) -> dict[str, np.ndarray]:
    """Return where each attitude was taken: name -> rows."""
    if "position" in s.columns:
        return {f"{p:g}": s.columns["position"] == p for p in np.unique(s.columns["position"])}
    named = {k.split()[1]: v for k, v in s.comments.items() if k.startswith("phase ")}
    return {v: np.isin(s.columns["phase"], [float(k) for k, x in named.items() if x == v]) for v in named.values()}


def scale(factor: float, of: Callable[[Sheet], list[str]], where: str = "") -> Kind:
    """Columns times a factor: throughout, in one attitude ("place"), in a few rows ("rows") or from half on."""

    def make(s: Sheet, rng: Rng) -> bool:
        names, n = of(s), len(next(iter(s.columns.values())))
        here = np.ones(n, bool)
        if where == "place":
            known = list(places(s).values()) if "phase" in s.columns or "position" in s.columns else []
            known = [rows for rows in known if 0 < np.count_nonzero(rows) < n]
            if not known:
                return False
            here = known[rng.integers(len(known))]
        elif where == "rows":
            a = int(rng.integers(0, n - 3))
            here = (np.arange(n) >= a) & (np.arange(n) < a + max(n // 20, 1))
        elif where == "half":
            here = np.arange(n) >= n // 2
        for c in names:
            s.columns[c] = np.where(here, factor * s.columns[c], s.columns[c])
        return bool(names)

    return make


def exchanged_places(pairs: int) -> Kind:
    """Attitudes exchanged, one pair or two at once."""

    def make(s: Sheet, rng: Rng) -> bool:
        known = list(places(s)) if "phase" in s.columns or "position" in s.columns else []
        modes: dict[str, list[str]] = {}
        for name in known:
            modes.setdefault(name.split()[0] if s.system.startswith("tumble") else "", []).append(name)
        possible = [m for m in modes.values() if len(m) > 1]
        if len(possible) == 1 and len(possible[0]) >= 2 * pairs:
            some = list(rng.permutation(possible[0]))
            chosen = [(some[2 * k], some[2 * k + 1]) for k in range(pairs)]
        elif len(possible) >= pairs:
            chosen = [(m[0], m[1]) for m in (possible if pairs > 1 else [possible[rng.integers(len(possible))]])]
        else:
            return False
        other = {a: b for a, b in [*chosen, *((b, a) for a, b in chosen)]}
        if "position" in s.columns:
            p = s.columns["position"]
            s.columns["position"] = np.array([float(other.get(f"{x:g}", x)) for x in p])
        s.comments = {k: other.get(v, v) if k.startswith("phase ") else v for k, v in s.comments.items()}
        return True

    return make


def late(of: Callable[[Sheet], list[str]]) -> Kind:
    def make(s: Sheet, _: Rng) -> bool:
        for c in of(s):
            s.columns[c] = np.roll(s.columns[c], 1)
        return bool(of(s))

    return make


def neighbours(s: Sheet, rng: Rng) -> bool:
    k = int(rng.integers(1, len(next(iter(s.columns.values()))) - 2))
    for c in readings(s):
        s.columns[c][[k, k + 1]] = s.columns[c][[k + 1, k]]
    return True


def blocks(s: Sheet, rng: Rng) -> bool:
    n = len(next(iter(s.columns.values())))
    size = max(n // 8, 1)
    a = int(rng.integers(0, n - 2 * size + 1))
    b = int(rng.integers(a + size, n - size + 1))
    for c in readings(s):
        x = s.columns[c]
        x[a : a + size], x[b : b + size] = x[b : b + size].copy(), x[a : a + size].copy()
    return True


def copied(s: Sheet, _: Rng) -> bool:
    """The readings of one attitude (of one sense, of half a record) copied into another of as many rows."""
    n = len(next(iter(s.columns.values())))
    rows = list(places(s).values()) if "phase" in s.columns or "position" in s.columns else []
    same = [(a, b) for i, a in enumerate(rows) for b in rows[i + 1 :] if a.sum() == b.sum() > 0]
    a, b = same[-1] if same else (np.arange(n) < n // 2, (np.arange(n) >= n // 2) & (np.arange(n) < 2 * (n // 2)))
    for c in readings(s):
        s.columns[c][b] = s.columns[c][a]
    return True


def zero(where: str) -> Kind:
    """The zero of the angles off by 1 deg."""

    def make(s: Sheet, rng: Rng) -> bool:
        known = [n for n in angles(s) if not n.startswith("rate")]
        rows = list(places(s).values()) if where == "place" and "phase" in s.columns else []
        here = rows[rng.integers(len(rows))] if rows else np.ones(len(next(iter(s.columns.values()))), bool)
        for c in known:
            s.columns[c] = s.columns[c] + DEGREE * here
        return bool(known) and (where != "place" or bool(rows))

    return make


def stated(keys: tuple[str, ...], change: Callable[[float], float]) -> Kind:
    """A number of the comments mistaken."""

    def make(s: Sheet, rng: Rng) -> bool:
        known = [k for k in keys if k in s.comments]
        if not known:
            return False
        key = known[rng.integers(len(known))]
        number, _, unit = s.comments[key].partition(" ")
        s.comments[key] = f"{change(float(number))!r} {unit}".strip()
        return True

    return make


def step(s: Sheet, _: Rng) -> bool:
    """The readings shifted in one half by ten times what they differ by from row to row, robustly."""
    for c in readings(s):
        x = s.columns[c]
        x[x.size // 2 :] += 10.0 * float(np.median(np.abs(np.diff(x))))
    return True


def ramp(s: Sheet, _: Rng) -> bool:
    """The gain of the meter creeps by 2 % over the record."""
    for c in readings(s):
        s.columns[c] = s.columns[c] * np.linspace(0.99, 1.01, s.columns[c].size)
    return True


def wild(s: Sheet, rng: Rng) -> bool:
    """One reading off by the whole range of the others."""
    c = readings(s)[0]
    s.columns[c][rng.integers(s.columns[c].size)] += float(np.ptp(s.columns[c]))
    return True


def saturated(s: Sheet, _: Rng) -> bool:
    """The meter ends at 80 % of the range."""
    for c in readings(s):
        low, high = s.columns[c].min(), s.columns[c].max()
        s.columns[c] = np.minimum(s.columns[c], low + 0.8 * (high - low))
    return True


def coarse(s: Sheet, _: Rng) -> bool:
    """Read to a tenth of the range."""
    for c in readings(s):
        unit = float(np.ptp(s.columns[c])) / 10.0
        s.columns[c] = unit * np.round(s.columns[c] / unit)
    return True


def columns(s: Sheet, _: Rng) -> bool:
    for a, b in (
        ("mean_x", "mean_y"),
        ("outer_start", "inner_start"),
        ("rate_plus", "rate_minus"),
        ("t_start", "t_end"),
    ):
        if a in s.columns and b in s.columns:
            s.columns[a], s.columns[b] = s.columns[b], s.columns[a]
            return True
    return False


def times(s: Sheet) -> list[str]:
    return [n for n in s.columns if n.startswith("t_")]


LATITUDE, SCALES = ("latitude",), ("k", "k_x", "k_y", "scale", "gain", "float_gain")
KINDS: dict[str, Kind] = {
    "two attitudes exchanged": exchanged_places(1),
    "two pairs of attitudes exchanged": exchanged_places(2),
    "angles or rates reversed": scale(-1.0, angles),
    "angles reversed in one attitude": scale(-1.0, angles, "place"),
    "readings reversed": scale(-1.0, readings),
    "readings reversed in one attitude": scale(-1.0, readings, "place"),
    "readings times 1000": scale(1e3, readings),
    "readings doubled": scale(2.0, readings),
    "a meter 2 % off": scale(1.02, readings),
    "readings times 1000 in a few rows": scale(1e3, readings, "rows"),
    "readings doubled in one attitude": scale(2.0, readings, "place"),
    "a gain 2 % off from half the record on": scale(1.02, readings, "half"),
    "a gain that creeps by 2 %": ramp,
    "readings a row late": late(readings),
    "angles a row late": late(angles),
    "two neighbouring readings exchanged": neighbours,
    "two blocks of readings exchanged": blocks,
    "readings copied from another attitude": copied,
    "angles in degrees taken for rad": scale(1.0 / DEGREE, angles),
    "angles doubled": scale(2.0, angles),
    "zero of the angles 1 deg off in one attitude": zero("place"),
    "zero of the angles 1 deg off": zero(""),
    "latitude of the other sign": stated(LATITUDE, lambda x: -x),
    "latitude 5 deg off": stated(LATITUDE, lambda x: x - np.copysign(5.0 * DEGREE, x)),
    "a stated scale 2 % off": stated(SCALES, lambda x: 1.02 * x),
    "times in minutes taken for seconds": scale(1.0 / 60.0, times),
    "a step of the readings": step,
    "one wild reading": wild,
    "a meter that saturates": saturated,
    "readings too coarse": coarse,
    "two columns exchanged": columns,
}


# ---------------------------------------------------------------------------------------------- counting
def outcome(sheet: Sheet, clean: Result) -> tuple[str, str]:
    """Return what becomes of a sheet with a mistake.  clean: of the sheet without it."""
    try:
        result = sheet.reduce(wide(clean))
    except GyrobenchError as error:
        return "refused", str(error).splitlines()[-1].strip()
    said = next((r.text for r in result.reasons if r.id == HANDLING), "")
    if said and result.verdict != "pass":
        return "named", said
    both = [(result[c.name], c) for c in clean.coefficients if c.name in result.names and c.u > 0.0]
    off = max((abs(a.estimate - b.estimate) / a.u for a, b in both if a.u > 0.0), default=0.0)
    taken = " ".join(r.text for r in result.reasons if r.id.startswith(WITHHELD))
    if result.verdict == "pass":
        return ("harmless" if off < HARMLESS else "pass"), f"{off:.1f} u"
    if any(r.id == f"{WITHHELD}:{ARRANGEMENT}" for r in result.reasons):
        return "asked", taken
    return "inconclusive", f"{result.verdict}, {off:.1f} u; {taken}"


def main() -> int:
    given = asked(
        __doc__, seeds=20, first=1, only=("", "the test whose name begins so"),
        kinds=("", "numbers of kinds, from 1, with commas"),
    )  # fmt: skip
    wanted = [int(k) for k in given.kinds.split(",")] if given.kinds else range(1, len(KINDS) + 1)
    counts: dict[str, Counter[str]] = {name: Counter() for name in KINDS}
    clean_counts: Counter[str] = Counter()
    start = time.process_time()
    for test in [n for n in SIX if n.startswith(given.only)]:
        room = Laboratory(test, given.first + 1000 * zlib.crc32(test.encode()) % 10_000)
        for seed in range(given.first, given.first + given.seeds):
            sheet = room.sheet()
            clean = sheet.reduce(None)
            clean_counts[sheet.reduce(wide(clean)).verdict] += 1
            kept = {c: v.copy() for c, v in sheet.columns.items()}, dict(sheet.comments)
            kept[1].pop("arrangement")
            for k, (name, make) in enumerate(KINDS.items(), 1):
                if k not in wanted:
                    continue
                sheet.columns, sheet.comments = {c: v.copy() for c, v in kept[0].items()}, dict(kept[1])
                if not make(sheet, np.random.default_rng([seed, k])):
                    continue
                kind, words = outcome(sheet, clean)
                counts[name][kind] += 1
                if kind in ("pass", "inconclusive"):
                    print(f"{kind}: {test}, {seed}, {k} {name} | {words[:300]}", flush=True)
        print(f"# {test}: {time.process_time() - start:.0f} s", flush=True)
    every: Counter[str] = Counter()
    for name, each in counts.items():
        every += each
        print(f"{name}: {', '.join(f'{n} {k}' for n, k in each.most_common())}")
    print(f"all {every.total()}: {', '.join(f'{n} {k}' for n, k in every.most_common())}")
    print(f"clean: {', '.join(f'{n} {k}' for n, k in clean_counts.most_common())}")
    return 1 if every["pass"] else 0


if __name__ == "__main__":
    sys.exit(main())
