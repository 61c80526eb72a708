"""Tables of the time-series model of a drift record: stationarity, distribution, autoregression, whiteness."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.reduction.series.autoregression import Autoregression
from gyrobench.reduction.series.channel_units import ChannelUnits
from gyrobench.reduction.series.drift_model import DriftModel
from gyrobench.reduction.series.stationarity import RunsTest
from gyrobench.reduction.toolkit import Table, plain

from .noise_tables import number

SUBSCRIPT = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
RAN = {"runs": "runs of block statistics", "up_down": "runs up and down", "trend": "trend", "unit_root": "unit root",
       "normality": "normality"}  # fmt: skip


def stationarity(m: DriftModel, units: ChannelUnits) -> Table:
    """Return the tests of stationarity and of the distribution; those that cannot be made say why."""
    rows: list[list[Any]] = [[f"runs of {t.statistic}", t.z, t.p, _runs_word(t)] for t in m.runs or ()]
    if m.up_down:
        rows.append(["runs up and down of block means", m.up_down.z, m.up_down.p, _runs_word(m.up_down)])
    if (t := m.trend) is not None:
        unit, si, _ = units.terms["R"]
        size, u = t.slope / si, t.u / si
        word = "differs from zero" if t.significant else "not distinguishable from zero"
        rows.append(["trend", t.slope / t.u if t.u else None, t.p,
                     f"{number(size, u)} {unit}, u = {number(u, u)} {unit}: {word}"])  # fmt: skip
    if (r := m.unit_root) is not None:
        rows += [["augmented Dickey-Fuller", r.adf, r.p_adf, r.reading], ["KPSS", r.kpss, r.p_kpss, r.reading]]
    if (n := m.normality) is not None:
        word = "not decided: too few independent values"
        if n.decided:
            word = "not normal" if n.p < 0.05 else "compatible with a normal distribution"
        rows += [
            [f"skewness {number(n.skewness)}", n.z[0], None, "z, corrected for correlation"],
            [f"excess kurtosis {number(n.kurtosis)}", n.z[1], None, "z, corrected for correlation"],
            [f"excess kurtosis in blocks of {n.block}: {number(n.block_kurtosis)}", n.z_block, None,
             "differs from that of the record where the noise level varies"],
            ["Jarque-Bera", n.jarque_bera, None if math.isnan(n.p) else n.p, word],
        ]  # fmt: skip
    rows += [[what, None, None, m.refused[key]] for key, what in RAN.items() if key in m.refused]
    caption = (
        "Of the longest stretch without its lines. Runs test the independence of blocks, not stationarity; a small p "
        "of Dickey-Fuller is evidence for a constant level, of KPSS against it"
    )
    return Table("stationarity", "Stationarity and distribution", caption, ["test", "statistic", "p", "finding"], rows)


def _runs_word(t: RunsTest) -> str:
    if t.independent:
        return f"{t.runs} runs, as of independent blocks"
    return f"{t.runs} runs, {'too few: slow variation' if t.z < 0.0 else 'too many: alternation'}"


def models(m: DriftModel, units: ChannelUnits) -> list[Table]:
    """Return orders, coefficients and whiteness of the models of the block means."""
    tables = []
    if m.orders is not None:
        o, chosen = m.orders, m.orders.chosen
        rows = [[int(p), float(o.variance[k]) / units.si**2, *(float(v[k] - np.min(v)) for v in (o.aic, o.sbc)),
                 float(o.fpe[k] / np.min(o.fpe)), ", ".join(n.upper() for n, c in chosen.items() if c == p)]
                for k, p in enumerate(o.order)]  # fmt: skip
        head = [
            "order",
            f"innovation variance / ({units.unit})²",
            "AIC − least",
            "SBC − least",
            "FPE over least",
            "least",
        ]
        tables.append(
            Table("orders", "Order of the autoregression", f"Burg, of means over {plain(m.model_dt, 4)} s", head, rows)
        )
    if m.burg is not None:
        walker = m.yule_walker if m.yule_walker is not None else np.full(m.burg.phi.size, np.nan)
        rows = [[*row, float(w), -row[1]] for row, w in zip(_coefficients(m.burg), walker, strict=True)]
        caption = (
            "x(t) = φ₁ x(t−1) + ... + w(t), by Burg with 95 % intervals, and by Yule-Walker; a = −φ is what arburg "
            "prints: a table of a read as φ gives another, often explosive model"
        )
        head = ["coefficient", "Burg", "u", "95 % from", "95 % to", "Yule-Walker", "a (arburg)"]
        tables.append(
            Table("autoregression", f"Autoregression of order {m.burg.phi.size}, by SBC", caption, head, rows)
        )
    rows = []
    if (a := m.ma) is not None:  # one difference too many has no interval
        rows.append(["MA(1)", "θ₁", *(None if math.isnan(v) else float(v) for v in (a.theta[0], a.u[0], a.low[0],
                                                                                  a.high[0]))])  # fmt: skip
    if (a := m.arma) is not None:
        rows += [["ARMA(1,1)", n, float(v), float(u), float(lo), float(hi)] for n, v, u, lo, hi in
                 zip(("φ₁", "θ₁"), [*a.phi, *a.theta], a.u, a.low, a.high, strict=True)]  # fmt: skip
    if m.arima is not None:
        rows += [["ARIMA(3,1,0)", *row] for row in _coefficients(m.arima.ar)]
    if rows:
        head = ["model", "coefficient", "estimate", "u", "95 % from", "95 % to"]
        tables.append(
            Table(
                "other_models",
                "Other models",
                "ARMA: x(t) = φ₁ x(t−1) + e(t) + θ₁ e(t−1), MA without φ₁ (θ in Hu 1981 has the other sign); ARIMA: of "
                "differences",
                head,
                rows,
            )
        )
    if m.whiteness:
        names = {"block means": "none: the means themselves", "burg": "AR, Burg", "arma": "ARMA(1,1)"}
        rows = [[names.get(n, n), w.lags, w.dof, w.q, w.p, "white" if w.white else "not white"]
                for n, w in m.whiteness.items()]  # fmt: skip
        caption = "Ljung-Box test of the residuals, degrees of freedom less the fitted coefficients"
        tables.append(
            Table("whiteness", "Whiteness", caption, ["model", "lags", "dof", "statistic", "p", "finding"], rows)
        )
    return tables


def _coefficients(ar: Autoregression) -> list[list[Any]]:
    return [[f"φ{str(k + 1).translate(SUBSCRIPT)}", *(float(v[k]) for v in (ar.phi, ar.u, ar.low, ar.high))]
            for k in range(ar.phi.size)]  # fmt: skip


def model_texts(m: DriftModel, units: ChannelUnits) -> list[str]:
    """Return what to use, and what the record cannot show."""
    out = [f"Recommended: {m.recommended}.", *m.sentences]
    if (g := m.gauss_markov) is not None and g.determined:
        high = "not bounded" if math.isinf(g.high) else f"{number(g.high)} s"
        out.append(f"As a Gauss-Markov drift: correlation time {number(g.tau)} s (95 %: {number(g.low)} s to {high}), "
                   f"rms {number(g.sigma / units.si)} {units.unit}.")  # fmt: skip
    if (a := m.arima) is not None and a.over.flagged:
        out.append(
            "ARIMA(3,1,0): the first difference is over-differenced (correlation of neighbours "
            f"{number(a.over.lag_one)}); differenced white noise has −0.75, −0.5, −0.25, which say nothing of the "
            "instrument."
        )
    if (a := m.arima) is not None and a.level.determined:
        level = a.level
        out.append(
            f"Local level: N = {number(level.white_density / units.density_si)} {units.density}, K = "
            f"{number(level.walk_density / units.terms['K'][1])} {units.terms['K'][0]}."
        )
    return out + [f"{what}: {why}" for what, why in m.refused.items() if what not in RAN]
