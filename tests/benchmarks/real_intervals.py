"""Noise models of real records held against intervals of allantools alone: docs/real_records.md.

    python tests/benchmarks/real_intervals.py FOLDER

FOLDER: as of real_records.py.  Overlapping Allan deviations, degrees of freedom by Greenhall for the power law that
allantools finds at each averaging time, white noise where the record is too short for that; its share of 95 %
intervals that hold the deviation implied by the model, beside that of the report's own.
"""

from __future__ import annotations

import sys
from pathlib import Path

import allantools
import numpy as np
import pyarrow.parquet as pq
from real_records import MOVED, unit_of

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.agreement import ENOUGH
from gyrobench.reduction.noise_model.fit import fit_noise

LEAST = 30  # of the record over an averaging time, for its power law


def held(x: Array) -> tuple[float, float]:
    """Return the shares of averaging times by allantools and by the report of a rate (n,)."""
    own = fit_noise(x, 1.0, means=False).agreements[0]
    angle = np.append(0.0, np.cumsum(np.where(np.isfinite(x), x, np.nanmean(x))))
    tau, deviation, _, _ = allantools.oadev(angle, rate=1.0, data_type="phase", taus=own.tau)
    inside = []
    for m, d in zip(np.rint(tau).astype(int), deviation, strict=True):
        law = allantools.autocorr_noise_id(angle, int(m), data_type="phase")[0] if m * LEAST < x.size else 0
        edf = allantools.edf_greenhall(max(min(round(law), 2), -2), 2, m, angle.size, overlapping=True, modified=False)
        low, high = allantools.confidence_interval(d, edf, 0.95)
        inside.append(low <= own.implied[np.argmin(np.abs(own.tau - m))] <= high)
    return float(np.mean(inside)), own.share


def main(folder: Path) -> None:
    shares = []
    for file in sorted(f for f in folder.glob("*.parquet") if MOVED not in f.name):
        table = pq.read_table(file)
        for name in (n for n in table.schema.names if n.startswith(("gyro", "acc"))):
            x = units.unit(unit_of(file.stem, name)).factor * table[name].to_numpy().astype(float)
            shares.append(held(x))
            print(f"| {file.stem} {name} | {shares[-1][0]:.3f} | {shares[-1][1]:.3f} |", flush=True)
    by_others, own = (sum(s >= ENOUGH for s in each) for each in zip(*shares, strict=True))
    print(f"at {ENOUGH:.0%} or more: {by_others} of {len(shares)} by allantools, {own} by the report")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
