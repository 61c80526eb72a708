"""What the scripts of coverage share: a run reduced with its options, and how many intervals hold the true value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats

from gyrobench.engine.session import Session
from gyrobench.result import Coefficient


def found(session: Session, values: Mapping[str, Any], seed: int) -> Sequence[Coefficient]:
    """Return the coefficients of a run; values: options, and parameters with a dot in their name."""
    record = session.run(values, seed=seed)
    options = {n: v for n, v in values.items() if "." not in n}
    coefficients: Sequence[Coefficient] = session.system.with_values(options).reduce(record).coefficients
    return coefficients


def stated(values: Mapping[str, Any], unstated: bool) -> dict[str, Any]:
    """Return the values of a run, unstated: without what is stated of the errors of its set-up."""
    return {n: 0.0 if unstated and n.startswith("u_") else v for n, v in values.items()}


class Held:
    """Of each measure, whether its 95 % intervals hold the truth, and its error over u, run by run."""

    def __init__(self) -> None:
        self.hits: dict[str, list[bool]] = {}
        self.z: dict[str, list[float]] = {}

    def count(self, name: str, c: Coefficient) -> None:
        """Count a coefficient that has a value and a known truth."""
        if c.truth is not None and not c.no_value:
            self.hits.setdefault(name, []).append(c.interval[0] <= c.truth <= c.interval[1])
            self.z.setdefault(name, []).append(c.z or 0.0)

    def show(self, width: int, wide: bool = False) -> int:
        """Print the share of each measure with its own 95 % interval; return in how many 0.95 is not, or is above.

        wide: intervals may hold the truth more often.
        """
        bad = 0
        for name, held in self.hits.items():
            k, n = sum(held), len(held)
            low, high = stats.beta.ppf(0.025, k, n - k + 1), stats.beta.ppf(0.975, k + 1, max(n - k, 1))
            bad += high < 0.95 or (low > 0.95 and not wide)
            rms = float(np.sqrt(np.mean(np.square(self.z[name]))))
            print(f"{name:<{width}}{k / n:.3f} of {n} ({low:.3f} to {high:.3f}), rms z {rms:.2f}", flush=True)
        return bad
