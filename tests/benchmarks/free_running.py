"""Free-running growth of the attitude of units at rest by their data sheets, simulated, against the closed form:

    python tests/benchmarks/free_running.py [SHEET ...] [--runs 100] [--minutes 10] [--align 5] [--latitude 45] [--seed]

Three gyros of a sheet, parts with noise of their own, are read on the Earth, in an attitude by chance.  The mean of the
alignment less the Earth's rate is taken for their bias, the attitude is then integrated as quaternions (scipy), against
the Earth's rate.  Counted, about north, east and down: rms of the growth over the closed form of systems/north_finder
(down: with the turning of the axes by the Earth's rate), how often 1.96 of it hold the growth, with their chance.
"""

from __future__ import annotations

import math

import numpy as np
from asked import asked
from scipy import stats
from scipy.spatial.transform import Rotation

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.bench import Bench, standard_folder
from gyrobench.packaging import load_part
from gyrobench.units import DEG
from gyrobench.workflow.instruments import find_instrument, parameters
from systems.north_finder.after import RandomErrors, running

STEP = 5.0  # s; the parts give the mean of their white noise over it
AXES = ("north", "east", "down")


def earth(latitude: float) -> Array:
    """Return the Earth's rate along north, east, down, rad/s."""
    return units.EARTH_RATE * np.array([math.cos(latitude), 0.0, -math.sin(latitude)])


def readings(sheet: str, omega: Array, total: float, seed: int) -> Array:
    """Return (n, 3) rates that three gyros of a sheet read in steps of STEP, rad/s: of each part the axis x."""
    instrument = find_instrument(sheet)
    values = {
        n: v for n, v in parameters(instrument).items() if n != "resolution"
    }  # a step rounds the mean, not samples
    part = load_part(instrument.part)
    out = np.empty((round(total / STEP), 3))
    for axis in range(3):
        gyro = part(**values, seed=3 * seed + axis + 1)
        gyro.omega = [float(omega[axis]), 0.0, 0.0]
        gyro.initialize()
        for k in range(len(out)):
            gyro.do_step(STEP * k, STEP)
            out[k, axis] = gyro.rate[0]
    return out


def growth(sheet: str, align: float, total: float, latitude: float, seed: int) -> Array:
    """Return the error of the attitude that has grown in total after an alignment, about north, east, down, rad."""
    true = Rotation.random(random_state=seed)  # case to north, east, down
    rate = readings(sheet, true.inv().apply(earth(latitude)), align + total, seed)
    begin = round(align / STEP)
    bias = rate[:begin].mean(axis=0) - true.inv().apply(earth(latitude))
    found, back = true, Rotation.from_rotvec(-STEP * earth(latitude))
    for row in rate[begin:]:
        found = back * found * Rotation.from_rotvec(STEP * (row - bias))
    error: Array = (found * true.inv()).as_rotvec()
    return error


def counted(sheet: str, seeds: range, align: float, total: float, latitude: float) -> tuple[Array, Array, Array] | None:
    """Return growths (runs, 3) and closed forms (3,), rad, without and with the turning; None of unstated noise."""
    rate = RandomErrors.of(parameters(find_instrument(sheet)), "x")
    if rate is None:
        return None
    found = np.array([growth(sheet, align, total, latitude, k) for k in seeds])
    # north has the complement of the latitude to the Earth's rate, east 90 degrees, down the latitude
    across = [0.5 * math.pi - latitude, 0.0, latitude]
    plain = np.full(3, running(rate, 0.0, align, total))
    return found, plain, np.array([running(rate, 0.0, align, total, x) for x in across])


def main() -> None:
    given = asked(__doc__, "sheet", runs=100, minutes=10.0, align=5.0, latitude=45.0, seed=(0, "of the first run"))
    every = [n for n in Bench(standard_folder()).instruments() if find_instrument(n).density is not None]
    for sheet in given.sheet or every:
        seeds = range(given.seed, given.seed + given.runs)
        got = counted(sheet, seeds, 60.0 * given.align, 60.0 * given.minutes, given.latitude * DEG)
        if got is None:
            continue
        found, plain, closed = got
        hits, n = int(np.sum(np.abs(found) < 1.96 * closed)), found.size
        low, high = stats.beta.ppf(0.025, hits, n - hits + 1), stats.beta.ppf(0.975, hits + 1, max(n - hits, 1))
        rms = np.sqrt(np.mean(found**2, axis=0))
        each = ", ".join(f"{a} {r / c:.3f}" for a, r, c in zip(AXES, rms, closed, strict=True))
        print(
            f"{sheet:10} down: rms {rms[2] / DEG:.4g} deg, closed form {closed[2] / DEG:.4g} deg (axis by itself "
            f"{plain[2] / DEG:.4g}); ratios {each}, +- {1.0 / math.sqrt(2.0 * given.runs):.3f}; "
            f"1.96 of it hold {hits / n:.3f} of {n} ({low:.3f} to {high:.3f})", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    main()
