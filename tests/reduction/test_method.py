"""The way from a linear fit to a result, by a small user of it: a line with known truth."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from finding import effect, judged
from numpy.typing import NDArray
from scipy import stats

from gyrobench import units
from gyrobench.record.run_document import PlanRow, RunDocument
from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.merge_channels import merge
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.reported import Group
from gyrobench.reduction.estimation.sentences import plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.sources import Effect
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Reason, Result

Array = NDArray[np.float64]
DPH = units.factor("deg/h")
TRUTH = {"a": 0.3 * DPH, "b": -0.2 * DPH}  # rate = a + b x, x in 1


def line(n: int, sigma: float, seed: int = 1, noise: str = "white", channel: str = "") -> Findings:
    """n windows of 10 s, x from -1 to 1, noise of sigma deg/h."""
    x = np.linspace(-1.0, 1.0, n)
    X = np.column_stack([np.ones(n), x])
    y = X @ list(TRUTH.values()) + sigma * DPH * np.random.default_rng(seed).normal(size=n)
    t = 10.0 * np.arange(n)
    wanted = [
        Quantity.of(f"a{channel}", "constant", "deg/h", TRUTH["a"], float(y.mean())),
        Quantity.of(f"b{channel}", "slope", "deg/h", TRUTH["b"]),
    ]
    dense = np.linspace(-1.0, 1.0, 5)
    group = Group("line", np.arange(n), x, "position", "1", (dense, np.column_stack([np.ones(5), dense])))
    return fit(wanted, X, y, t, t + 10.0, [group], "rate", "°/h", DPH, noise=noise)


def test_white_line_by_hand() -> None:
    """y = (1, 2, 4) at x = (-1, 0, 1): a = 7/3, b = 3/2, residuals (1/6, -1/3, 1/6), s^2 = 1/6 with one degree of
    freedom, u(a)^2 = s^2/3 = 1/18, u(b)^2 = s^2/2 = 1/12; t quantile of one degree 12.7062.
    """
    x = np.array([-1.0, 0.0, 1.0])
    X, y = np.column_stack([np.ones(3), x]), np.array([1.0, 2.0, 4.0])
    group = Group("points", np.arange(3), x, "position", "1")
    wanted = [Quantity("a", "constant", "V", 1.0), Quantity("b", "slope", "mV", 1e-3)]
    r = judged(fit(wanted, X, y, None, None, [group], "voltage", "V", 1.0, noise="white"))
    a, b = r.coefficients
    assert (a.estimate, b.estimate) == pytest.approx((7 / 3, 1500.0))
    assert (a.u, b.u) == pytest.approx((math.sqrt(1 / 18), 1e3 * math.sqrt(1 / 12)))
    assert a.k == pytest.approx(12.7062, rel=1e-5) and a.dof == 1.0
    assert b.interval == pytest.approx((1500.0 - 12.7062 * b.u, 1500.0 + 12.7062 * b.u), rel=1e-5)
    assert r.series[0].residual == pytest.approx([1 / 6, -1 / 3, 1 / 6])
    assert r.residual_std == pytest.approx(math.sqrt(1 / 6))
    assert r.noise["model"] == "white (assumed)" and not r.simulated and r.allan is None
    assert Result.from_dict(r.as_dict()) == r


@pytest.mark.parametrize("noise", ["white", "estimated"])
def test_truth_and_closed(noise: str) -> None:
    r = judged(line(120, 0.01, noise=noise))
    assert r.simulated and r.rank == 2 and r.dof == 118.0
    for c in r.coefficients:
        assert c.truth == pytest.approx(0.3 if c.name == "a" else -0.2)
        assert c.z is not None and abs(c.z) < 4.0
    a = r.coefficients[0]
    assert a.closed == pytest.approx(a.estimate, abs=0.005) and r.coefficients[1].closed is None
    assert a.u == pytest.approx(0.01 / math.sqrt(120), rel=0.6 if noise == "estimated" else 0.2)
    assert [row[0] for row in r.tables[0].rows] == ["a"]
    assert r.series[0].shown_fit_y == pytest.approx([0.5, 0.4, 0.3, 0.2, 0.1], abs=0.01)
    assert ("whitened" in r.tests[1].name) == (noise == "estimated")
    assert r.allan.unit == "°/h" and r.psd.unit == "(°/h)²/Hz"


def test_effects_and_verdicts() -> None:
    """An error of all data by 0.1 deg/h per unit, of size 0.5, is 0.05 deg/h in a and nothing in b; a design whose
    second column is 1 % too small makes b 1 % too large.
    """
    found = line(60, 0.001)
    one = found.error(0.1 * DPH)
    small = found.error(dX=found.X * [0.0, 0.01])
    assert found.gain @ small == pytest.approx([0.0, -0.01 * found.value[1]], abs=1e-12 * DPH)
    effects = [effect("offset", 0.5, "1", one), effect("scale of x", 0.0, "1", small)]
    limits = {"a": (0.0, 1.0), "b": (-0.1, None)}
    r = judged(found, effects=effects, limits=limits, reasons=[Reason("step", "Mind the step.")])
    a, b = r.coefficients
    assert a.u == pytest.approx(math.hypot(0.05, a.u_a or 0.0)) and b.u == b.u_a
    assert a.interval[1] - a.interval[0] == pytest.approx(2 * 1.96 * 0.05, rel=1e-3)
    assert (a.verdict, b.verdict, r.verdict) == ("pass", "fail", "fail")
    lines = {(x.source, x.coefficient): x.contribution for x in r.budget}
    assert lines["offset", "a"] == pytest.approx(0.05)
    assert ("offset", "b") not in lines and ("scale of x", "b") not in lines
    assert r.warnings[-1] == "Mind the step." and plus_minus(a).endswith("°/h (95 %)")


def test_a_sentence_has_two_digits_of_the_uncertainty() -> None:
    """U = 1.96 u: 5839 is 5800, and the estimate is rounded to hundreds; 0.0023 has four decimals."""
    (c,) = [x for x in judged(line(60, 0.001)).coefficients if x.name == "a"]

    def said(estimate: float, u: float, unit: str) -> str:
        interval = (estimate - 1.96 * u, estimate + 1.96 * u)
        return plus_minus(replace(c, estimate=estimate, u=u, k=1.96, unit=unit, interval=interval))

    assert said(263087.4, 2979.0, "N·m/rad") == "263100 ± 5800 N·m/rad (95 %)"
    assert said(-0.30012, 0.00117, "°/h") == "−0.3001 ± 0.0023 °/h (95 %)"
    assert said(-0.4, 20.0, "°/h") == "0 ± 39 °/h (95 %)"  # not −0: U = 39.2


def test_merge_of_two_channels() -> None:
    x, y = line(60, 0.01, 1, channel="_x"), line(40, 0.02, 2, channel="_y")
    same = Reason("same", "same")
    parts = {"x channel": judged(x, reasons=[same]), "y channel": judged(y, reasons=[same, Reason("other", "other")])}
    r = merge(parts)
    assert [c.name for c in r.coefficients] == ["a_x", "b_x", "a_y", "b_y"]
    matrix = np.array(r.correlation)
    assert matrix.shape == (4, 4) and not np.any(matrix[:2, 2:]) and np.all(np.diag(matrix) == 1.0)
    assert (r.rank, r.dof) == (4, 96.0)
    pooled = (58 * x.residual_std**2 + 38 * y.residual_std**2) / 96
    assert r.residual_std == pytest.approx(math.sqrt(pooled))
    assert r.series[1].label == "y channel: line" and r.tests[0].name == "Ljung-Box, residuals, x channel"
    assert r.warnings == ["same", "y channel: other"] and r.conventions == ["x counts to the right."]
    assert r.noise["channel of autocorrelation, Allan deviation and spectrum"] == "y channel"
    assert r.acf == parts["y channel"].acf and r.equation == "y = a + b x"
    with pytest.raises(ValueError, match="a_x, b_x in more than one channel"):
        merge({"x": parts["x channel"], "z": replace(parts["x channel"])})


def test_an_error_that_channels_share_is_one() -> None:
    """The axis moves a_x by 0.3 and a_y by -0.4 together; each meter its own channel.  By hand: cov(a_x, a_y) = -0.12,
    so that u(0.8 a_x + 0.6 a_y) has nothing of the axis in it."""
    x, y = line(60, 0.01, 1, channel="_x"), line(40, 0.02, 2, channel="_y")

    def effects(found: Findings, size: float, own: str) -> list[Effect]:
        return [effect("axis", 1.0, "1", size * found.error(DPH)), effect(own, 0.1, "1", found.error(DPH))]

    parts = {"x channel": judged(x, effects=effects(x, 0.3, "meter x")),
             "y channel": judged(y, effects=effects(y, -0.4, "meter y"))}  # fmt: skip
    r = merge(parts)
    assert [b.source for b in r.type_b] == ["axis", "meter x", "meter y"]
    (axis,) = r.type_b[0].changes
    assert axis == pytest.approx([0.3, 0.0, -0.4, 0.0], abs=1e-12)
    covariance = r.covariance()
    assert covariance[0, 2] == pytest.approx(-0.12, rel=1e-9) and covariance[1, 3] == pytest.approx(0.0, abs=1e-15)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(r.array("u"))
    c = np.array([0.8, 0.0, 0.6, 0.0])
    own = 0.64 * ((r["a_x"].u_a or 0.0) ** 2 + 0.01) + 0.36 * ((r["a_y"].u_a or 0.0) ** 2 + 0.01)
    assert c @ covariance @ c == pytest.approx(own, rel=1e-6)


def test_derived_quantities() -> None:
    """c = b/a of a = 2, b = 6 uncorrelated: u(c)^2 = u(b)^2/a^2 + (b/a^2)^2 u(a)^2, by hand; t interval kept."""
    x = np.linspace(-1.0, 1.0, 21)
    X = np.column_stack([np.ones(21), x])
    y = X @ [2.0, 6.0] + 1e-3 * np.cos(7.0 * np.arange(21))
    found = fit(["a", "b"], X, y, None, None, [], "voltage", "V", 1.0, noise="white")
    c = found.derive([Quantity("c", "ratio", "1", 1.0, truth=3.0)], lambda v: v[1] / v[0])
    ua, ub = found.u
    a, b = found.value
    assert c.value == pytest.approx([b / a])
    assert c.u == pytest.approx([math.sqrt((ub / a) ** 2 + (b / a**2 * ua) ** 2)], rel=1e-8)
    assert c.reported.half_width / c.u == pytest.approx(found.reported.half_width[:1] / ua)
    assert c.gain @ c.error(0.02) == pytest.approx([-b / a**2 * 0.02], rel=1e-8)
    r = judged(c)
    assert r.rank == 2 and len(r.coefficients) == 1 and r.coefficients[0].dof == 19.0


def test_extra_columns_are_tested() -> None:
    """A parabola of 0.05 deg/h under the line is found with its size; the line itself hides nothing."""
    found = line(120, 0.01)
    x = found.X[:, 1:]
    bent = fit(found.quantities, found.X, found.y + 0.05 * DPH * x[:, 0] ** 2, found.t_start, found.t_end, [],
               "rate", "°/h", DPH, noise="white")  # fmt: skip
    size = bent.f_test("test", "curvature", x**2, "curvature", "the line is bent", "no more than noise")
    assert size is not None and size[0] == pytest.approx([0.05 * DPH], abs=4 * float(size[1][0]))
    assert bent.tests[-1].p is not None and bent.tests[-1].p < 1e-6 and "bent" in bent.tests[-1].finding
    assert any("curvature" in w for w in judged(bent).warnings)
    assert found.f_test("test", "curvature", x**2, "curvature", "bent", "no more than noise") and len(found.tests) == 4


def test_extra_columns_under_all_noise_models() -> None:
    """p of an F test is the mean over the noise models that count, each by generalized least squares with a dense
    covariance; here the likeliest alone would say 0.047 in place of 0.125.  Columns that the fit holds are not counted.
    """
    n = 24
    t = 10.0 * np.arange(n)
    unit = noise_model.process_covariance(t, t + 10.0, 60.0)
    y = np.linalg.cholesky(unit + 0.1 * np.eye(n)) @ np.random.default_rng(17).normal(size=n)
    x = np.linspace(-1.0, 1.0, n)
    X, extra = np.column_stack([np.ones(n), x]), np.column_stack([x**2, x**3])
    found = fit(["a", "b"], X, y, t, t + 10.0, [], "rate", "", 1.0)
    p_of, f_of = [], []
    for tau, share, reading, _ in found.est.noise.models:
        assert reading == 0.0
        C = noise_model.process_covariance(t, t + 10.0, tau)
        R = np.eye(n) * (1.0 - share) + share * C / C[0, 0]
        rss = []
        for A in (X, np.column_stack([X, extra])):
            v = y - A @ np.linalg.solve(A.T @ np.linalg.solve(R, A), A.T @ np.linalg.solve(R, y))
            rss.append(v @ np.linalg.solve(R, v))
        f_of.append((rss[0] - rss[1]) / 2.0 / (rss[1] / (n - 4)))
        p_of.append(stats.f.sf(f_of[-1], 2, n - 4))
    found.f_test("test", "square and cube", extra, "", "", "")
    test = found.tests[-1]
    assert test.statistic == pytest.approx(f_of[0]) and test.p == pytest.approx(found.est.noise.models[:, 3] @ p_of)
    assert test.p is not None and test.p > 2.0 * p_of[0] and p_of[0] < 0.05
    found.f_test("test", "with a copy", np.column_stack([extra, x + 2.0, np.ones(n)]), "", "", "")
    assert found.tests[-1].statistic == pytest.approx(test.statistic)
    nothing = np.random.default_rng(0).normal(size=(n, 5))
    nothing[:, 2] = 0.0
    with np.errstate(over="raise", invalid="raise"):
        amplitude_and_u = found.f_test("test", "beside nothing", nothing, "", "", "")
    assert amplitude_and_u is not None and np.abs(np.array(amplitude_and_u)[:, 2]).max() < 1e-9
    before = len(found.tests)
    assert found.f_test("test", "held", x[:, None] - 3.0, "", "", "") is None and len(found.tests) == before


def test_verdicts_hold_for_slow_drift_too() -> None:
    """Sixty windows with drift correlated over fifteen, under white noise of the same size, which takes the most of it
    for white: the interval given slow drift, whose half width draws from its candidates confirm, is wider, and limits
    between the two are inconclusive.
    """
    n = 60
    t = 10.0 * np.arange(n)
    C = noise_model.process_covariance(t, t + 10.0, 150.0)
    x = np.linspace(-1.0, 1.0, n)
    y = 0.3 * DPH + 0.01 * DPH * np.linalg.cholesky(C + np.eye(n)) @ np.random.default_rng(2).normal(size=n)
    X = np.column_stack([np.ones(n), x])
    wanted = [Quantity.of("a", "constant", "deg/h"), Quantity.of("b", "slope", "deg/h")]
    found = fit(wanted, X, y, t, t + 10.0, [], "rate", "°/h", DPH)
    probability, widening = found.if_slow()
    m, rng = found.est.mixture, np.random.default_rng(1)
    rows = rng.choice(np.flatnonzero(m.slow), 100_000, p=m.weight[m.slow] / probability)
    draws = m.off[rows, 0] + np.sqrt(m.covariance[rows, 0, 0]) * rng.standard_t(m.dof, rows.size)
    half = float(found.reported.half_width[0])
    assert 0.05 < probability < 0.95 and widening[0] > 1.1
    assert np.quantile(np.abs(draws), 0.95) == pytest.approx(half * widening[0], rel=0.02)
    middle, estimate = half * (1.0 + widening[0]) / 2.0 / DPH, found.value[0] / DPH
    for limit, verdict in ((middle, "inconclusive"), (1.01 * half * widening[0] / DPH, "pass")):
        r = judged(found, limits={"a": (estimate - limit, estimate + limit)})
        assert r.verdict == verdict
        assert any("slow drift" in w for w in r.warnings) == (verdict == "inconclusive")


def test_ideal_data_claim_nothing() -> None:
    for noise in ("white", "estimated"):
        r = judged(line(60, 0.0, noise=noise))
        assert r.noise["model"] == "none (ideal data)" and r.tests == [] and r.allan is None
        assert all(c.z is None for c in r.coefficients)
        assert [c.estimate for c in r.coefficients] == pytest.approx([0.3, -0.2], abs=1e-12)


def test_what_cannot_be_fitted() -> None:
    x = np.ones(5)
    with pytest.raises(ReductionError, match="not estimable: a − b"):
        fit(["a", "b"], np.column_stack([x, x]), x, None, None, [], "y", "V", 1.0, noise="white")
    with pytest.raises(ValueError, match="noise 'pink'"):
        fit(["a"], x[:, None], x, None, None, [], "y", "V", 1.0, noise="pink")


# ------------------------------------------------------------------------------------------ turns, run.json, checks
def turning(cosine3: float, step: float) -> tuple[Findings, Turns]:
    """Two turns of 36 windows: rate 0.3 deg/h + 0.1 cos theta, noise 0.002, cosine3 cos 3 theta, and ``step`` between
    the turns, all in deg/h.
    """
    edge = np.radians(np.arange(0.0, 721.0, 10.0))
    start, end = edge[:-1], edge[1:]
    middle = (start + end) / 2.0
    X, _ = harmonic.columns(start, end, (0, 1))
    y = 0.3 + 0.1 * X[:, 1] + cosine3 * harmonic.columns(start, end, (3,))[0][:, 0] + step * (middle > 2 * math.pi)
    y += 0.002 * np.random.default_rng(4).normal(size=y.size)
    t = 240.0 * np.arange(y.size)
    found = fit(["A0", "A1", "B1"], X, y * DPH, t, t + 240.0, [], "rate", "°/h", DPH, noise="white")
    turns = Turns(found, [("mount 1", np.ones(y.size, dtype=bool))], start, end, held=1)
    turns.test()
    return found, turns


def test_turns() -> None:
    found, turns = turning(0.0, 0.0)
    named = {t.name: t for t in found.tests}
    assert (named["harmonics 2 and higher"].p or 0.0) > 0.01 and (named["turn to turn"].p or 0.0) > 0.01
    rows = turns.table()[0].rows
    assert [r[:2] for r in rows] == [["mount 1", 1], ["mount 1", 2]]
    assert rows[0][2:] == pytest.approx([0.3, 0.1, 0.0], abs=0.002)
    assert list(turns.repeatability())[3:] == [f"scatter of {n} / (°/h)" for n in ("A0", "A1", "B1")]

    found, turns = turning(0.02, 0.0)
    third = next(h for h in turns.harmonics({}) if h.n == 3)
    assert (third.a, third.b) == pytest.approx((0.02, 0.0), abs=5 * third.u) and third.u < 1e-3
    assert (next(t for t in found.tests if t.name == "harmonics 2 and higher").p or 0.0) < 1e-6

    found, turns = turning(0.0, 0.02)  # two turns apart by 0.02: standard deviation of two values 0.02/sqrt(2)
    assert turns.repeatability()["p"] < 1e-6
    assert turns.repeatability()["scatter of A0 / (°/h)"] == pytest.approx(0.02 / math.sqrt(2.0), abs=1e-3)


def test_what_a_run_says() -> None:
    document = RunDocument(
        options={"latitude": 0.8, "k": 0.0, "u_axis": 1e-4},
        plan=[PlanRow(phase=2, face="up")],
        parameters={"gyro.k": 3.0, "gyro.D_F": 1e-6, "site.gravity": 9.81},
    )
    site = run_metadata.Location.of(document)
    assert (site.latitude, site.gravity) == (0.8, 9.81) and site.shown()["gravity / (m/s²)"] == 9.81
    assert run_metadata.Location.of(RunDocument(options={"latitude": 0.8})).gravity == pytest.approx(9.8067, abs=1e-3)
    assert run_metadata.number(document, "k", "gyro.k") == 3.0
    assert run_metadata.truth_of(document, ("D_F", "D_I")) == {"D_F": 1e-6}
    assert run_metadata.truth_of(RunDocument(), ("D_F",)) is None
    assert run_metadata.sizes(document.options) == {"u_axis": 1e-4}
    assert run_metadata.phases(document, ("up", "down")) == {2: PlanRow(phase=2, face="up")}
    with pytest.raises(ReductionError, match="mount up unknown; there are down"):
        run_metadata.phases(document, ("down",))
    with pytest.raises(ReductionError, match="scale factor unknown: the gyro has no parameter K; give the option K"):
        run_metadata.number(document, "K", "gyro.K", "scale factor")
    with pytest.raises(ReductionError, match="latitude"):
        run_metadata.Location.of(RunDocument())


def test_windows_of_two_channels() -> None:
    t = np.arange(3.0)
    w = {"t_start": t, "t_end": t + 1.0, "mean_x": t, "mean_y": t, "flagged_y": np.array([0, 1, 0])}
    need = ("t_start", "t_end", "mean_x", "mean_y")
    assert window_problems(w, need)[0].startswith("flagged windows (flagged_y)")
    del w["flagged_y"]
    assert window_problems(w, need) == []
    assert window_problems({**w, "mean_y": t * np.nan}, need) == ["column mean_y: non-finite number in window 1, 2, 3"]
