"""Order of an autoregressive model by three criteria together, and whiteness of what a model leaves.

    AIC = n ln s_p^2 + 2 (p + 1)     SBC = n ln s_p^2 + (p + 1) ln n     FPE = s_p^2 (n + p + 1)/(n - p - 1)

(FPE with estimated mean.)  AIC and FPE pick too high an order now and then, whatever the length; SBC finds the true
one of a long record.  A minimum at the highest order tried is no minimum: then the series is no short autoregression,
and ARMA(1,1), ARIMA(0,1,1) or a local level is to be tried.

    LB = n(n + 2) sum_{k<=m} r_k^2/(n - k),   chi-squared of m - f, f coefficients fitted to the series (p + q of an
    ARMA)

[DRIFT-ORDER, DRIFT-WHITENESS-LB; Xia 2008, eq. 3.4.13..3.4.17, table 3.4.2 with EX15, EX16]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked, checked_order


def criteria(variance: float, n: int, p: int) -> tuple[float, float, float]:
    """Return AIC, SBC, FPE of an autoregression of order ``p`` with this innovation variance on ``n`` values."""
    base = n * math.log(variance)
    return base + 2.0 * (p + 1), base + (p + 1) * math.log(n), variance * (n + p + 1.0) / (n - p - 1.0)


@dataclass(frozen=True)
class OrderTable:
    """Arrays over the orders 0..highest."""

    order: tuple[int, ...]
    variance: Array
    aic: Array
    sbc: Array
    fpe: Array

    @property
    def chosen(self) -> dict[str, int]:
        """Return the order of the least value of each criterion."""
        return {name: int(np.argmin(getattr(self, name))) for name in ("aic", "sbc", "fpe")}

    @property
    def at_limit(self) -> bool:
        """Return whether SBC is least at the highest order tried: no autoregression of these orders."""
        return self.chosen["sbc"] == self.order[-1]


def order_table(x: Any, highest: int = 12) -> OrderTable:
    """Return the criteria of Burg's models of orders 0..``highest``; raises SeriesError for highest >= n/3."""
    from statsmodels.tsa.stattools import pacf_burg

    x = checked(x)
    checked_order(highest, x.size)
    variance = np.asarray(pacf_burg(x, nlags=highest, demean=True)[1])
    table = np.array([criteria(float(v), x.size, p) for p, v in enumerate(variance)])
    return OrderTable(tuple(range(highest + 1)), variance, *table.T)


@dataclass(frozen=True)
class LjungBox:
    lags: int
    q: float
    dof: int
    p: float

    @property
    def white(self) -> bool:
        """Return whether whiteness is accepted at 5 %."""
        return self.p >= 0.05


def ljung_box(x: Any, lags: int, fitted: int = 0) -> LjungBox:
    """Test a series, or residuals of a model with ``fitted`` coefficients.  Raises SeriesError for lags <= fitted."""
    from statsmodels.stats.diagnostic import acorr_ljungbox

    x = checked(x, 4)
    if lags <= fitted:
        raise SeriesError(f"Ljung-Box over {lags} lags of residuals with {fitted} fitted coefficients: take more lags")
    q, p = acorr_ljungbox(x, lags=[lags], model_df=fitted).iloc[0]
    return LjungBox(lags, float(q), lags - fitted, float(p))
