"""Mistakes drawn without a look at what the bench tries: any label, column, row, sign and factor.

    python tests/benchmarks/handling_blind.py [--records 60] [--seed 1]

handling.py makes the mistakes that the diagnosis knows.  Here a mistake is drawn from what can be done to a sheet of
paper: two labels exchanged, two columns of one unit, two groups of rows of one column, rows moved up or down, a column,
an attitude or a block of rows times a factor of a wrong unit or of -1, a comment with the other sign.  What counts
is whether a wrong figure leaves with a verdict "pass": "harmless" where no estimate is off by 3 u, "silent" where the
residuals did not change (the scatter of the fit as it was within a tenth, or multiplied with all data: no reduction can
see such a mistake; diagnosis.handling_errors lists them), "warned" where of these a coefficient is said to be
of the size of the Earth rate, "pass" otherwise.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
from asked import asked
from handling import HARMLESS, MEASURED, Laboratory, Rng, Sheet, wide

from gyrobench.errors import GyrobenchError
from gyrobench.result import Result

FACTORS = (-1.0, 10.0, 0.1, 1e3, 1e-3, 2.0, 0.5, 60.0, 1.0 / 60.0, np.pi / 180.0, 180.0 / np.pi, 1.1, 0.9)
KEYS = ("phase", "position", "cycle")


def unit(name: str) -> str:
    return name.split("_")[0]


def labels(s: Sheet, rng: Rng) -> str:
    keys = [k for k in s.comments if k.startswith("phase ")]
    if len({s.comments[k] for k in keys}) < 2:
        return ""
    a, b = rng.choice(keys, 2, replace=False)
    s.comments[a], s.comments[b] = s.comments[b], s.comments[a]
    return f"labels of {a} and {b} exchanged"


def pair(s: Sheet, rng: Rng) -> str:
    pairs = [(a, b) for a in s.columns for b in s.columns if a < b and a not in KEYS and b not in KEYS]
    pairs = [(a, b) for a, b in pairs if (unit(a) == unit(b) or {unit(a), unit(b)} == {"outer", "inner"})]
    pairs = [p for p in pairs if not p[0].startswith("t_")]
    if not pairs:
        return ""
    a, b = pairs[rng.integers(len(pairs))]
    s.columns[a], s.columns[b] = s.columns[b], s.columns[a]
    return f"columns {a} and {b} exchanged"


def data(s: Sheet, rng: Rng) -> str:
    names = [n for n in s.columns if n not in KEYS and not n.startswith("t_")]
    return str(rng.choice(names))


def rows(s: Sheet, rng: Rng) -> str:
    c = data(s, rng)
    x, n = s.columns[c], len(s.columns[c])
    size = int(rng.integers(1, max(n // 8, 2)))
    a = int(rng.integers(0, n - 2 * size + 1))
    b = int(rng.integers(a + size, n - size + 1))
    x[a : a + size], x[b : b + size] = x[b : b + size].copy(), x[a : a + size].copy()
    return f"{c}: {size} rows from {a + 1} exchanged with those from {b + 1}"


def moved(s: Sheet, rng: Rng) -> str:
    c, by = data(s, rng), int(rng.choice([-2, -1, 1, 2]))
    s.columns[c] = np.roll(s.columns[c], by)
    return f"{c}: moved by {by} rows"


def scaled(s: Sheet, rng: Rng) -> str:
    c, factor, n = data(s, rng), float(rng.choice(FACTORS)), len(next(iter(s.columns.values())))
    where = int(rng.integers(3))
    here, words = np.ones(n, bool), "everywhere"
    if where == 1 and "phase" in s.columns:
        p = rng.choice(np.unique(s.columns["phase"]))
        here, words = s.columns["phase"] == p, f"in phase {p:g}"
    elif where == 2:
        a = int(rng.integers(0, n - 1))
        b = int(rng.integers(a + 1, min(a + n // 3, n) + 1))
        here, words = (np.arange(n) >= a) & (np.arange(n) < b), f"in rows {a + 1} to {b}"
    s.columns[c][here] *= factor
    return f"{c} times {factor:.4g} {words}"


def comment(s: Sheet, rng: Rng) -> str:
    given = [k for k in ("latitude", "k", "k_x", "k_y", "float_gain", "gain") if k in s.comments]
    if not given:
        return ""
    key = str(rng.choice(given))
    s.comments[key] = s.comments[key][1:] if s.comments[key].startswith("-") else "-" + s.comments[key]
    return f"{key} with the other sign"


MAKERS: tuple[Callable[[Sheet, Rng], str], ...] = (labels, pair, rows, moved, scaled, scaled, comment)


def judged(sheet: Sheet, clean: Result, factor: float) -> tuple[str, str]:
    """What becomes of a sheet with a mistake: kind and words.  factor: by which all data of a column are multiplied."""
    try:
        result = sheet.reduce(wide(clean))
    except GyrobenchError as error:
        text = str(error).splitlines()[-1].strip()
        return ("named" if "it can be reduced" in str(error) else "refused"), text
    named = next((w for w in result.warnings if w.startswith("Handling error")), "")
    if named:
        return "named", named
    both = [(result[c.name], c) for c in clean.coefficients if c.name in result.names]
    off = max(abs(a.estimate - c.estimate) / a.u for a, c in both)
    ratio = result.residual_std / clean.residual_std
    words = f"{off:.1f} u; scatter {ratio:.2f}"
    if result.verdict != "pass":
        return result.verdict, words
    if off < HARMLESS:
        return "harmless", words
    if any("Check the sign of the latitude" in w for w in result.warnings):
        return "warned", words
    return ("silent" if any(0.9 < ratio / size < 1.1 for size in (1.0, factor)) else "pass"), words


def main() -> int:
    given = asked(__doc__, records=60, seed=1)
    rng = np.random.default_rng(given.seed)
    names = MEASURED
    rooms: dict[str, Laboratory] = {}
    counts: Counter[str] = Counter()
    for k in range(given.records):
        name = names[k % len(names)]
        room = rooms.setdefault(name, Laboratory(name, given.seed * 1000 + k))
        sheet = room.sheet()
        clean = sheet.reduce(None)
        words = ""
        while not words:
            words = MAKERS[rng.integers(len(MAKERS))](sheet, rng)
        factor = abs(float(words.split(" times ")[1].split()[0])) if words.endswith("everywhere") else 1.0
        kind, said = judged(sheet, clean, factor)
        counts[kind] += 1
        print(f"{kind:<13}{name}: {words} | {said}", flush=True)
    print("mistakes:", ", ".join(f"{n} {k}" for k, n in counts.most_common()))
    return 1 if counts["pass"] else 0


if __name__ == "__main__":
    sys.exit(main())
