"""The model ARIMA(3,1,0) of Xia 2008 beside what such records are: a level that wanders under white noise.

    (1 - sum phi_i B^i)(1 - B) x_t = w_t                        ARIMA(3,1,0), for comparison with the source only
    x_t = l_t + v_t,  l_{t+1} = l_t + n_t,  var v = r, var n = q   local level = ARIMA(0,1,1), theta from q/r

Differencing white noise makes the coefficients a_k = (p + 1 - k)/(p + 1), which is the table of the source in every
order (:func:`differenced_white`).  Where the difference is flagged as one too many, the local level is the model to
use; q and r come from one maximum-likelihood fit.  A model of the difference must not be fed with readings.
[DRIFT-ARIMA310; Xia 2008, eq. 3.4.18, table 3.4.2 with EX14, EX17, EX19]
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.autoregression import Autoregression, fit_ar
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step
from gyrobench.reduction.series.differencing import OverDifferencing, over_differencing

LONGEST = 100_000


def differenced_white(order: int, variance: float = 1.0) -> tuple[Array, float]:
    """Return phi of ``order`` and the innovation variance of differenced white noise, -(p + 1 - k)/(p + 1)."""
    if order < 1:
        raise SeriesError(f"order {order}: it must be at least 1")
    k = np.arange(1.0, order + 1.0)
    phi: Array = -(order + 1.0 - k) / (order + 1.0)
    return phi, variance * (order + 2.0) / (order + 1.0)


@dataclass(frozen=True)
class LocalLevel:
    """White noise over a random walk; intervals of 95 %, symmetric in the logarithm."""

    r: float  # variance of the white noise, unit^2
    r_low: float
    r_high: float
    q: float  # variance of the increment of the level, unit^2 per sample
    q_low: float
    q_high: float  # NaN where q is not determined
    n: int
    dt: float

    @property
    def determined(self) -> bool:
        """Whether the record shows a walk at all."""
        return math.isfinite(self.q_high)

    @property
    def white_density(self) -> float:
        """N of the white noise, unit sqrt(s) (two-sided density N^2)."""
        return math.sqrt(self.r * self.dt)

    @property
    def walk_density(self) -> float:
        """K of the random walk, unit/sqrt(s)."""
        return math.sqrt(self.q / self.dt)


def fit_local_level(x: Any, dt: float) -> LocalLevel:
    """Fit a local level to ``x`` (n,), at most 10^5 values, by maximum likelihood (diffuse start of the level)."""
    from statsmodels.tsa.statespace.structural import UnobservedComponents

    x, dt = checked(x, 50), checked_step(dt)
    if x.size > LONGEST:
        raise SeriesError(f"local level of {x.size} values: at most {LONGEST}; average blocks first")
    scale = float(x.std())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance at zero is judged below
        fit = UnobservedComponents((x - x.mean()) / scale, "llevel").fit(disp=0)
    (r, q), cov = np.asarray(fit.params), np.asarray(fit.cov_params())
    widths = []
    for k, value in enumerate((r, q)):
        u = math.sqrt(max(float(cov[k, k]), 0.0))
        clear = value > 2.0 * u > 0.0 and math.isfinite(u)
        widths.append(math.exp(NORMAL * u / value) if clear else math.nan)
    unit = scale * scale
    r, q = float(r) * unit, float(q) * unit
    return LocalLevel(
        r, r / widths[0], r * widths[0], q, q / widths[1], q * widths[1], x.size, dt
    )  # fmt: skip


@dataclass(frozen=True)
class Arima310:
    """The source's model of a record, the flag on it, and the local level of the same record."""

    ar: Autoregression  # of the first difference
    over: OverDifferencing
    table_distance: float  # largest difference of phi from that of differenced white noise
    level: LocalLevel


def arima310(x: Any, dt: float) -> Arima310:
    """Fit both to ``x`` (n,); lines must be removed before: differencing hides them."""
    x = checked(x, 52)
    step = np.diff(x)
    ar = fit_ar(step, dt, 3)
    distance = float(np.abs(ar.phi - differenced_white(3)[0]).max())
    return Arima310(ar, over_differencing(step), distance, fit_local_level(x, dt))
