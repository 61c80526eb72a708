"""Published Allan deviations matched by models that are fitted to the curves: docs/real_records.md.

    python tests/benchmarks/real_curves.py FOLDER [--write]

FOLDER: deviations_*.csv with sensor, axis, tau, deviation and its 95 % interval.  Non-negative least squares of the
Allan variance by the variances of white, angle and flicker noise, random walk, ramp and Gauss-Markov processes of GRID
correlation times, each variance weighted by its interval; processes faster than FAST steps are the sensor's filter and
count to N.  The record itself is not there: no interval, no evidence of terms.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import quoted
from real_records import put
from scipy.optimize import nnls

from gyrobench.arrays import Array
from gyrobench.reduction.series.channel_units import FORCE, RATE
from gyrobench.report.numbers import write_number
from gyrobench.units import G0

HEAD = ("τ / s", "inside / %", "N", "Gauss–Markov processes")
GRID = 60
ENOUGH = 0.95  # of the averaging times, for N
FAST = 10.0  # of the shortest averaging time
#: file -> SI of one of its unit, of gyros and accelerometers, as far as it is known
UNITS = {"adis": (math.radians(1.0), G0)}


def markov(tau: Array, tc: float) -> Array:
    """Allan variance of a Gauss-Markov process of variance 1: 2/x (1 - (3 - 4e + e^2)/(2x)), x = tau/tc, e = exp -x."""
    x = tau / tc
    e = np.exp(-x)
    exact = 2.0 / x * (1.0 - (3.0 - 4.0 * e + e * e) / (2.0 * x))
    return np.where(x > 1e-3, exact, 2.0 * x / 3.0)


def matched(tau: Array, dev: Array, low: Array, high: Array) -> tuple[Array, float, int]:
    """Return the deviation of the model, N, and the number of slow processes with a part in it."""
    times = np.geomspace(0.2 * tau[0], 3.0 * tau[-1], GRID)
    terms = [1.0 / tau, 1.0 / tau**2, np.ones_like(tau), tau, tau**2, *(markov(tau, tc) for tc in times)]
    u = dev * (high - low) / 1.96  # of the variance
    A = np.column_stack(terms) / u[:, None]
    size = np.linalg.norm(A, axis=0)
    found = nnls(A / size, dev**2 / u, maxiter=20_000)[0] / size
    fast = times < FAST * tau[0]
    N2 = found[0] + float(np.sum(2.0 * found[5:][fast] * times[fast]))
    slow = ~fast & (found[5:] > 0.0)
    return (
        np.sqrt(np.column_stack(terms) @ found),
        math.sqrt(N2),
        int(np.count_nonzero(np.diff(slow.astype(int), prepend=0) == 1)),
    )


def curves(file: Path) -> Iterator[tuple[str, str, Array]]:
    """Yield sensor, axis and the columns tau, deviation, low, high (4, k) of each curve."""
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    for sensor, axis in dict.fromkeys((r["sensor"], r["axis"]) for r in rows):
        mine = [r for r in rows if (r["sensor"], r["axis"]) == (sensor, axis)]
        yield sensor, axis, np.array([[float(r[n]) for r in mine] for n in ("tau [s]", "adev", "low", "high")])


def main(folder: Path, write: bool) -> None:
    for file in sorted(folder.glob("deviations_*.csv")):
        name = file.stem.removeprefix("deviations_")
        for sensor, axis, (tau, dev, low, high) in curves(file):
            gyro = sensor == "Gyroscope"
            shown = tau <= tau[-1] / 2.5  # a tenth of the record: the longest of the curve is a quarter
            model, N, slow = matched(tau, dev, low, high)
            inside = ((model >= low) & (model <= high))[shown]
            si = UNITS.get(name, (1.0, 1.0))[not gyro]
            unit, factor, _ = (RATE if gyro else FORCE).terms["N"]
            white = f"{write_number(N * si / factor, significant=3).text} {unit}"
            values = {
                "τ / s": f"{tau[0]:.2g} to {tau[shown][-1]:.3g}", "inside / %": f"{100.0 * inside.mean():.1f}",
                "N": white if inside.mean() >= ENOUGH else "–", "Gauss–Markov processes": str(slow),
            }  # fmt: skip
            print(f"| {name} {sensor} {axis} | {' | '.join(values[h] for h in HEAD)} |", flush=True)
            if write:
                quoted.record(f"curve.{name}-{sensor}-{axis}", values, "", "tests/benchmarks/real_curves.py FOLDER")
    if write:
        put("curve", HEAD)


if __name__ == "__main__":
    main(Path(sys.argv[1]), "--write" in sys.argv)
