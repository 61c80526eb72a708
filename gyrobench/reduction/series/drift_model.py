"""The time-series model of a whole record in one call.

    model = describe(x, dt)          # x (n,) evenly sampled without gaps, any unit; dt in s
    model.lines, .spectrum, .normality, .correlation                         full record, lines removed
    model.runs, .up_down, .trend, .unit_root                                 block means of the record without lines
    model.orders, .burg, .yule_walker, .arma, .ma, .arima, .gauss_markov     block means, significant trend removed too
    model.whiteness                                                          Ljung-Box of the residuals of each model
    model.recommended, model.sentences                                       what to use, and what the record cannot
    show

Block means: models have at most MODEL_SAMPLES values; of a longer record they describe means over ``model.factor``
samples, an interval of ``model.model_dt`` s, and faster correlation is not in them (the spectrum has it).  Every part
is a function of its own in this room; a part that the record does not allow is None with the reason in ``refused``.
Samples count as means over ``dt`` (rates from angles, averaging converters), which matters only where the correlation
time is a few of them.  Intervals of the autoregression hold for its order as given.  A record of 10^7 samples takes
some 30 s, the fits of the models 10 s of it.
[DRIFT-STATS-RUNS, -TREND, DRIFT-DIFF, DRIFT-PERIODIC, DRIFT-NORMALITY, DRIFT-ACF-PACF, DRIFT-AR-YW, -BURG, RED-ARMA,
DRIFT-ARIMA310, DRIFT-ORDER, DRIFT-WHITENESS-LB]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.series import gauss_markov as markov
from gyrobench.reduction.series import stationarity
from gyrobench.reduction.series.arima import Arima310, arima310
from gyrobench.reduction.series.autoregression import Autoregression, fit_ar, yule_walker
from gyrobench.reduction.series.checks import block_means, checked, checked_step
from gyrobench.reduction.series.correlation import Correlation, correlation
from gyrobench.reduction.series.gauss_markov import GaussMarkovEstimate
from gyrobench.reduction.series.lines import Lines, find_lines
from gyrobench.reduction.series.moving_average import Arma, fit_arma
from gyrobench.reduction.series.normality import Normality, normality
from gyrobench.reduction.series.orders import LjungBox, OrderTable, ljung_box, order_table
from gyrobench.reduction.series.spectrum import Spectrum, spectrum

T = TypeVar("T")
MODEL_SAMPLES = 10_000  # values the models are fitted to
RUN_BLOCKS = 200  # of the counts of runs, 40 at least
LAGS = 100  # of the autocorrelation
HIGHEST = 12  # order tried
WHITENESS_LAGS = 20
FEWEST = 512  # samples


@dataclass
class DriftModel:
    """Time-series model of a record, filled by :func:`describe`; parts that the record does not allow stay None."""

    n: int
    dt: float  # s
    factor: int  # samples in a block of the models
    lines: Lines
    spectrum: Spectrum
    correlation: Correlation
    normality: Normality | None = None
    runs: tuple[stationarity.RunsTest, stationarity.RunsTest] | None = None  # block means, block variances
    up_down: stationarity.RunsTest | None = None
    trend: stationarity.Trend | None = None
    unit_root: stationarity.UnitRoot | None = None
    detrended: bool = False  # a significant slope was taken off before the models
    orders: OrderTable | None = None
    burg: Autoregression | None = None  # of the order SBC chose, at least 1
    yule_walker: Array | None = None  # coefficients of the same order
    arma: Arma | None = None  # ARMA(1,1): Gauss-Markov with white noise
    ma: Arma | None = None  # MA(1)
    arima: Arima310 | None = None
    gauss_markov: GaussMarkovEstimate | None = None
    whiteness: dict[str, LjungBox] = field(default_factory=dict)  # "block means", "burg", "arma"
    recommended: str = "none"  # "white noise", "AR(p)", "ARMA(1,1)", "local level", "none"
    sentences: list[str] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)  # name of a part -> reason

    @property
    def model_dt(self) -> float:
        return self.dt * self.factor

    def part(self, name: str, find: Callable[[], T]) -> T | None:
        """Return what ``find`` returns; None, with the reason in ``refused``, where the record does not allow it."""
        try:
            return find()
        except (ValueError, np.linalg.LinAlgError) as error:  # of this room, or of statsmodels
            self.refused[name] = str(error)
            return None


def describe(x: Array, dt: float) -> DriftModel:
    """Analyse a record ``x`` (n,) sampled every ``dt`` s without gaps.

    Raises SeriesError for fewer than 512 samples, gaps (NaN) and a constant record.
    """
    x, dt = checked(x, FEWEST, "record"), checked_step(dt)
    factor = -(-x.size // MODEL_SAMPLES)
    lines = find_lines(x, dt)
    clean = lines.residual
    m = DriftModel(x.size, dt, factor, lines, spectrum(clean, dt), correlation(clean, dt, LAGS))
    m.normality = m.part("normality", lambda: normality(clean))
    y = block_means(clean, factor)
    _stationarity(m, y)
    if m.trend is not None and m.trend.significant:
        m.detrended = True
        y = y - m.trend.slope * m.model_dt * np.arange(y.size)
    _models(m, y)
    m.recommended, why = _recommend(m)
    m.sentences = [*why, *_limits(m)]
    if m.detrended:
        m.sentences.append("The slope is significant; it was taken off before the models were fitted.")
    return m


def _stationarity(m: DriftModel, y: Array) -> None:
    block = max(2, y.size // RUN_BLOCKS)
    m.runs = m.part("runs", lambda: stationarity.block_runs(y, block))
    m.up_down = m.part("up_down", lambda: stationarity.up_down_runs(block_means(y, block)))
    m.trend = m.part("trend", lambda: stationarity.trend(y, m.model_dt))
    m.unit_root = m.part("unit_root", lambda: stationarity.unit_root(y))


def _models(m: DriftModel, y: Array) -> None:
    m.orders = m.part("orders", lambda: order_table(y, HIGHEST))
    order = max(1, m.orders.chosen["sbc"]) if m.orders else 1
    m.burg = m.part("burg", lambda: fit_ar(y, order))
    m.yule_walker = m.part("yule_walker", lambda: yule_walker(y, order))
    m.arma, m.ma = m.part("arma", lambda: fit_arma(y, 1, 1)), m.part("ma", lambda: fit_arma(y, 0, 1))
    m.arima = m.part("arima", lambda: arima310(y, m.model_dt))
    m.gauss_markov = m.part("gauss_markov", lambda: markov.gauss_markov(y, m.model_dt, means=True))
    residuals = {"block means": (y, 0)}
    if m.burg is not None:
        residuals["burg"] = m.burg.residual(y), order
    if m.arma is not None:
        residuals["arma"] = m.arma.residual, 2
    for name, (e, fitted) in residuals.items():
        lags = max(WHITENESS_LAGS, fitted + 10)
        test = m.part(f"whiteness of {name}", functools.partial(ljung_box, e, lags, fitted))
        if test is not None:
            m.whiteness[name] = test


def _recommend(m: DriftModel) -> tuple[str, list[str]]:
    """Return the simplest model whose residuals are white, and why."""
    burg, level = m.burg, m.arima.level if m.arima is not None else None

    def passes(name: str) -> bool:
        return name in m.whiteness and m.whiteness[name].white

    if passes("block means"):
        return "white noise", ["The block means are white (Ljung-Box)."]
    drift, root = m.gauss_markov, m.unit_root
    open_above = drift is not None and drift.determined and math.isinf(drift.high)
    walks = open_above or (root is not None and root.reading.startswith("random walk"))
    if walks and m.arima is not None and m.arima.level.determined:
        over = " The first difference is flagged as over-differenced." if m.arima.over.flagged else ""
        return "local level", [f"The level wanders: white noise over a random walk describes the record.{over}"]
    short = m.orders is not None and not m.orders.at_limit
    if burg is not None and short and passes("burg"):
        if passes("arma") and burg.phi.size > 2:
            return "ARMA(1,1)", [f"ARMA(1,1) leaves white residuals with 2 coefficients, AR needs {burg.phi.size}."]
        return f"AR({burg.phi.size})", [f"AR({burg.phi.size}) by SBC leaves white residuals."]
    if passes("arma"):
        return "ARMA(1,1)", ["ARMA(1,1), a Gauss-Markov drift with white noise, leaves white residuals."]
    limited = m.orders is not None and not short
    reason = "SBC is least at the highest order tried" if limited else "no residuals are white"
    if level is not None and level.determined:
        return "local level", [f"No stationary model fits ({reason}); a local level is the better description."]
    return "none", [f"No model of these kinds fits ({reason}): the record holds what they do not."]


def _limits(m: DriftModel) -> list[str]:
    """Return what the record cannot show, as sentences."""
    out = []
    if m.factor > 1:
        out.append(
            f"The models describe means over {m.factor} samples ({plain(m.model_dt, 4)} s): the record of {m.n} "
            f"samples is longer than the {MODEL_SAMPLES} values they are fitted to."
        )
    if not m.lines.complete:
        out.append(f"{len(m.lines.lines)} lines were removed; there may be more.")
    if moving := [line for line in m.lines.lines if not line.steady]:
        out.append(
            f"The line at {plain(moving[0].frequency, 4)} Hz changes its frequency or amplitude during the record; "
            "only its steady part was removed."
        )
    if m.gauss_markov is not None and (limit := markov.check_length(m.gauss_markov)):
        out.append(f"Correlation time: {limit}.")
    elif m.gauss_markov is not None and "arma" in m.whiteness and not m.whiteness["arma"].white:
        out.append(
            "The residuals of ARMA(1,1) are not white: a Gauss-Markov drift with white noise does not describe the "
            "record, and its correlation time and interval are those of the nearest one."
        )
    if m.burg is not None and not m.burg.long_enough:
        out.append(
            f"The record has {plain(m.burg.times, 3)} correlation times of the autoregression; its intervals need 20 "
            "and may not cover."
        )
    if m.normality is not None and not math.isfinite(m.normality.p):
        worth = min(m.normality.effective)
        out.append(f"Normality is not decided: the correlated record is worth {plain(worth, 3)} independent values.")
    return out
