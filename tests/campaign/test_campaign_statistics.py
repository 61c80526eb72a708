"""Intervals, outliers, effects and indices against tables, closed forms and other programs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from gyrobench.campaign.analysis.axis_effects import crossed_seeds, levels, main_effects, responses
from gyrobench.campaign.analysis.intervals import normal_factor, order_trim, tolerance_interval
from gyrobench.campaign.analysis.lot_outliers import robust_outliers
from gyrobench.campaign.analysis.lots import analyse_lot, control_limits
from gyrobench.campaign.analysis.measures import CampaignMeasures, normalized_error
from gyrobench.campaign.analysis.sobol_indices import factorial_indices, first_order, sobol_indices, values_as_bins
from gyrobench.reduction.estimation.uncertainty import clopper_pearson


# ------------------------------------------------------------------------------------------------ intervals
@pytest.mark.parametrize(("hits", "runs"), [(0, 10), (10, 10), (93, 100), (950, 1000)])
def test_bounds_of_a_share_are_those_of_the_binomial_tails(hits: int, runs: int) -> None:
    low, high = clopper_pearson(hits, runs)
    # definition: at the bounds the tail that was seen, or a more extreme one, has 2.5 %
    assert hits == 0 or stats.binom.sf(hits - 1, runs, low) == pytest.approx(0.025)
    assert hits == runs or stats.binom.cdf(hits, runs, high) == pytest.approx(0.025)
    assert (low, high) == pytest.approx(tuple(stats.binomtest(hits, runs).proportion_ci(method="exact")))


@pytest.mark.parametrize(("n", "k"), [(2, 36.519), (3, 9.789), (10, 3.393), (30, 2.555), (100, 2.234)])
def test_factor_of_the_normal_tolerance_interval_is_the_tabulated_one(n: int, k: float) -> None:
    assert normal_factor(n) == pytest.approx(k, abs=1e-3)  # exact factors of ISO 16269, part 6: 95 % with 95 %


def test_distribution_free_tolerance_interval_takes_93_values() -> None:
    # 1 - n p^(n-1) + (n-1) p^n >= 0.95 for p = 0.95 first holds at n = 93
    confidence = [1 - n * 0.95 ** (n - 1) + (n - 1) * 0.95**n for n in (92, 93)]
    assert confidence[0] < 0.95 <= confidence[1]
    assert (order_trim(92), order_trim(93)) == (-1, 0)
    x = np.exp(np.random.default_rng(2).normal(size=93))
    found = tolerance_interval(x)
    assert (found.kind, found.low, found.high) == ("distribution-free", x.min(), x.max())
    assert tolerance_interval(x[:92], kind="distribution-free").low is None


def test_tolerance_interval_of_normal_values_holds_its_content_as_often_as_it_says() -> None:
    rng = np.random.default_rng(4)
    found = [tolerance_interval(rng.normal(size=20), kind="normal") for _ in range(600)]
    share = np.mean([stats.norm.cdf(t.high) - stats.norm.cdf(t.low) >= 0.95 for t in found])
    assert 0.92 < share < 0.98  # 0.95 +- 0.009


# ------------------------------------------------------------------------------------------------ outliers
@pytest.mark.long
def test_outliers_that_mask_each_other_are_named_and_no_other() -> None:
    rng = np.random.default_rng(6)
    mixed = rng.normal(size=(4, 4))
    x = rng.normal(size=(100, 4)) @ mixed
    x[:15] += 9.0 * mixed[0] + 3.0 * mixed[1]  # 15 of 100 in one cluster: ordinary distances see nothing
    off = x - x.mean(axis=0)
    plain = np.einsum("ij,jk,ik->i", off, np.linalg.inv(np.cov(x.T)), off)
    assert (plain < stats.chi2.isf(0.01 / 100, 4)).all()
    found = robust_outliers(x)
    assert found is not None and found.joint
    assert np.flatnonzero(found.outlier).tolist() == list(range(15))
    # another scale or another basis changes no judgement
    again = robust_outliers(x @ rng.normal(size=(4, 4)) * 1e-7 + 3.0)
    assert again is not None
    assert (again.outlier == found.outlier).all()


def test_distance_of_a_good_instrument_is_from_all_others() -> None:
    x = np.random.default_rng(8).normal(size=(40, 3))
    found = robust_outliers(x)
    assert found is not None and not found.outlier.any()
    others = np.delete(x, 7, axis=0)  # the definition, without its shortcut
    off = x[7] - others.mean(axis=0)
    assert found.distance[7] ** 2 == pytest.approx(off @ np.linalg.inv(np.cov(others.T)) @ off, rel=1e-6)


@pytest.mark.long
def test_few_lots_without_outliers_have_any_named() -> None:
    rng = np.random.default_rng(9)
    named = sum(bool(robust_outliers(rng.normal(size=(30, 5))).outlier.any()) for _ in range(25))  # type: ignore[union-attr]
    assert named <= 2  # 0.25 expected; more than 2 with a probability of 0.002


@pytest.mark.long
def test_small_lots_and_coefficients_that_say_nothing_new() -> None:
    rng = np.random.default_rng(10)
    x = rng.normal(size=(12, 4))
    x[5, 2] = 40.0
    found = robust_outliers(x)  # too few for four coefficients together
    assert found is not None and not found.joint
    assert np.flatnonzero(found.outlier).tolist() == [5]
    wide = np.column_stack([x, np.full(12, 3.0), x[:, 0] - 2.0 * x[:, 1]])
    assert robust_outliers(wide).used.tolist() == [True] * 4 + [False] * 2  # type: ignore[union-attr]
    x[3, 0] = np.nan
    assert np.isnan(robust_outliers(x).distance[3])  # type: ignore[union-attr]
    assert robust_outliers(x[:8]) is None


@pytest.mark.long
def test_one_coefficient_far_off_is_not_diluted_by_the_others() -> None:
    """Off by 7 deviations in one of four: the distance in all four, 7.2 for one in 20, alone would let it pass."""
    named = []
    for seed in range(6):
        x = np.random.default_rng(seed).normal(size=(20, 4))
        x[3, 2] = -7.0
        named.append(bool(robust_outliers(x).outlier[3]))  # type: ignore[union-attr]
    assert sum(named) >= 5


@pytest.mark.parametrize("n", [5, 6, 10, 20, 25, 40])
@pytest.mark.long
def test_of_normal_lots_as_many_values_lie_outside_the_limits_as_of_three_sigma(n: int) -> None:
    """0.27 % of the values, whatever their number; ± 3 sigma of few values had 1.0 to 2.5 % outside."""
    x = np.random.default_rng(n).normal(size=(60_000 // n, n))
    outside = [np.sum((v < low) | (v > high)) for v in x for _, low, high in [control_limits(v)]]  # type: ignore[misc]
    assert sum(outside) / x.size == pytest.approx(0.0027, abs=0.0009)


def test_control_limits_are_not_widened_by_what_they_are_to_show() -> None:
    x = np.random.default_rng(3).normal(5.0, 2.0, 400)
    x[::40] += 100.0
    centre, low, high = control_limits(x)  # type: ignore[misc]
    assert centre == pytest.approx(5.0, abs=0.5)
    assert (high - low) / 6.0 == pytest.approx(2.0, rel=0.15)
    assert control_limits(np.ones(9)) is None


# ------------------------------------------------------------------------------------------------- effects
def table(**columns: object) -> pd.DataFrame:
    n = len(next(iter(columns.values())))  # type: ignore[arg-type]
    return pd.DataFrame({"state": ["done"] * n, "verdict": [None] * n, "seed": np.arange(n), **columns})


def test_main_effects_are_those_of_an_analysis_of_variance() -> None:
    import statsmodels.formula.api as smf
    from statsmodels.stats.anova import anova_lm

    rng = np.random.default_rng(12)
    a, b = rng.choice([1.0, 2.0, 5.0], 80), rng.choice(["x", "y"], 80)  # not balanced
    y = 0.4 * a + 0.3 * (b == "x") + rng.normal(size=80)
    rows = table(**{"in.a": a, "in.b": b, "m.estimate": y})
    axes = [{"name": "a", "kind": "list", "unit": ""}, {"name": "b", "kind": "part", "unit": ""}]
    found = main_effects(CampaignMeasures.of(rows, {}, axes))
    fit = smf.ols("y ~ C(a) + C(b)", pd.DataFrame({"y": y, "a": a, "b": b})).fit()
    oracle = anova_lm(fit, typ=2)
    assert [e["p"] for e in found] == pytest.approx(oracle["PR(>F)"].iloc[:2].tolist(), rel=1e-8)
    assert found[0]["span"] == pytest.approx(np.ptp([0.0, fit.params["C(a)[T.2.0]"], fit.params["C(a)[T.5.0]"]]))


def test_noise_that_settings_share_by_their_seeds_hides_no_effect() -> None:
    rng = np.random.default_rng(13)
    seeds, a = np.tile(np.arange(20), 2), np.repeat([0.0, 1.0], 20)
    y = np.tile(rng.normal(0.0, 10.0, 20), 2) + 0.5 * a + 0.1 * rng.normal(size=40)
    rows = table(**{"in.a": a, "m.estimate": y}).assign(seed=seeds)
    assert crossed_seeds(rows, ["in.a"]) is not None
    effect = main_effects(CampaignMeasures.of(rows, {}, [{"name": "a", "kind": "grid", "unit": ""}]))[0]
    paired = stats.ttest_rel(y[:20], y[20:]).pvalue  # two levels in blocks: the F test is the paired t test
    assert effect["p"] == pytest.approx(paired, rel=1e-9)
    assert crossed_seeds(rows.iloc[1:], ["in.a"]) is None


def test_runs_of_one_seed_are_not_taken_for_independent_ones() -> None:
    """Two settings b of each of 20 draws a, with the noise of its draw: between the draws their means are compared,
    within them b.  Of four draws, each with its own seed, nothing tells a from noise; it was "beyond chance"."""
    rng = np.random.default_rng(15)
    a, b, seeds = np.repeat([0.0, 1.0], 20), np.tile([0.0, 1.0], 20), np.repeat(np.arange(20), 2)
    y = np.repeat(rng.normal(size=20), 2) + 0.3 * b + 0.05 * rng.normal(size=40)
    rows = table(**{"in.a": a, "in.b": b, "m.estimate": y}).assign(seed=seeds)
    axes = [{"name": n, "kind": "lhs", "unit": ""} for n in "ab"]
    means = y.reshape(20, 2).mean(axis=1)
    expected = [stats.ttest_ind(means[:10], means[10:]).pvalue, stats.ttest_rel(y[::2], y[1::2]).pvalue]
    assert [e["p"] for e in main_effects(CampaignMeasures.of(rows, {}, axes))] == pytest.approx(expected, rel=1e-9)

    few = rows.iloc[:8].assign(**{"in.a": np.repeat([0.1, 0.2, 0.3, 0.4], 2), "m.lo": y[:8] - 2.0, "m.hi": y[:8] + 2.0})
    assert [e["p"] is None for e in main_effects(CampaignMeasures.of(few, {}, axes))] == [True, False]
    shown = responses(CampaignMeasures.of(few, {}, axes))[0]["measures"][0]["quantities"]["estimate"]
    assert np.subtract(shown["hi"], shown["lo"]) == pytest.approx(4.0) and shown["runs"] == [2, 2, 2, 2]


def test_axes_that_cannot_be_told_apart_claim_nothing() -> None:
    a = np.repeat([1.0, 2.0], 10)
    rows = table(**{"in.a": a, "in.b": 3.0 * a, "m.estimate": a + np.random.default_rng(1).normal(size=20)})
    axes = [{"name": n, "kind": "table", "unit": ""} for n in "ab"]
    assert [e["p"] for e in main_effects(CampaignMeasures.of(rows, {}, axes))] == [None, None]
    assert "table" in sobol_indices(CampaignMeasures.of(rows, {}, axes))["word"]


def test_responses_are_free_of_what_the_other_axes_do() -> None:
    rng = np.random.default_rng(14)
    a = rng.choice([0.0, 1.0], 200)
    b = np.where(rng.random(200) < 0.3 + 0.4 * a, 1.0, 0.0)  # b is mostly 1 where a is: plain means of a hold b
    y = 0.2 * a + 5.0 * b + 0.1 * rng.normal(size=200)
    rows = table(**{"in.a": a, "in.b": b, "m.estimate": y})
    axes = [{"name": n, "kind": "table", "unit": ""} for n in "ab"]
    r = responses(CampaignMeasures.of(rows, {}, axes))[0]["measures"][0]["quantities"]["estimate"]
    assert r["mean"][1] - r["mean"][0] == pytest.approx(0.2, abs=0.05)
    assert y[a == 1.0].mean() - y[a == 0.0].mean() > 1.0
    # 95 % intervals of means of about 100 values with a dispersion of 0.1
    assert (r["hi"][0] - r["lo"][0]) / 2.0 == pytest.approx(1.98 * 0.1 / np.sqrt((a == 0.0).sum()), rel=0.2)


def test_many_values_become_bins_of_equal_count() -> None:
    rows = table(**{"in.a": np.linspace(0.0, 1.0, 240)})
    at, codes = levels(rows, "in.a")
    assert len(at) == 12 and set(np.bincount(codes)) == {20}


# ------------------------------------------------------------------------------------------------- indices
def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


FIRST, TOTAL = (0.31391, 0.44241, 0.0), (0.55759, 0.44241, 0.24368)  # a = 7, b = 0.1, of the closed form


@pytest.mark.parametrize("kind", ["random", "lhs", "sobol"])
def test_indices_of_sampled_designs_hold_the_closed_form(kind: str) -> None:
    from SALib.analyze import rbd_fast

    rng = np.random.default_rng(21)
    draw = {
        "random": lambda: rng.random((1024, 3)),
        "lhs": lambda: stats.qmc.LatinHypercube(3, rng=rng).random(1024),
        "sobol": lambda: stats.qmc.Sobol(3, rng=rng).random(1024),
    }[kind]
    x = np.pi * (2.0 * draw() - 1.0)
    y = ishigami(x)
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[-np.pi, np.pi]] * 3}
    other = rbd_fast.analyze(problem, x, y, seed=1)["S1"]
    for k in range(3):
        s, low, high = first_order(y, values_as_bins(pd.Series(x[:, k])), even=kind == "sobol")
        assert low <= FIRST[k] <= high
        assert high - low < 0.15
        assert s == pytest.approx(other[k], abs=0.08)


def test_indices_of_a_full_grid_are_the_closed_form_and_noise_is_taken_off() -> None:
    g = -np.pi + 2.0 * np.pi * np.arange(24) / 24.0  # the trapezoid of a period but for x3
    grid = np.stack([v.ravel() for v in np.meshgrid(g, g, g + np.pi / 24.0, indexing="ij")], axis=1)
    mean = ishigami(grid).reshape(24, 24, 24)
    first, total = factorial_indices(mean, 0.0)
    assert first == pytest.approx(FIRST, abs=0.01)
    assert total == pytest.approx(TOTAL, abs=0.01)
    rng = np.random.default_rng(5)
    small = mean[::6, ::6, ::6]
    clean = np.array(factorial_indices(small, 0.0))
    noisy = [factorial_indices(small + rng.normal(0.0, 2.0, small.shape), 4.0) for _ in range(200)]
    raw = [factorial_indices(small + rng.normal(0.0, 2.0, small.shape), 0.0) for _ in range(200)]
    assert np.abs(np.mean(noisy, axis=0) - clean).max() < 0.03
    assert np.abs(np.mean(raw, axis=0) - clean).max() > 0.05  # without taking it off


def test_a_grid_with_a_hole_has_no_indices() -> None:
    a, b = (v.ravel() for v in np.meshgrid([0.0, 1.0], [0.0, 1.0, 2.0]))
    rows = table(**{"in.a": a, "in.b": b, "m.estimate": a + b, "m.u": np.full(6, 0.1)})
    axes = [{"name": n, "kind": "grid", "unit": ""} for n in "ab"]
    whole = sobol_indices(CampaignMeasures.of(rows, {}, axes))["rows"]
    assert [r["total"] for r in whole] == pytest.approx([r["first"] for r in whole], abs=0.05)  # additive
    assert all(r["lo"] < r["first"] < r["hi"] for r in whole)
    assert "not complete" in sobol_indices(CampaignMeasures.of(rows.iloc[1:], {}, axes))["word"]


def test_what_varies_no_more_than_its_noise_has_no_indices() -> None:
    a, b = (v.ravel() for v in np.meshgrid(np.arange(5.0), np.arange(4.0)))
    noise = np.random.default_rng(5).normal(0.0, 0.1, 20)
    rows = table(**{"in.a": a, "in.b": b, "m.estimate": noise, "m.u": np.full(20, 0.1), "n.estimate": a + noise,
                    "n.u": np.full(20, 0.1)})  # fmt: skip
    axes = [{"name": n, "kind": "grid", "unit": ""} for n in "ab"]
    found = sobol_indices(CampaignMeasures.of(rows, {}, axes))
    assert {r["name"] for r in found["rows"]} == {"n"}
    assert found["word"].endswith("so no indices: m.")


# ----------------------------------------------------------------------------------------------------- lots
def test_normalized_errors_use_the_side_on_which_the_truth_is() -> None:
    rows = table(**{"m.estimate": [1.0, 1.0, 1.0], "m.lo": [0.5] * 3, "m.hi": [3.0] * 3, "m.truth": [0.4, 2.9, 1.0]})
    # truth 0.6 below, half-width 0.5; truth 1.9 above, half-width 2
    assert normalized_error(rows, "m").tolist() == pytest.approx([1.2, -0.95, 0.0])


def dated(instruments: int, step: float, seed: int = 0) -> pd.DataFrame:
    """Three dates of each instrument, ten days apart; the first drifts by ``step`` a date."""
    rng = np.random.default_rng(seed)
    name = np.repeat([f"g{k:02d}" for k in range(instruments)], 3)
    date = np.tile(["2026-03-01", "2026-03-11T08:00:00+00:00", "2026-03-21"], instruments)
    y = np.repeat(rng.normal(0.0, 5.0, instruments), 3) + rng.normal(0.0, 0.1, 3 * instruments)
    y[:3] += step * np.arange(3)
    shown = {"instrument": name, "date": date, "data": name, "run": name, "reason": None, "report": None}
    rows = table(**{"m.estimate": y, "m.u": np.full(len(y), 0.1)}).assign(**shown)
    rows["warnings"] = [[] for _ in y]
    return rows


def test_an_instrument_that_drifts_between_dates_is_named() -> None:
    changes = analyse_lot(CampaignMeasures.of(dated(12, 0.6), {"m.estimate": "°/h"}, []))["changes"]
    assert [d["instrument"] for d in changes["drifts"] if d["beyond_chance"]] == ["g00"]
    drift = changes["drifts"][0]
    # equal weights at 0, 10.3, 20 days: u = 0.1 / sqrt(sum of squares from the mean), and no widening by its own drift
    t = np.array([0.0, 10.0 + 8.0 / 24.0, 20.0])
    assert drift["u"] == pytest.approx(0.1 / np.sqrt(((t - t.mean()) ** 2).sum()), rel=0.25)
    assert drift["slope"] == pytest.approx(0.06, abs=3 * drift["u"])
    still = analyse_lot(CampaignMeasures.of(dated(12, 0.0), {}, []))["changes"]
    assert not any(d["beyond_chance"] for d in still["drifts"])
    assert still["pooled"][0]["p"] > 0.01
