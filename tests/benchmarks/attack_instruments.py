"""What tests of rate gyros and inertial units make of records of another hand, with mistakes of laboratories in them.

    python tests/benchmarks/attack_instruments.py [TEST ...] [--fault WORD] [--seeds 30]

Records, instruments and sites are written in plain numpy (attack_records.py, attack_units.py), from the equations and
without the bench's parts; each fault is of a size by chance, from one noise of a reading to a hundred.  Of each fault
are counted

right    no estimate is off by more than 3 u (imu_thermal: 4 u), and nothing is said
said     a warning, a doubt or a refusal, or an interval that a verdict must hold for too and that holds the truth
silent   an estimate is off by more than 3 u, and nothing is said

with the words said most often, and of the silent ones the coefficient that is off, by how many u.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from asked import asked
from attack_records import Written, shaken, shaken_one_way, stepped, warming
from attack_units import chamber, sculling

import gyrobench as gb
from gyrobench.errors import GyrobenchError
from gyrobench.result import Result

SERIOUS = ("error", "warning", "doubt")
EVERYWHERE = ("noise.unbounded", "turned.once")  # of any short record; of any that is turned over once
OFF, MANY = 3.0, 4.0  # u; of one of 75 coefficients
WRITERS: dict[str, tuple[str, Callable[[np.random.Generator, str], Written]]] = {
    "rate table": ("rate_table_test", stepped),
    "vibration": ("vibration_rectification", shaken),
    "one way": ("vibration_rectification", shaken_one_way),
    "imu_thermal": ("imu_positions", chamber),
    "warm_up": ("turn_on_repeatability", warming),
    "sculling": ("sculling_test", sculling),
}
ANY = ("", "coloured", "drift", "period", "jump", "coarse", "clipped", "frozen", "swapped")
SHAKEN = (*ANY, "linear", "heat", "heat seen", "peak")
FAULTS = {
    "rate table": (*(f for f in ANY if f not in ("frozen", "swapped")), "square", "fifth", "heat", "dead band"),
    "vibration": (*SHAKEN, "turned jump", "leans", "heading", "not turned", "ways exchanged", "gravity"),
    "one way": SHAKEN,
    "imu_thermal": (*ANY, "late", "gain", "own heat", "width", "fourth", "axes", "steps", "leans", "gravity",
                    "positions", "exchanged", "sign"),
    "warm_up": (*ANY, "seen", "late", "began warm", "diffusion", "third", "within", "lost"),
    "sculling": (*ANY, "phase", "heat", "other filter", "lever", "peak to peak", "full angle", "rad/s", "sign",
                 "antiphase"),
}  # fmt: skip
STATED = "# arrangement = checked\n# type_b = none\n"


def reduced(system: str, w: Written, folder: str) -> Result | str:
    """Return the result of a record, or what it is refused with."""
    file = Path(folder) / "lab.csv"
    rows = np.column_stack(list(w.columns.values())).tolist()
    lines = [",".join(f"{v:.12g}" for v in row) for row in rows]
    file.write_text(f"{STATED}{w.head}{','.join(w.columns)}\n" + "\n".join(lines) + "\n", encoding="utf-8")
    try:
        return gb.reduce(system, file).result
    except GyrobenchError as error:
        return str(error)


def judged(system: str, w: Written, folder: str) -> tuple[str, str, float]:
    """Return the outcome, the words or the coefficient that is off, and by how many u."""
    found = reduced(system, w, folder)
    if isinstance(found, str):
        return "said", "refused: " + found.splitlines()[-1].strip()[:60], math.nan
    off = {c.name: (c.estimate - w.truth[c.name]) / c.u for c in found.coefficients
           if c.name in w.truth and not c.no_value and c.u}  # fmt: skip
    worst = max(off, key=lambda n: abs(off[n]), default="")
    z = off.get(worst, 0.0)
    if said := [r.id for r in found.reasons if r.severity in SERIOUS and r.id not in EVERYWHERE]:
        return "said", said[0], z
    least = OFF if len(off) < 30 else MANY
    if abs(z) <= least:
        return "right", "", z
    for name in (n for n in off if abs(off[n]) > least):
        held = [r.id for r in found.reasons if name in r.intervals
                and r.intervals[name][0] <= w.truth[name] <= r.intervals[name][1]]  # fmt: skip
        if not held:
            return "silent", name, off[name]
    return "said", held[0], z


def main() -> None:
    given = asked(__doc__, "tests", seeds=(30, "records of each fault"), fault=("", "faults that have this word"))
    for test in given.tests or WRITERS:
        system, write = WRITERS[test]
        for fault in FAULTS[test]:
            if given.fault not in fault:
                continue
            counts, words, largest = Counter[str](), Counter[str](), list[str]()
            for seed in range(given.seeds):
                with tempfile.TemporaryDirectory() as folder:
                    outcome, what, z = judged(system, write(np.random.default_rng([seed, 7]), fault), folder)
                counts[outcome] += 1
                if outcome == "said":
                    words[what] += 1
                elif outcome == "silent":
                    largest.append(f"{what} {z:.1f} ({seed})")
            most = ", ".join(f"{w} {n}" for w, n in words.most_common(3))
            print(f"{test:<22}{fault:<26}right {counts['right']:>3}  said {counts['said']:>3}  "
                  f"silent {counts['silent']:>3}   {most}  {'; '.join(largest[:6])}", flush=True)  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
