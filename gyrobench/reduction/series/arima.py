"""The model ARIMA(3,1,0) of Xia 2008 beside what such records are: a level that wanders under white noise.

    (1 - sum phi_i B^i)(1 - B) x_t = w_t                        ARIMA(3,1,0), for comparison with the source only
    x_t = l_t + v_t,  l_{t+1} = l_t + n_t,  var v = r, var n = q   local level = ARIMA(0,1,1), theta from q/r

Differencing white noise makes the coefficients a_k = (p + 1 - k)/(p + 1), which is the table of the source in every
order.  Where the difference is flagged as one too many, the local level is the model to use; q and r come from one
maximum-likelihood fit.  A model of the difference must not be fed with readings.  Lines nearly vanish from a
differenced series (their amplitude times 2 sin(pi f dt)) and stay in the series itself: they are removed before.
[DRIFT-ARIMA310, DRIFT-DIFF; Xia 2008, eq. 3.4.1, 3.4.18, table 3.4.2 with EX10, EX14, EX17, EX19]
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.reduction.series.autoregression import Autoregression, fit_ar
from gyrobench.reduction.series.checks import SeriesError, checked, checked_step
from gyrobench.reduction.series.moving_average import LONGEST, fit_arma

MOST_NEGATIVE = -0.45  # lag-one correlation from which on a series counts as over-differenced
NEAR_MINUS_ONE = 0.05  # of its moving-average coefficient


@dataclass(frozen=True)
class LocalLevel:
    """White noise over a random walk."""

    r: float  # variance of the white noise, unit^2
    q: float  # variance of the increment of the level, unit^2 per sample
    determined: bool  # the record shows a walk at all: q exceeds twice its standard uncertainty
    dt: float

    @property
    def white_density(self) -> float:
        """Return N of the white noise, unit sqrt(s) (two-sided density N^2)."""
        return math.sqrt(self.r * self.dt)

    @property
    def walk_density(self) -> float:
        """Return K of the random walk, unit/sqrt(s)."""
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
    (r, q), u_q = fit.params, math.sqrt(max(float(np.asarray(fit.cov_params())[1, 1]), 0.0))
    unit = scale * scale
    return LocalLevel(float(r) * unit, float(q) * unit, bool(q > 2.0 * u_q > 0.0 and math.isfinite(u_q)), dt)


@dataclass(frozen=True)
class OverDifferencing:
    """The two signs of one difference too many; white noise differenced has -1/2 and -1."""

    lag_one: float  # correlation
    ma: float  # coefficient theta of x_t = e_t + theta e_{t-1}, exact maximum likelihood

    @property
    def flagged(self) -> bool:
        return self.lag_one <= MOST_NEGATIVE or self.ma <= -1.0 + NEAR_MINUS_ONE


def over_differencing(x: Any) -> OverDifferencing:
    """Return lag-one correlation and moving-average coefficient of a (differenced) series."""
    x = checked(x, 50)
    y = x - x.mean()
    return OverDifferencing(float(y[1:] @ y[:-1] / (y @ y)), float(fit_arma(x, 0, 1).theta[0]))


@dataclass(frozen=True)
class Arima310:
    """The source's model of a record, the flag on it, and the local level of the same record."""

    ar: Autoregression  # of the first difference
    over: OverDifferencing
    level: LocalLevel


def arima310(x: Any, dt: float) -> Arima310:
    """Fit both to ``x`` (n,); lines must be removed before: differencing hides them."""
    step = np.diff(checked(x, 52))
    return Arima310(fit_ar(step, 3), over_differencing(step), fit_local_level(x, dt))
