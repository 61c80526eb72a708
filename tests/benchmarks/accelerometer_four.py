"""Four accelerometers on one head: rms errors of sensor 1 by method over 400 records, and how often the intervals hold.

    python tests/benchmarks/accelerometer_four.py [--runs 400] [--reports 100] [--seed 1]

Records from the equations (tests/systems/accelerometers_four.py): head errors uniform within a range, readings with
white noise; five terms of the sensor alone, and the joint least squares with the first harmonic of the head known to
5e-7 rad or ignored.  Printed in uV, with the mean residual standard deviation.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[2]))
from accelerometers_four import ALPHA, ARCSEC, TRUE, head, voltages, windows
from asked import asked

from gyrobench.frames import G0
from systems.accelerometer_four import chain
from systems.accelerometer_four.reduction import FourSetup, Reduction, estimate

KNOWN = 5e-7  # rad
CASES: dict[str, tuple[float, float, tuple[float, float] | None]] = {
    "2 arcsec, 3 uV": (2 * ARCSEC, 3e-6, None),
    "2 arcsec, 0.3 uV": (2 * ARCSEC, 3e-7, None),
    "11 arcsec, 3 uV, D1 = 15, -1.9 urad": (11 * ARCSEC, 3e-6, (1.5e-5, -1.9e-6)),
}


def main() -> None:
    given = asked(__doc__, runs=400, reports=(100, "of them reduced in full, for the intervals"), seed=1)
    print("case, method: K_F, K_I, K_O, K_IO, K_II, mean s0 in uV; intervals that held")
    for name, (size, noise, D1) in CASES.items():
        rng = np.random.default_rng(given.seed)
        errors: dict[str, list[np.ndarray]] = {"alone": [], "joint, D1 known": [], "joint, D1 ignored": []}
        spread: dict[str, list[float]] = {m: [] for m in errors}
        held = []
        for n in range(given.runs):
            D = head(rng, size, D1)
            U = voltages(rng, D, noise)
            first = (2.0 * float(np.mean(D * np.cos(ALPHA))), 2.0 * float(np.mean(D * np.sin(ALPHA))))
            single, s = chain.alone(ALPHA, U, 1.0)
            errors["alone"].append(single[0] - TRUE[0])
            spread["alone"].append(float(s[0]))
            measured = (first[0] + KNOWN * rng.normal(), first[1] + KNOWN * rng.normal())
            for method, d in (("joint, D1 known", measured), ("joint, D1 ignored", None)):
                found = estimate(ALPHA, U, FourSetup(gravity=G0, D1=d), single[:, 1])
                errors[method].append(found.est.beta[:5] - TRUE[0])
                spread[method].append(found.residual_std)
            if n < given.reports:
                c = Reduction.reduce(
                    windows(U), FourSetup(gravity=G0, D1=measured, sizes={"u_D1": KNOWN})
                ).coefficients[:20]
                held.append([x.interval[0] <= t <= x.interval[1] for x, t in zip(c, TRUE.ravel(), strict=True)])
        for method, e in errors.items():
            rms = 1e6 * np.sqrt(np.mean(np.array(e) ** 2, axis=0))
            print(f"{name}; {method}: {', '.join(f'{v:.3g}' for v in rms)}, {1e6 * np.mean(spread[method]):.3g}")
        each = np.mean(held, axis=0)
        print(f"{name}: intervals held {each.min():.3f} .. {each.max():.3f}, mean {np.mean(held):.3f}", flush=True)


if __name__ == "__main__":
    main()
