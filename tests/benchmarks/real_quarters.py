"""Quarters of real records: whether N and Q of four parts of a record scatter as their intervals say.

    python tests/benchmarks/real_quarters.py FOLDER [PART_OF_A_NAME ...]

Each quarter of a channel (see real_records.py) is a record of its own.  chi2: sum of the squares of the logarithms less
their weighted mean, over the u of each, a quarter of its interval's logarithm.  What is scattered more than chance
makes is no fault of an interval where the noise itself changes: docs/real_records.md has what the model of the whole
record says of its quarters.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from real_records import MOVED, unit_of
from scipy import special

from gyrobench import units
from gyrobench.reduction.noise_model.constancy import PARTS
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.noise_coefficients import Estimate

TERMS = ("N", "Q")
RARE = 0.01  # p of a scatter by chance


def scatter(found: list[Estimate]) -> tuple[float, int, str]:
    """Return chi squared of estimates, its degrees of freedom, and what each is off by, in per cent with u."""
    log = np.log([e.value for e in found])
    u = np.log([e.high / e.low for e in found]) / 3.92
    off = log - np.average(log, weights=u**-2)
    said = ", ".join(f"{100.0 * a:+.1f} ± {100.0 * b:.1f}" for a, b in zip(off, u, strict=True))
    return float(np.sum((off / u) ** 2)), off.size - 1, said


def main(folder: Path, parts: list[str]) -> None:
    rare = {term: [0, 0] for term in TERMS}  # channels, those that scatter
    for file in sorted(folder.glob("*.parquet")):
        if MOVED in file.name or (parts and not any(p in file.name for p in parts)):
            continue
        table = pq.read_table(file)
        for name in (n for n in table.schema.names if n.startswith(("gyro", "acc"))):
            x = units.unit(unit_of(file.stem, name)).factor * table[name].to_numpy().astype(float)
            quarters = [m for m in (fit_noise(y, 1.0, means=False) for y in np.array_split(x, PARTS)) if m.agrees]
            for term in TERMS:
                stated = [m[term] for m in quarters if m[term].determined and m[term].low > 0.0]
                if len(stated) < 2:
                    continue
                chi2, freedom, said = scatter(stated)
                p = float(special.chdtrc(freedom, chi2))
                rare[term][0] += 1
                rare[term][1] += p < RARE
                print(f"| {file.stem} {name} | {term} | {chi2:.1f} of {freedom}, p {p:.2g} | {said} |", flush=True)
    for term, (channels, scattered) in rare.items():
        print(f"{term}: of {channels} channels {scattered} scatter (p < {RARE})")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
