"""Heading of units at rest by their data sheets: runs of north_finder against the closed form of systems/north_finder.

    python tests/benchmarks/heading_after.py [SHEET ...] [--runs 50] [--minutes 5] [--latitude 45]

Each run draws heading and noise, is a co-simulation of the two gyros and accelerometers at rest, in one position and in
two half a turn apart, and counts the error of the finder; sheets whose standard deviation is beyond 15 degrees are left
out.  Printed: rms of the runs, standard deviation of the closed form for the time of the readings, their ratio with the
standard error that it has by chance.
"""

from __future__ import annotations

import logging
import math

import numpy as np
from asked import asked

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import Session
from gyrobench.system.system import load_system
from gyrobench.units import DEG
from gyrobench.workflow.instruments import find_instrument, parameters, settings
from systems.north_finder import plans
from systems.north_finder.after import RandomErrors, heading

NAME = "north_finder"
METHODS = {False: "strapdown", True: "strapdown two"}
MOST = 15.0 * DEG
GENTLE = {f"accelerometers.white_{a}": 0.0 for a in "xyz"}  # the tilt is another matter


def errors(sheet: str, two: bool, runs: int, total: float, latitude: float) -> tuple[float, float] | None:
    """Return rms error of the finder and standard deviation of the closed form, rad; None beyond MOST."""
    instrument = find_instrument(sheet)
    rate = RandomErrors.of(parameters(instrument))
    reading = total - plans.overhead(METHODS[two], 1, False, 0.5, 1e-3)
    if rate is None or (expected := heading(rate, latitude, reading, two=two)) > MOST:
        return None
    system = load_system(NAME)
    system.set("method", METHODS[two])
    found = []
    with Session(system, {"gyro": instrument.part}) as session:
        for k in range(runs):
            psi = float(np.random.default_rng(k).uniform(-math.pi, math.pi))
            values = {"method": METHODS[two], "heading": psi, "time": total, "latitude": latitude, **GENTLE}
            record = session.run(settings(instrument) | values, seed=7000 + k)
            off = float(record.channels["finder.heading"][-1]) - psi
            found.append(math.remainder(off, 2.0 * math.pi))
    return float(np.sqrt(np.mean(np.square(found)))), expected


def main() -> None:
    given = asked(__doc__, "sheet", runs=50, minutes=5.0, latitude=45.0)
    logging.getLogger("gyrobench").setLevel(logging.ERROR)
    every = [n for n in Bench(standard_folder()).instruments() if find_instrument(n).density is not None]
    for sheet in given.sheet or every:
        for two, method in METHODS.items():
            found = errors(sheet, two, given.runs, 60.0 * given.minutes, given.latitude * DEG)
            if found is not None:
                ratio = found[0] / found[1]
                print(
                    f"{sheet:10} {method:14} runs {found[0] / DEG:7.3f} deg   closed form {found[1] / DEG:7.3f} deg   "
                    f"ratio {ratio:.3f} +- {ratio / math.sqrt(2.0 * given.runs):.3f}", flush=True,
                )  # fmt: skip


if __name__ == "__main__":
    main()
