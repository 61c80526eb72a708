"""A linear fit of averaged data, whose noise and set-up effects are estimated from the same data.

    fitted = fit(quantities, X, y, t_start, t_end, groups, "drift rate", "°/h", units.factor("deg/h"))
    fitted.f_test("harmonics 3 and higher", columns, ...)
    fitted.gain, fitted.value, fitted.u ...                    all in SI, in the order of ``found.quantities``

Groups are the phases of a plan: rows of the data that are drawn together, against an angle, a time or a number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import noise_mixture_fit, nuisances
from gyrobench.reduction.estimation.findings import Estimates, Findings, Group
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.regression import RegressionError
from gyrobench.reduction.setup.window_checks import ReductionError

IDEAL = 1e-6  # residuals over data, below which there is no noise


def fit(
    quantities: Sequence[Quantity | str], X: Array, y: Array, t_start: Array | None, t_end: Array | None,
    groups: Sequence[Group], y_name: str, y_unit: str, y_scale: float, *, noise: str = "estimated",
    weights: Array | None = None, limit: float = 1e3, candidates: Sequence[Candidate] = (), known: Array | None = None,
) -> Findings:  # fmt: skip
    """Least squares of ``y = X a + noise``: X (n, p), y (n,) in SI, means over windows [t_start, t_end] (s).

    quantities: one for each column; a name alone for an unknown that is only a step to a derived quantity.
    noise: "estimated" (white, Gauss-Markov or both, from the data; wants some tens of windows) or "white" (assumed;
    few readings; then ``weights`` (n,) may be given, and times may be None); "readings": estimated, of data that are
    differences of readings at t_start and t_end (angles over time).  limit: largest condition number.  candidates:
    set-up effects that may be in the data (gyrobench.reduction.estimation.nuisances); those that are follow the
    quantities.  known (m, n): errors of the set-up of one standard uncertainty each, independent, which are in the data
    beside the noise (known_errors).  Noise that is assumed, and data without noise, take neither.
    Raises ReductionError for data that cannot carry the model.
    """
    n = len(y)
    if t_start is None or t_end is None:
        t_start, t_end = np.arange(n, dtype=float), np.arange(n, dtype=float) + 1.0
    wanted = tuple(Quantity(q, "", "", 1.0) if isinstance(q, str) else q for q in quantities)
    names = [q.name for q in wanted]
    noisy = noise != "white" and not _noise_free(X, y)
    tested, known = (candidates, known) if noisy else ((), None)
    seen, hidden = nuisances.observable(X, names, tested, y)
    try:
        if noise == "white":
            est = noise_mixture_fit.ordinary(X, y, names, t_start, t_end, weights, limit)
        elif noise in ("estimated", "readings") and weights is None:
            est = noise_mixture_fit.fit(
                X, y, names, t_start, t_end, limit, noise == "readings", [c.block for c in seen], known
            )
        else:
            raise ValueError(f"noise '{noise}': 'estimated', 'readings', or 'white' with or without weights")
    except RegressionError as error:
        raise ReductionError(str(error)) from None
    joined = nuisances.reported(seen, est)
    wanted += tuple(Quantity(c.name, c.meaning, c.unit, c.scale) for c, _ in joined)
    return Findings(
        wanted, X, y, t_start, t_end, est, _reported(est, joined, X.shape[1]), list(groups), y_name, y_unit, y_scale,
        noise == "white", weights, candidates=seen, hidden=hidden, linear=wanted[: X.shape[1]], mode=noise, known=known,
    )  # fmt: skip


def without(found: Findings, error: Array, known: Array | None = None) -> Findings:
    """The same fit of the data less ``error`` (n,), with errors of known size (m, n) in their covariance."""
    weighed = [*found.candidates, *(h.candidate for h in found.hidden)]
    again = fit(
        found.linear, found.X, found.y - error, found.t_start, found.t_end, found.groups, found.y_name, found.y_unit,
        found.y_scale, noise=found.mode, weights=found.weights, limit=math.inf, candidates=weighed, known=known,
    )  # fmt: skip
    if found.function is None:
        return again
    return again.derive(found.quantities[: len(found.quantities) - len(found.joined)], found.function)


def _noise_free(X: Array, y: Array) -> bool:
    """True for simulated data without noise, whose remainder (the lag of a loop) no candidate is to explain."""
    if not (np.all(np.isfinite(X)) and np.all(np.isfinite(y))):
        return True  # the fit says what is wrong
    left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    return bool(np.linalg.norm(left) <= IDEAL * np.linalg.norm(y))


def _reported(
    est: noise_mixture_fit.Estimate, joined: Sequence[tuple[Candidate, noise_mixture_fit.Evidence]], p: int
) -> Estimates:
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
