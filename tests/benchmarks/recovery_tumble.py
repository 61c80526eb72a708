"""The full tumble, ten Earth rates and 20 million steps, noise off: do the coefficients come back?

    python tests/benchmarks/recovery_tumble.py --gyros 5

Random gyros (nine coefficients, ranges of Hu 1981, both signs) at random latitudes, 12 to 78 degrees north or south.
Prints the largest error of each coefficient, the lag of the loop by hand (tests/systems/tumbling.py), and the change
when the step is halved against u of a run with noise.  Limits: 1e-6 deg/h per g^n, and a tenth of u.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from asked import asked
from tumbling import NAMES, errors, gyro, lag, latitude, load, quiet

from gyrobench.engine.session import Session
from gyrobench.frames import EARTH_RATE


def main() -> int:
    given = asked(__doc__, gyros=5, seed=1)
    rng, system = np.random.default_rng(given.seed), load()
    error, by_hand, ratio = np.zeros(9), np.zeros(9), np.zeros(9)
    began = time.monotonic()
    with Session(system) as session:
        for k in range(given.gyros):
            values = {**gyro(rng), "latitude": latitude(rng)}
            at = system.with_values(values)
            whole, half = (
                errors(at.reduce(session.run({**values, **quiet(system)}, step=h)), values) for h in (1e-3, 5e-4)
            )
            u = {c.name: c.u for c in at.reduce(session.run(values, seed=k + 1)).coefficients}
            expected = lag(values, 10.0 * EARTH_RATE)
            for j, n in enumerate(NAMES):
                error[j] = max(error[j], abs(whole[n]))
                by_hand[j] = max(by_hand[j], abs(expected[n]))
                ratio[j] = max(ratio[j], abs(half[n] - whole[n]) / u[n])
            rate = (k + 1) / (time.monotonic() - began)
            print(f"{k + 1}/{given.gyros} gyros, {(given.gyros - k - 1) / rate:.0f} s left", file=sys.stderr)
    print(f"{given.gyros} gyros; deg/h per g^n")
    print(f"{'coefficient':<12}{'largest error':>14}{'lag by hand':>14}{'step halved / u':>18}")
    for n, e, b, r in zip(NAMES, error, by_hand, ratio, strict=True):
        print(f"{n:<12}{e:>14.2e}{b:>14.2e}{r:>18.2e}")
    good = bool(error.max() < 1e-6 and ratio.max() < 0.1)
    print("within the limits" if good else "OUTSIDE the limits")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
