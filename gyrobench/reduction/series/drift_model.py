"""The time-series model of a whole record in one call.

    model = describe(x, dt)          # x (n,) evenly sampled without gaps, any unit; dt in s
    model.lines, .spectrum, .normality, .correlation                         full record, lines removed
    model.runs, .up_down, .trend, .unit_root                                 block means of the record without lines
    model.orders, .burg, .yule_walker, .arma, .ma, .arima, .gauss_markov     block means, significant trend removed too
    model.whiteness                                                          Ljung-Box of the residuals of each model
    model.recommended, model.sentences                                       what to use, and what the record cannot
    show

Block means: models have at most MODEL_SAMPLES values; of a longer record (or with ``model_dt``) they describe means
over ``model.factor`` samples, an interval of ``model.model_dt`` s, and faster correlation is not in them (the
spectrum has it).  Every part is a function of its own in this room; a part that the record does not allow is None with
the reason in ``refused``.  Samples count as means over ``dt`` (rates from angles, averaging converters), which matters
only where the correlation time is a few of them.  Intervals of the autoregression hold for its order as given.  A
record of 10^7 samples takes some 30 s, the fits of the models 10 s of it.
[DRIFT-STATS-RUNS, -TREND, DRIFT-DIFF, DRIFT-PERIODIC, DRIFT-NORMALITY, DRIFT-ACF-PACF, DRIFT-AR-YW, -BURG, RED-ARMA,
DRIFT-ARIMA310, DRIFT-ORDER, DRIFT-WHITENESS-LB]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.series import gauss_markov as markov
from gyrobench.reduction.series.arima import Arima310, arima310
from gyrobench.reduction.series.autoregression import Autoregression, fit_ar
from gyrobench.reduction.series.checks import SeriesError, block_means, checked, checked_step
from gyrobench.reduction.series.correlation import Correlation, correlation
from gyrobench.reduction.series.gauss_markov import GaussMarkov
from gyrobench.reduction.series.lines import Lines, find_lines
from gyrobench.reduction.series.moving_average import Arma, fit_arma
from gyrobench.reduction.series.normality import Normality, normality
from gyrobench.reduction.series.orders import OrderTable, order_table
from gyrobench.reduction.series.spectrum import Spectrum, spectrum
from gyrobench.reduction.series.stationarity import (
    RunsTest,
    Trend,
    UnitRoot,
    block_runs,
    trend,
    unit_root,
    up_down_runs,
)
from gyrobench.reduction.series.whiteness import LjungBox, ljung_box

T = TypeVar("T")
MODEL_SAMPLES = 10_000  # values the models are fitted to
RUN_BLOCKS = 200  # of the counts of runs, 40 at least
WHITENESS_LAGS = 20
FEWEST = 512  # samples


@dataclass(frozen=True)
class DriftModel:
    """What :func:`describe` finds; parts that the record does not allow are None, see ``refused``."""

    n: int
    dt: float  # s
    factor: int  # samples in a block of the models
    lines: Lines
    spectrum: Spectrum
    normality: Normality | None
    correlation: Correlation
    runs: tuple[RunsTest, RunsTest] | None  # block means, block variances
    up_down: RunsTest | None
    trend: Trend | None
    unit_root: UnitRoot | None
    detrended: bool  # a significant slope was taken off before the models
    orders: OrderTable | None
    burg: Autoregression | None  # of the order SBC chose, at least 1
    yule_walker: Autoregression | None
    arma: Arma | None  # ARMA(1,1): Gauss-Markov with white noise
    ma: Arma | None  # MA(1)
    arima: Arima310 | None
    gauss_markov: GaussMarkov | None
    whiteness: dict[str, LjungBox]  # "block means", "burg", "arma"
    recommended: str  # "white noise", "AR(p)", "ARMA(1,1)", "local level", "none"
    sentences: tuple[str, ...]
    refused: dict[str, str]  # name of a part -> reason

    @property
    def model_dt(self) -> float:
        return self.dt * self.factor


class _Parts:
    """Runs a part and keeps the reason where the record does not allow it."""

    def __init__(self) -> None:
        self.refused: dict[str, str] = {}

    def __call__(self, name: str, part: Callable[[], T]) -> T | None:
        try:
            return part()
        except (
            ValueError,
            np.linalg.LinAlgError,
        ) as error:  # of this room, or of statsmodels
            self.refused[name] = str(error)
            return None


def describe(
    x: Any, dt: float, model_dt: float | None = None, lags: int = 100, highest: int = 12, false_alarm: float = 1e-3
) -> DriftModel:
    """Analyse a record ``x`` (n,) sampled every ``dt`` s without gaps.

    model_dt: interval of the models, s (at least dt; default: as short as MODEL_SAMPLES allow).  lags: of the
    autocorrelation.  highest: order tried.  false_alarm: probability of finding a line in a record without.
    Raises SeriesError for fewer than 512 samples, gaps (NaN) and a constant record.
    """
    x, dt = checked(x, FEWEST, "record"), checked_step(dt)
    factor = -(-x.size // MODEL_SAMPLES) if model_dt is None else max(1, round(model_dt / dt))
    if x.size // factor < FEWEST // 4:
        raise SeriesError(f"model_dt = {model_dt} s leaves {x.size // factor} block means; {FEWEST // 4} are needed")
    part = _Parts()
    lines = find_lines(x, dt, false_alarm)
    clean = lines.residual
    whole = (
        spectrum(clean, dt), part("normality", lambda: normality(clean)),
        correlation(clean, dt, min(lags, x.size // 4)),
    )  # fmt: skip
    y, step = block_means(clean, factor), dt * factor
    block = max(2, y.size // RUN_BLOCKS)
    runs = part("runs", lambda: block_runs(y, block))
    up_down = part("up_down", lambda: up_down_runs(block_means(y, block)))
    slope = part("trend", lambda: trend(y, step))
    root = part("unit_root", lambda: unit_root(y))
    detrended = slope is not None and slope.significant
    if slope is not None and detrended:
        y = y - slope.slope * step * np.arange(y.size)
    table = part("orders", lambda: order_table(y, min(highest, (y.size - 1) // 3)))
    order = max(1, table.chosen["sbc"]) if table else 1
    burg = part("burg", lambda: fit_ar(y, step, order))
    walker = part("yule_walker", lambda: fit_ar(y, step, order, "yule-walker"))
    arma, ma = part("arma", lambda: fit_arma(y, 1, 1)), part("ma", lambda: fit_arma(y, 0, 1))
    arima, drift = (
        part("arima", lambda: arima310(y, step)),
        part("gauss_markov", lambda: markov.gauss_markov(y, step, means=True)),
    )
    whiteness = _whiteness(part, y, burg, arma)
    recommended, why = _recommend(whiteness, table, burg, arma, arima, root, drift)
    sentences = [*why, *_limits(x.size, factor, step, lines, drift, burg, whole[1], whiteness.get("arma"))]
    if detrended:
        sentences.append("The slope is significant; it was taken off before the models were fitted.")
    return DriftModel(
        x.size, dt, factor, lines, *whole, runs, up_down, slope, root, detrended, table, burg, walker, arma, ma, arima,
        drift, whiteness, recommended, tuple(sentences), part.refused,
    )  # fmt: skip


def _whiteness(part: _Parts, y: Array, burg: Autoregression | None, arma: Arma | None) -> dict[str, LjungBox]:
    residuals = [("block means", y, 0)]
    if burg is not None:
        residuals.append(("burg", burg.residual(y), burg.phi.size))
    if arma is not None:
        residuals.append(("arma", arma.residual, 2))
    out = {}
    for name, e, fitted in residuals:
        lags = max(WHITENESS_LAGS, fitted + 10)
        test = part(f"whiteness of {name}", functools.partial(ljung_box, e, lags, fitted))
        if test is not None:
            out[name] = test
    return out


def _recommend(
    white: dict[str, LjungBox], table: OrderTable | None, burg: Autoregression | None, arma: Arma | None,
    arima: Arima310 | None, root: UnitRoot | None, drift: GaussMarkov | None,
) -> tuple[str, list[str]]:  # fmt: skip
    """Return the simplest model whose residuals are white, and why."""

    def passes(name: str) -> bool:
        return name in white and white[name].white

    if passes("block means"):
        return "white noise", ["The block means are white (Ljung-Box)."]
    open_above = drift is not None and drift.determined and math.isinf(drift.high)
    walks = open_above or (root is not None and root.reading.startswith("random walk"))
    if walks and arima is not None and arima.level.determined:
        over = " The first difference is flagged as over-differenced." if arima.over.flagged else ""
        return "local level", [f"The level wanders: white noise over a random walk describes the record.{over}"]
    short = table is not None and not table.at_limit
    if burg is not None and short and passes("burg"):
        if arma is not None and passes("arma") and burg.phi.size > 2:
            return "ARMA(1,1)", [f"ARMA(1,1) leaves white residuals with 2 coefficients, AR needs {burg.phi.size}."]
        return f"AR({burg.phi.size})", [f"AR({burg.phi.size}) by SBC leaves white residuals."]
    if arma is not None and passes("arma"):
        return "ARMA(1,1)", ["ARMA(1,1), a Gauss-Markov drift with white noise, leaves white residuals."]
    reason = "SBC is least at the highest order tried" if table is not None and not short else "no residuals are white"
    if arima is not None and arima.level.determined:
        return "local level", [f"No stationary model fits ({reason}); a local level is the better description."]
    return "none", [f"No model of these kinds fits ({reason}): the record holds what they do not."]


def _limits(
    n: int, factor: int, step: float, lines: Lines, drift: GaussMarkov | None, burg: Autoregression | None,
    normal: Normality | None, mixed: LjungBox | None,
) -> list[str]:  # fmt: skip
    out = []
    if factor > 1:
        out.append(
            f"The models describe means over {factor} samples ({step:.4g} s): the record of {n} samples is longer than "
            f"the {MODEL_SAMPLES} values they are fitted to, or model_dt asked for it."
        )
    if not lines.complete:
        out.append(f"{len(lines.lines)} lines were removed; there may be more.")
    if moving := [line for line in lines.lines if not line.steady]:
        out.append(
            f"The line at {moving[0].frequency:.4g} Hz changes its frequency or amplitude during the record; only its "
            "steady part was removed."
        )
    if drift is not None and (limit := markov.check_length(drift)):
        out.append(f"Correlation time: {limit}.")
    elif drift is not None and mixed is not None and not mixed.white:
        out.append(
            "The residuals of ARMA(1,1) are not white: a Gauss-Markov drift with white noise does not describe the "
            "record, and its correlation time and interval are those of the nearest one."
        )
    if burg is not None and not burg.long_enough:
        out.append(
            f"The record has {burg.times:.3g} correlation times of the autoregression; its intervals need 20 and may "
            "not cover."
        )
    if normal is not None and not math.isfinite(normal.p):
        out.append(
            f"Normality is not decided: the correlated record is worth {min(normal.effective):.3g} independent values."
        )
    return out
