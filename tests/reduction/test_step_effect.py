"""The communication step as a part of u: extrapolation, intervals, budget, correlation, words."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.sentences import told
from gyrobench.reduction.estimation.step_effect import step_effects, step_text, with_step
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.result import Coefficient, DriftTestResult, LoopResult, StepChange, StepCheck
from gyrobench.system.system import load_system

PLATFORM = "platform_single_axis"


def coefficient(estimate: float, u: float = 0.0, name: str = "m", unit: str = "1", **more: Any) -> Coefficient:
    half = NORMAL * u
    return Coefficient(name, "", unit, estimate, u, NORMAL, (estimate - half, estimate + half), **more)


def effect(law: Any, factor: float, unit: str = "1") -> float:
    (row,) = step_effects([coefficient(law(1.0), unit=unit)], [coefficient(law(factor), unit=unit)], factor)
    return float(row.change)


@pytest.mark.parametrize(("factor", "second"), [(0.5, 1.5), (2.0, 3.0)])
def test_first_order_is_exact_and_second_order_overstated(factor: float, second: float) -> None:
    """m = 7 + 0.3 h: m(1) - m(0) = 0.3.  m = 7 + 0.3 h2: (1 - p2)/(1 - p) = 1 + p times that."""
    assert effect(lambda h: 7.0 + 0.3 * h, factor) == pytest.approx(0.3)
    assert effect(lambda h: 7.0 + 0.3 * h * h, factor) == pytest.approx(0.3 * second)


def test_isolation_is_extrapolated_as_an_amplitude() -> None:
    """2.355e-4 at 0.1 ms, 0.813e-4 without a step, linear between: 9.24 dB; half the step alone shows 3.4 dB."""

    def law(h: float) -> float:
        return 20.0 * math.log10(0.813e-4 + (2.355e-4 - 0.813e-4) * h)

    assert law(1.0) - law(0.5) == pytest.approx(3.44, abs=0.01)
    assert effect(law, 0.5, "dB") == pytest.approx(9.24, abs=0.01)
    assert effect(law, 2.0, "dB") == pytest.approx(9.24, abs=0.01)
    assert effect(lambda h: -80.0 * h, 2.0, "dB") == pytest.approx(-5.93, abs=0.1)  # -20 lg(2 - 1e-4)
    assert effect(lambda h: -80.0 + 7.0 * h, 2.0, "dB") == pytest.approx(20.0)  # no amplitude is left: bounded


def loop_result(*coefficients: Coefficient) -> LoopResult:
    return LoopResult(method="", sources=[], conventions=[], coefficients=list(coefficients), responses=[])


def test_the_step_joins_u_interval_verdict_and_budget() -> None:
    """u = 0.3, effect 0.4 sqrt 3: u becomes 0.5; the pass of 10 below 10.8 (U = 0.588) ends inconclusive (U = 0.98)."""
    found, limits = loop_result(coefficient(10.0, 0.3, truth=9.0, z=1.0 / 0.3)), {"m": (None, 10.8)}
    assert conclude(found, None, limits).verdict == "pass"
    change = 0.4 * math.sqrt(3.0)
    check = StepCheck(1e-3, [StepChange("m", "1", change)], 2e-3)
    r = conclude(found, None, limits, check)
    c = r["m"]
    assert c.u == pytest.approx(0.5) and c.k * c.u == pytest.approx(NORMAL * 0.5)
    assert c.interval == pytest.approx((10.0 - 0.98, 10.0 + 0.98), abs=1e-4)
    assert (c.verdict, r.verdict) == ("inconclusive", "inconclusive") and c.z == pytest.approx(2.0)
    assert math.hypot(*(b.contribution for b in r.budget)) == pytest.approx(c.u)
    assert r.summary == []  # nothing was said before
    assert [b.source for b in r.budget] == ["noise and evaluation", "coupling step"]
    assert r.step_check.rows[0].ratio == pytest.approx(change / 0.3) == r.step_check.worst


@pytest.mark.parametrize(("change", "known"), [(-0.17, True), (-0.05, False), (0.174, False)])
def test_an_effect_that_the_linear_models_have_is_taken_out(change: float, known: bool) -> None:
    """f_c = 15.75 Hz, u = 0.003; the linear model has 15.752 with the step, 15.926 without: -0.174.  An effect of -0.17
    agrees: 15.75 + 0.174 = 15.924 with a rest of 0.004, closed form 15.926.  One of -0.05, or of the other sign, is
    another one: it stays in u, 0.05 / sqrt 3.
    """
    found = loop_result(coefficient(15.75, 0.003, "f_c", "Hz", closed=15.752, models=(15.752, 15.926)))
    r = with_step(found, StepCheck(1e-4, [StepChange("f_c", "Hz", change)], 2e-4))
    c, (row,) = r["f_c"], r.step_check.rows
    assert row.taken == pytest.approx(-0.174 if known else 0.0) and row.change == change
    assert c.estimate == pytest.approx(15.924 if known else 15.75) and c.closed == (15.926 if known else 15.752)
    left = 0.004 if known else abs(change)
    assert c.u == pytest.approx(math.hypot(0.003, left / math.sqrt(3.0))) and row.ratio == pytest.approx(left / 0.003)
    assert sum(c.interval) / 2.0 == pytest.approx(c.estimate)


def test_sentences_that_are_renewed_need_no_note() -> None:
    """u = 0.3 and a part of 0.4: the sentence has U = 0.98 as the table, and nothing is said of a missing effect."""
    r = loop_result(coefficient(10.0, 0.3))
    r = replace(r, summary=told(r.coefficients, "It is {m}."))
    check = StepCheck(1e-3, [StepChange("m", "1", 0.4 * math.sqrt(3.0))], 2e-3)
    r = conclude(r, None, None, check)
    assert r.summary == ["It is 10.00 ± 0.98 (95 %)."]


def test_the_warning_says_what_to_do() -> None:
    """Above u it speaks; an effect of a thousandth of the estimate is in u without a word."""
    rows = [StepChange("isolation", "dB", 3.2), StepChange("S", "N·m/rad", 5.0)]
    r = loop_result(coefficient(-72.56, 0.01, "isolation", "dB"), coefficient(16000.0, 0.1, "S", "N·m/rad"))
    r = with_step(r, StepCheck(1e-4, rows))
    (text,) = r.warnings
    assert text.startswith(
        "The communication step of 0.1 ms moves isolation by 3.2 dB (u without it 0.01 dB): more than"
    )
    assert text.endswith("run with --step 25us.") and "S by" not in text
    assert r["S"].u == pytest.approx(math.hypot(0.1, 5.0 / math.sqrt(3.0)))
    assert [step_text(x) for x in (5e-4, 2.5e-5, 1.0, 1e-2)] == ["0.5 ms", "25 us", "1 s", "10 ms"]


def test_the_covariance_of_a_drift_test_gets_the_signed_product() -> None:
    """Effects that only follow from one another: cov = C + s s^T, against numpy."""
    c = [coefficient(1.0, 0.2, "a"), coefficient(2.0, 0.3, "b")]
    r = DriftTestResult(
        method="", sources=[], conventions=[], coefficients=c, series=[], condition=1.0, rank=2,
        correlation=[[1.0, 0.5], [0.5, 1.0]], dof=1.0, noise={}, residual_std=0.0, residual_unit="1",
    )  # fmt: skip
    before = r.covariance()
    rows = [StepChange("a", "1", 0.6), StepChange("b", "1", -0.9)]
    r = with_step(r, StepCheck(1e-3, rows))
    s = np.array([0.6, -0.9]) / math.sqrt(3.0)
    np.testing.assert_allclose(r.covariance(), before + np.outer(s, s), rtol=1e-12)


# ------------------------------------------------------------------------------- through the product
@pytest.mark.long
def test_the_effect_stated_by_default_is_that_of_much_smaller_steps(command: Any, tmp_path: Any) -> None:
    """Against runs at h and h/4 of a plan, noise off, whose difference is 3/4 of the effect: within a fifth."""
    import json

    code, out, _ = command("run", PLATFORM, "--set", "hold=10s", "--out", tmp_path / "a", default_check=True)
    assert code == 0 and "step check (" in out and "the communication step of 0.5 ms moves" in out.lower()
    result = json.loads((tmp_path / "a" / "result.json").read_text())
    stated = {r["name"]: r["change"] for r in result["step_check"]["rows"]}
    with Session(PLATFORM) as session:
        system = load_system(PLATFORM)
        quiet = {
            **dict.fromkeys((n for n in system.noises if n.startswith(("gyro.", "rebalance."))), 0.0),
            "hold": 10.0,
        }
        runs = [{c.name: c for c in system.reduce(session.run(quiet, 1, h)).coefficients} for h in (5e-4, 1.25e-4)]
    u = {c["name"]: c["u"] for c in result["coefficients"]}
    taken = {r["name"]: r["taken"] for r in result["step_check"]["rows"]}
    assert [n for n, x in taken.items() if x] == ["f_c", "PM"]
    for name in ("peak", "load/peak", "PM", "rate error", "platform error"):
        true = (runs[0][name].estimate - runs[1][name].estimate) / 0.75
        assert stated[name] == pytest.approx(true, rel=0.3), name
        assert u[name] >= abs(true - taken[name]) / 2.0  # U covers what is left
    code, out, _ = command("report", tmp_path / "a", figures=False)
    again = json.loads((tmp_path / "a" / "result.json").read_text())
    assert again["step_check"] == result["step_check"] and again["coefficients"] == result["coefficients"]
    code, out, _ = command("run", PLATFORM, "--set", "hold=10s", "--out", tmp_path / "b")  # with --no-check-step
    assert code == 0 and "step check" not in out


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_effect_of_either_sign_has_its_share_of_the_variance(sign: float) -> None:
    """|c| u(x): the figure of the budget shows no bar for a contribution below 0, although it is in u."""
    r = loop_result(coefficient(10.0, 0.3))
    rows = [StepChange("m", "1", sign * 0.4 * math.sqrt(3.0))]
    r = with_step(r, StepCheck(1e-3, rows, 2e-3))
    assert [b.contribution for b in r.budget] == pytest.approx([0.3, 0.4])
    assert r.budget[1].sensitivity == pytest.approx(sign * 400.0)
