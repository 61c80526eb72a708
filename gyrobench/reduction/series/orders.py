"""Order of an autoregressive model by three criteria together.

    AIC = n ln s_p^2 + 2 (p + q + 1)     SBC = n ln s_p^2 + (p + q + 1) ln n     FPE = s_p^2 (n + p + 1)/(n - p - 1)

(FPE with estimated mean.)  AIC and FPE pick too high an order now and then, whatever the length; SBC finds the true
one of a long record.  A minimum at the highest order tried is no minimum: then the series is no short autoregression,
and ARMA(1,1), ARIMA(0,1,1) or a local level is to be tried.   [DRIFT-ORDER; Xia 2008, eq. 3.4.15..3.4.17, table
3.4.2]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series.checks import SeriesError, checked


def criteria(variance: float, n: int, p: int, q: int = 0) -> tuple[float, float, float]:
    """Return AIC, SBC, FPE of innovation variance ``variance`` on ``n`` values; FPE for q = 0 only, else NaN."""
    if not (variance > 0.0 and n > p + 1):
        raise SeriesError(f"order criteria: variance {variance:.4g} on {n} values with order {p}")
    base, k = n * math.log(variance), p + q + 1
    fpe = variance * (n + p + 1.0) / (n - p - 1.0) if q == 0 else math.nan
    return base + 2.0 * k, base + k * math.log(n), fpe


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
        """Order of the least value of each criterion."""
        return {name: int(np.argmin(getattr(self, name))) for name in ("aic", "sbc", "fpe")}

    @property
    def at_limit(self) -> bool:
        """SBC is least at the highest order tried: no autoregression of these orders."""
        return self.chosen["sbc"] == self.order[-1]


def order_table(x: Any, highest: int = 12) -> OrderTable:
    """Return the criteria of Burg's models of orders 0..``highest``; raises SeriesError for highest >= n/3."""
    from statsmodels.tsa.stattools import pacf_burg

    x = checked(x)
    n = x.size
    if highest < 1 or 3 * highest >= n:
        raise SeriesError(f"orders up to {highest} on {n} values: 1 to {max((n - 1) // 3, 0)} are possible")
    variance = np.asarray(pacf_burg(x, nlags=highest, demean=True)[1])
    table = np.array([criteria(float(v), n, p) for p, v in enumerate(variance)])
    return OrderTable(tuple(range(highest + 1)), variance, table[:, 0], table[:, 1], table[:, 2])
