"""A linear fit of averaged data, whose noise and set-up effects are estimated from the same data.

    found = Regression(quantities, X, y, t_start, t_end, groups).fit()
    found.f_test("harmonics 3 and higher", columns, ...)
    found.gain, found.value, found.u ...                    all in SI, in the order of ``found.quantities``

Groups are the phases of a plan: rows of the data that are drawn together, against an angle, a time or a number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise_mixture_fit, nuisances
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.noise_estimate import Evidence, NoiseEstimate
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.estimation.reported import Estimates, Group
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.units import DPH

IDEAL = 1e-6  # the lag of a simulated loop


@dataclass(frozen=True)
class Regression:
    """Data of a test and their linear model ``y = X a + noise``: means over windows [t_start, t_end] (s), SI.

    quantities: one for each column of X (n, p); a name alone for an unknown that is only a step to a derived quantity.
    y_name, y_unit, y_scale: of the data, as printed.  noise: "estimated" (white, Gauss-Markov or both, from the data;
    wants some tens of windows) or "white" (assumed; few readings; then ``weights`` (n,) may be given, and times may be
    None); "readings": estimated, of data that are differences of readings at t_start and t_end (angles over time).
    limit: largest condition number.  candidates: set-up effects that may be in the data (nuisances); those that are
    follow the quantities.  ideal: residuals over data, below which there is no noise.
    """

    quantities: Sequence[Quantity | str]
    X: Array
    y: Array
    t_start: Array | None
    t_end: Array | None
    groups: Sequence[Group] = ()
    y_name: str = "drift rate"
    y_unit: str = "°/h"
    y_scale: float = DPH
    noise: str = "estimated"
    weights: Array | None = None
    limit: float = 1e3
    candidates: Sequence[Candidate] = ()
    ideal: float = IDEAL

    def rows(self, keep: NDArray[np.bool_]) -> Regression:
        """Return the regression of some rows; it has no figures, and its condition has been looked at."""
        t_start, t_end = (None if t is None else t[keep] for t in (self.t_start, self.t_end))
        candidates = [replace(c, columns=np.asarray(c.columns)[keep]) for c in self.candidates]
        weights = None if self.weights is None else self.weights[keep]
        return replace(
            self, X=self.X[keep], y=self.y[keep], t_start=t_start, t_end=t_end, weights=weights,
            candidates=candidates, groups=(), limit=math.inf,
        )  # fmt: skip

    def fit(self, known: Array | None = None) -> Findings:
        """Return the fit.  known (m, n): errors of the set-up of one standard uncertainty each, independent, which are
        in the data beside the noise (known_errors).

        Noise that is assumed, and data without noise, take neither candidates nor known errors.  Raises ReductionError
        for data that cannot carry the model.
        """
        X, y, n = self.X, self.y, len(self.y)
        t0, t1 = self.t_start, self.t_end
        if t0 is None or t1 is None:
            t0, t1 = np.arange(n, dtype=float), np.arange(n, dtype=float) + 1.0
        wanted = tuple(Quantity(q, "", "", 1.0) if isinstance(q, str) else q for q in self.quantities)
        names = [q.name for q in wanted]
        noisy = self.noise != "white" and not _noise_free(X, y, self.ideal)
        tested, known = (self.candidates, known) if noisy else ((), None)
        seen, hidden = nuisances.observable(X, names, tested, y)
        if self.noise not in ("white", "estimated", "readings") or (self.noise != "white" and self.weights is not None):
            raise ValueError(f"noise '{self.noise}': 'estimated', 'readings', or 'white' with or without weights")
        try:
            if self.noise == "white":
                est = noise_mixture_fit.ordinary(X, y, names, t0, t1, self.weights, self.limit)
            else:
                blocks = [c.block for c in seen]
                est = noise_mixture_fit.fit(X, y, names, t0, t1, self.limit, self.noise == "readings", blocks, known)
        except RegressionError as error:
            raise ReductionError(str(error)) from None
        joined = nuisances.reported(seen, est)
        wanted += tuple(Quantity(c.name, c.meaning, c.unit, c.scale) for c, _ in joined)
        data = replace(self, t_start=t0, t_end=t1)
        return Findings(data, wanted, est, _reported(est, joined, X.shape[1]), seen, hidden, known=known)


def fit(*data: Any, known: Array | None = None, **more: Any) -> Findings:
    """Return the fit of a :class:`Regression` of these fields."""
    return Regression(*data, **more).fit(known)


def without(found: Findings, error: Array, known: Array | None = None) -> Findings:
    """Return the same fit of the data less ``error`` (n,), with errors of known size (m, n) in their covariance."""
    weighed = [*found.candidates, *(h.candidate for h in found.hidden)]
    data = replace(found.data, y=found.y - error, limit=math.inf, candidates=weighed)
    return found.reported_alike(data.fit(known))


def _noise_free(X: Array, y: Array, ideal: float) -> bool:
    """True for simulated data without noise, whose remainder (the lag of a loop) no candidate is to explain."""
    if not (np.all(np.isfinite(X)) and np.all(np.isfinite(y))):
        return True  # the fit says what is wrong
    left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return bool(np.linalg.norm(left) <= ideal * np.linalg.norm(y))


def _reported(est: NoiseEstimate, joined: Sequence[tuple[Candidate, Evidence]], p: int) -> Estimates:
    """The p coefficients, then each effect that joined: its constant, or the standard deviation of its constants."""
    rows, spread, at = list(range(p)), {}, p
    for c, e in joined:
        if c.scatter:
            spread[len(rows)] = e
        rows.append(at)
        at += e.value.size
    value, u, half, probability, dof, gain = (
        np.array(v[rows]) for v in (est.beta, est.u, est.half_width, est.p, est.dof, est.gain)
    )
    covariance = np.array(est.covariance[np.ix_(rows, rows)])
    for j, e in spread.items():
        mean, sd, low, high = e.scatter
        value[j], u[j], half[j], probability[j], dof[j] = (
            mean,
            sd,
            max(high - mean, mean - low),
            1 - e.probability,
            np.inf,
        )
        covariance[j], covariance[:, j], gain[j] = 0.0, 0.0, 0.0
        covariance[j, j] = sd**2
    return Estimates(value, covariance, u, half, probability, dof, gain)
