"""Table of noise coefficients of a long test: stretches, gaps, units, and when there is none."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.series.noise_coefficients_table import ENDS, LEAST, RESIDUAL, noise_coefficients_table, on_grid
from gyrobench.report.language import Language, catalogue

T = 60.0  # s
N = 0.6  # deg/h/sqrt(Hz): 0.01 deg/sqrt(h)


def long_test(count: int = LEAST, gap: bool = False, length: float = T) -> tuple[Any, Any]:
    """Return a result of two series and its record: white noise, in y on a slope, in the residuals alone."""
    rng = np.random.default_rng(2)
    series, start = [], []
    for k in range(2):
        t = T * np.arange(count // 2) + 1e5 * k
        if gap:
            t = np.delete(t, [20, 21, 90])
        x = N / math.sqrt(T) * rng.normal(size=t.size)
        y = x + 1e-4 * t
        order = rng.permutation(t.size)  # a report has them by table angle
        series.append(SimpleNamespace(t=t[order].tolist(), residual=x[order].tolist(), y=y[order].tolist()))
        start.append(t - T / 2.0)
    windows = {"t_start": np.concatenate(start), "t_end": np.concatenate(start) + length}
    return SimpleNamespace(series=series), SimpleNamespace(windows=windows)


@pytest.mark.parametrize("gap", [False, True])
def test_residuals_and_the_rate_itself(gap: bool) -> None:
    """White noise of 0.01 deg/sqrt(h); the slope of 1e-4 deg/h/s = 0.36 deg/h2 is the ramp of the rate alone."""
    result, record = long_test(LEAST + 100, gap)
    (left,) = noise_coefficients_table(result, record, residual=True)
    (whole,) = noise_coefficients_table(result, record)
    assert RESIDUAL in left.caption and RESIDUAL not in whole.caption
    assert f"from {LEAST + 94 if gap else LEAST + 100} means of 60 s" in left.caption
    for table in (left, whole):
        rows = {row[0].partition(",")[0]: row for row in table.rows}
        assert list(rows) == [n for n in "NBKRQ" if n != "R" or table is whole]
        assert rows["N"][1] == pytest.approx(0.01, rel=0.15) and rows["N"][2] < 0.01 < rows["N"][3]
        for name in "BK":  # the fit may have taken some
            assert (rows[name][3] is None) == (table is left)
        if table is whole:
            assert rows["R"][2] < rows["R"][1] < rows["R"][3] and rows["R"][2] < 0.36 < rows["R"][3]
        assert rows["K"][1] is None and rows["K"][2] == 0.0 and "not determined" in rows["K"][5]


def test_short_tests_and_windows_with_pauses_have_none() -> None:
    assert noise_coefficients_table(*long_test(LEAST - 2)) == []
    assert noise_coefficients_table(*long_test(LEAST, length=0.5 * T)) == []
    assert noise_coefficients_table(*long_test(LEAST)) != []


def test_gauss_markov_drift_is_told() -> None:
    """Of 1 deg/h and 8 windows, 480 s, under white noise of 1 deg/h: a process, no flicker and no walk; of residuals
    it may be larger.
    """
    rng = np.random.default_rng(1)
    result, record = long_test(2000)
    a = math.exp(-1.0 / 8.0)
    for s in result.series:
        x = rng.normal(size=len(s.t))
        for k in range(1, x.size):
            x[k] = a * x[k - 1] + math.sqrt(1.0 - a * a) * x[k]
        x += rng.normal(size=x.size)
        s.y = s.residual = x[np.argsort(np.argsort(s.t))].tolist()
    for residual in (False, True):
        (table,) = noise_coefficients_table(result, record, residual)
        rows = {row[0]: row for row in table.rows}
        for name, true in (("σ, Gauss-Markov drift", 1.0), ("τ, Gauss-Markov drift", 480.0)):
            assert rows[name][2] < true and rows[name][1] == pytest.approx(true, rel=0.4)
            assert rows[name][3] is None if residual else rows[name][3] > true
        assert [row[5] for row in table.rows if row[0].startswith(("B", "K"))] == ["not determined"] * 2


def test_what_is_taken_out_and_what_no_model_describes_is_told() -> None:
    """A wild value of 30 times the noise; each value held for five windows, as of a slower record."""
    result, record = long_test(1000)
    result.series[0].y[7] += 30.0 * N / math.sqrt(T)
    (table,) = noise_coefficients_table(result, record)
    assert table.caption.endswith("; taken out before: 1 wild value")
    words = Language(catalogue("zh"))
    assert words.find(table.caption) and words.find("; taken out before: 2 lines, 1 step or slow change")
    result, record = long_test(4200)
    for s in result.series:
        order = np.argsort(s.t)
        s.y = np.repeat(np.array(s.y)[order][::5], 5)[np.argsort(order)].tolist()
    (table,) = noise_coefficients_table(result, record)
    assert table.caption.startswith("The noise model does not describe the record, so that no coefficient is stated.")
    assert [row[1:4] + row[5:] for row in table.rows] == [[None, None, None, "not determined"]] * 5


def test_a_level_that_jumps_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def jumping(rate: np.ndarray, tau0: float) -> NoiseModel:
        found = fit_noise(rate, tau0)
        return replace(found, treatment=replace(found.treatment, jumps=True))

    monkeypatch.setattr("gyrobench.reduction.series.noise_coefficients_table.fit_noise", jumping)
    (table,) = noise_coefficients_table(*long_test())
    assert table.caption.endswith("; the level jumps as part of the noise")


def test_a_missing_window_is_a_gap() -> None:
    """Times 0, 10, 40, 50: two values are missing; 54 is no multiple of 10 later, and a stretch of its own."""
    x = on_grid(np.array([50.0, 0.0, 40.0, 10.0]), np.array([4.0, 1.0, 3.0, 2.0]), 10.0)
    assert np.array_equal(x, [1.0, 2.0, math.nan, math.nan, 3.0, 4.0], equal_nan=True)
    x = on_grid(np.array([0.0, 10.0, 14.0]), np.ones(3), 10.0)
    assert np.flatnonzero(np.isfinite(x)).tolist() == [0, 1, 1 + ENDS]
