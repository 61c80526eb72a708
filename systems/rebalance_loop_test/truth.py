"""What the parameters of the parts make of the reported values: errors of the pulses, of the torquer, drift."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from gyrobench import drift

NAMES = ("I_0", "κ", "κ_±", "κ_2", "κ_3")


def currents(p: Mapping[str, Any]) -> tuple[Polynomial, Polynomial]:
    """Return the true mean current as a polynomial of a positive and of a negative reading, A.

    [REBAL-PWM, REBAL-PULSE; Hu 1981, eq. 5-74..5-76 with ET18]
    """
    full = float(p.get("rebalance.I", 1.0))
    plus, minus = (float(p.get(f"rebalance.dI_{s}", 0.0)) for s in ("plus", "minus"))
    if "rebalance.f_s" in p:
        late = [float(x) * float(p["rebalance.f_s"]) for x in p.get("rebalance.dT", (0.0, 0.0, 0.0))]
        edge = 2.0 * full + plus + minus
        bias = (plus - minus) / 2.0 + edge * late[0]
        slope = 1.0 + ((plus + minus) / 2.0 + edge * late[1]) / full
        one = Polynomial([bias, slope, edge * late[2] / full**2])
        return one, one
    longer = 1.0 + float(p.get("rebalance.f_q", 0.0)) * float(p.get("rebalance.dT", 0.0))
    both = (Polynomial([0.0, (1.0 + error / full) * longer]) for error in (plus, minus))
    return next(both), next(both)


def true_values(p: Mapping[str, Any], k: float, g: float, full: float) -> dict[str, float] | None:
    """Return the values of :data:`NAMES`, SI; None of a gyro that does not tell its torquer.

    k: scale factor of the reduction, rad/s/A.  g: gravity over g0; the input axis is up, X = -g.  full: largest
    current of the test, A.
    """
    if "gyro.k" not in p:
        return None
    names = ("k", "k2", "k3")
    torquer, k2, k3 = (float(p.get(f"gyro.{n}", 0.0)) for n in names)
    static = {n: float(p.get(f"gyro.{n}", 0.0)) for n in drift.NAMES}
    own = float(drift.drift(np.array([-g, 0.0, 0.0]), static))
    precession = Polynomial([own, torquer, torquer * k2, torquer * k3])  # omega of a current
    plus, minus = (np.pad(np.asarray(precession(i).coef, dtype=float) / k, (0, 4))[:4] for i in currents(p))
    mean, half = (plus + minus) / 2.0, (plus - minus) / 2.0
    values = (mean[0], mean[1] - 1.0, half[1], mean[2] * full, mean[3] * full**2)
    return dict(zip(NAMES, (float(v) for v in values), strict=True))
