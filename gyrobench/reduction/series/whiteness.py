"""Ljung-Box test with the degrees of freedom of the fitted model.

    LB = n(n + 2) sum_{k<=m} r_k^2/(n - k),   chi-squared of m - f, f coefficients fitted to the series (p + q of an
    ARMA)

[DRIFT-WHITENESS-LB; Xia 2008, eq. 3.4.13, 3.4.14 with EX15, EX16]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gyrobench.reduction.series.checks import SeriesError, checked


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
