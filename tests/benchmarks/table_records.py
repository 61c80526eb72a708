"""How often 95 % intervals of measured records of a table hold the truth: records written from the equations alone.

python tests/benchmarks/table_records.py [--runs 300] [--first 1] [--test angle_system_test]

The records of a position test have an autocollimator that drifts evenly, walks, is bent or swings with the time, or
none of it; harmonics, polygon, lost motion, wobble, tilt and plate are drawn.  Those of an angle system test are of
scales that read from any zero, with six orders of 0.05 to 2 arcsec and a lag, rounded to counts.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from asked import asked

import gyrobench as gb
from gyrobench.system.system import load_system

COUNT = 0.18  # arcsec
EVERY = 32.8  # s from reading to reading: 41 min
#: of the autocollimator (the level has as much): arcsec, time in 1000 s; noise of a reading, lost motion, ways
POSITIONS: dict[str, dict[str, float]] = {
    "clean": {},
    "drift of 1 arcsec/1000 s": {"drift": 1.0},
    "noise 0.1 arcsec, lost motion 1 arcsec": {"noise": 0.1, "lost": 1.0},
    "walk of 0.01 arcsec a reading": {"walk": 0.01},
    "walk of 0.03 arcsec a reading": {"walk": 0.03},
    "bent, 0.3 arcsec at 1000 s": {"bend": 0.3},
    "swing of 0.2 arcsec in 2500 s": {"swing": 0.2},
    "drift of 1 arcsec/1000 s, one way": {"drift": 1.0, "back": 0},
}


def position_record(
    seed: int, noise: float = 0.03, lost: float = 0.2, drift: float = 0.0, walk: float = 0.0, bend: float = 0.0,
    swing: float = 0.0, back: float = 1,
) -> tuple[list[list[float]], dict[str, float]]:  # fmt: skip
    """Return the rows of a record of mounts at 0, 30 and 180 deg, and the true values, arcsec."""
    rng = np.random.default_rng(seed)
    polygon = rng.standard_normal(12)
    polygon -= polygon.mean()
    waves = rng.standard_normal((3, 2)) * np.array([[0.5], [0.3], [0.1]])
    h, phase = lost * rng.standard_normal(), rng.uniform(0.0, 2.0 * math.pi)
    plate, tilt, wobble = (complex(*x) for x in 3.0 * rng.standard_normal((3, 2)))

    def error(x: float) -> float:
        return float(sum(a * math.cos(n * x) + b * math.sin(n * x) for n, (a, b) in enumerate(waves, 1)))

    rows: list[list[float]] = []
    t = away = 0.0
    for b in (0, 30, 180):
        zero = 3.0 * rng.standard_normal()
        for i, k in enumerate([*range(12), *(range(12, -1, -1) if back else ())]):
            x, azimuth = math.radians(30.0 * k), math.radians(b)
            way = 1.0 if 0 < i <= 12 else -1.0  # the table stands where the mount before left it
            counted = rng.uniform(-0.5, 0.5) * COUNT
            n = noise * rng.standard_normal(4)
            away += walk * rng.standard_normal()
            since = t / 1000.0
            off = drift * since + bend * since**2 + swing * math.sin(2.0 * math.pi * t / 2500.0 + phase) + away
            seen = error(x) - polygon[(k + b // 30) % 12] + zero + 0.5 * h * way - counted + off + n[0]
            second = error(x) - error(x + math.pi) + 7.0 - counted + n[1]
            level = (plate + tilt * np.exp(-1j * x) + wobble * np.exp(1j * x)) * np.exp(-1j * azimuth)
            level += (1.0 - 2.0j) * off + n[2] + 1j * n[3]
            rows.append([t, t + 2.0, b, 30 * k, seen, counted, 30 * k + second / 3600.0, level.real, level.imag])
            t += EVERY
    true = {
        f"E{n} {part}": float(v)
        for n, pair in enumerate(waves, 1)
        for part, v in zip(("cos", "sin"), pair, strict=True)
    }
    true |= {"tilt 1": tilt.imag, "tilt 2": -tilt.real, "wobble cos": wobble.imag, "wobble sin": -wobble.real}
    true |= {"squareness x": plate.real, "squareness y": plate.imag, "lost motion": h, "repeatability": noise}
    return rows, true


#: of an angle system test: noise before rounding, arcsec; reversal; rates, ERU; degrees from reading to reading
ANGLES: dict[str, dict[str, Any]] = {
    "rounding alone": {},
    "noise 0.02 arcsec": {"noise": 0.02},
    "reversal": {"reversal": True},
    "one rate": {"rates": (20,)},
    "readings every 0.5 deg, a whole number of counts": {"rates": (20, 200), "every": 0.5},
}
ORDERS = (1, 2, 12, 360, 720, 1440)
HEAD = math.radians(50.1)
ARCSEC = math.pi / 648000.0
ERU = 7.2921159e-5


def _scale(rng: np.random.Generator) -> dict[int, tuple[float, float]]:
    """Return order -> cos and sin, arcsec."""
    drawn = ((k, 10.0 ** rng.uniform(-1.3, 0.3), rng.uniform(0.0, 2.0 * math.pi)) for k in ORDERS)
    return {k: (size * math.cos(phase), size * math.sin(phase)) for k, size, phase in drawn}


def angle_record(
    seed: int,
    noise: float = 0.0,
    reversal: bool = False,
    rates: tuple[float, ...] = (20, 200, 1000),
    every: float = 0.309,
) -> tuple[list[list[float]], dict[str, float]]:
    """Return the rows of a record of 83 positions (reversal: twice 41) and rates both ways, and the true values."""
    rng = np.random.default_rng(seed)
    own, other = _scale(rng), _scale(rng)
    zeros, lag = rng.uniform(0.0, 2.0 * math.pi, 3), rng.uniform(0.0, 1e-3)

    def read(x: Any, scale: dict[int, tuple[float, float]], head: float, zero: float) -> Any:
        error = sum(a * np.cos(k * (x + head)) + b * np.sin(k * (x + head)) for k, (a, b) in scale.items())
        seen = np.degrees(x + zero) * 3600.0 + error + noise * rng.standard_normal(x.size)
        return COUNT * np.round(seen / COUNT) / 3600.0

    rows: list[list[float]] = []
    n = 41 if reversal else 83
    for turned in (0, 1) if reversal else (0,):
        j = np.arange(n)
        x = 2.0 * math.pi * (j + ((turned * n + j) * 0.5 * (math.sqrt(5.0) - 1.0)) % 1.0) / n
        first, second, reference = (
            read(x, scale, head, z) for scale, head, z in zip((own, own, other), (0.0, HEAD, 0.0), zeros, strict=True)
        )
        for k in range(n):
            seen = [second[k] if turned else first[k]] if reversal else [first[k], second[k]]
            t = 10.0 * len(rows)
            rows.append([len(rows) + 1, t, t + 0.1, 0.0, math.degrees(x[k]), turned, *seen, reference[k]])
    for phase, rate in enumerate((sign * r for r in rates for sign in (1, -1)), len(rows) + 1):
        w, steps = rate * ERU, np.arange(1, int(20.0 / every))
        x, dt = (
            math.copysign(math.radians(every), w) * steps + rng.uniform(0.0, 2.0 * math.pi),
            math.radians(every) / abs(w),
        )
        t, late = rows[-1][2] + 3.0 + steps * dt, x - lag * w
        first, second, reference = (
            read(late, own, 0.0, zeros[0]),
            read(late, own, HEAD, zeros[1]),
            read(x, other, 0.0, zeros[2]),
        )
        for k in range(steps.size):
            seen = [first[k]] if reversal else [first[k], second[k]]
            rows.append([phase, t[k] - 0.4 * dt, t[k], rate, 0.0, 0.0, *seen, reference[k]])
    true = {"delay": lag * 1e6}
    for prefix, scale in (("", own), ("ref_", other)):
        true |= {
            f"{prefix}{part}_{k}": v for k, pair in scale.items() for part, v in zip(("cos", "sin"), pair, strict=True)
        }
    return rows, true


def reduced(name: str, rows: list[list[float]], folder: Path) -> Any:
    measured = load_system(name).measured_data
    assert measured is not None
    head, path = measured.template, folder / "record.csv"
    if name == "angle_system_test" and len(rows[0]) == 8:
        head = head.replace("method = two_heads", "method = reversal").replace(",reading_2 [deg]", "")
    path.write_text(head + "\n".join(",".join(f"{x:.14g}" for x in row) for row in rows) + "\n", encoding="utf-8")
    return gb.reduce(name, path).result


def kind(name: str) -> str:
    """Return the kind of a coefficient: both parts of an order, both axes of a tilt together."""
    if name.startswith(("lost", "delay")):
        return name
    return name.split()[0] if " " in name else name.replace("cos_", "").replace("sin_", "")


TESTS: dict[str, tuple[dict[str, dict[str, Any]], Any]] = {
    "table_position_test": (POSITIONS, position_record),
    "angle_system_test": (ANGLES, angle_record),
}


def count(test: str, case: str, seeds: range, folder: Path) -> None:
    cases, record = TESTS[test]
    found: dict[str, list[tuple[bool, float]]] = {}
    for seed in seeds:
        rows, true = record(seed, **cases[case])
        for c in reduced(test, rows, folder).coefficients:
            if c.name in true and not c.no_value:
                held = c.interval[0] <= true[c.name] <= c.interval[1]
                found.setdefault(kind(c.name), []).append((held, (c.estimate - true[c.name]) / c.u))
    for name, each in found.items():
        held, z = np.array(each).T
        print(
            f"{test}, {case}: {name} {held.mean():.3f} of {held.size}, rms z {np.sqrt(np.mean(z**2)):.2f}", flush=True
        )
    every = [held for each in found.values() for held, _ in each]
    print(f"{test}, {case}: all {np.mean(every):.3f} of {len(every)}", flush=True)


def main() -> None:
    given = asked(__doc__, runs=300, first=1, test=["", *TESTS], case=("", "cases whose name begins so"))
    with tempfile.TemporaryDirectory() as folder:
        for test in [given.test] if given.test else TESTS:
            for case in (c for c in TESTS[test][0] if c.startswith(given.case)):
                count(test, case, range(given.first, given.first + given.runs), Path(folder))


if __name__ == "__main__":
    main()
