"""Moving-average and mixed models by maximum likelihood.

    x_t - m = sum phi_i (x_{t-i} - m) + e_t + sum theta_j e_{t-j}

as in statsmodels; Hu 1981 writes theta(B) = 1 - theta_1 B - .., minus these.  A Gauss-Markov drift with white reading
noise is ARMA(1,1): an AR(1) fitted to it has its coefficient too low.  The likelihood is that of statsmodels
(innovations algorithm), which gives no covariance with it: sigma^2 (J'J)^-1 with the derivatives J of the residuals.
Up to 10^5 values; longer records are to be averaged in blocks first.
[RED-ARMA; Hu 1981, eq. 4-113..4-126; Xia 2008, eq. 3.4.18]
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.autoregression import spectral_radius
from gyrobench.reduction.series.checks import SeriesError, checked

LONGEST = 100_000
FEWEST = 50  # values a coefficient
AT_THE_CIRCLE = 10.0  # over n: the distance at which maximum likelihood piles up if the root is on the circle


@dataclass(frozen=True)
class Arma:
    """A fitted model; ``u``, ``low``, ``high`` follow (phi, theta).

    theta has no u and no interval (NaN) where a root of it lies within 10/n of the circle: over-differenced.
    """

    phi: Array
    theta: Array
    u: Array
    low: Array
    high: Array
    variance: float  # of e
    residual: Array  # of the record, without the start that the first errors (taken as zero) still affect


def fit_arma(x: Any, p: int, q: int) -> Arma:
    """Fit a model of orders ``p`` and ``q`` with a mean to ``x`` (n,).

    Raises SeriesError for p + q < 1, fewer than 50 max(p, q) values, more than 10^5, and a fit on the circle.
    """
    from statsmodels.tsa.arima.model import ARIMA

    if p < 0 or q < 0 or p + q < 1:
        raise SeriesError(f"ARMA({p},{q}): orders are 0, 1, 2, ..., one of them above 0")
    x = checked(x, FEWEST * max(p, q))
    if x.size > LONGEST:
        raise SeriesError(f"ARMA({p},{q}) of {x.size} values: at most {LONGEST}; average blocks first")
    scale = float(x.std())
    y = (x - x.mean()) / scale
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a start outside the region is replaced, and the result is judged below
        model = ARIMA(y, order=(p, 0, q), trend="c")
        fit = model.fit(method="innovations_mle", low_memory=True, cov_type="none")
    mean, variance = float(fit.params[0]), float(fit.params[-1])
    phi, theta = np.split(np.asarray(fit.params[1:-1]), [p])
    if spectral_radius(phi) >= 1.0:
        raise SeriesError(f"ARMA({p},{q}): the fit is not stationary; difference first, or remove the trend")
    radius = spectral_radius(-theta)
    ar, ma = np.concatenate([[1.0], -phi]), np.concatenate([[1.0], theta])
    e = signal.lfilter(ar, ma, y - mean)
    settled = min(x.size // 4, max(p, q) + int(7.0 / max(1.0 - radius, 1e-6)) if q else p)
    columns = [signal.lfilter([1.0], ma, np.concatenate([np.zeros(i), (y - mean)[:-i]])) for i in range(1, p + 1)]
    columns += [signal.lfilter([1.0], ma, np.concatenate([np.zeros(j), e[:-j]])) for j in range(1, q + 1)]
    J = np.column_stack(columns)[settled:]
    R = np.linalg.qr(J, mode="r")
    if np.linalg.cond(R) < 1e12:
        u = np.linalg.norm(np.linalg.inv(R), axis=1) * math.sqrt(variance * J.shape[0] / x.size)
    else:  # a root of phi is one of theta: of white noise any such pair fits
        u = np.full(p + q, math.inf)
    value = np.concatenate([phi, theta])
    if 1.0 - radius <= AT_THE_CIRCLE / x.size:
        u = np.where(np.arange(p + q) < p, u, math.nan)
    return Arma(phi, theta, u, value - NORMAL * u, value + NORMAL * u, variance * scale**2, e[settled:] * scale)
