"""Ranks of candidates: paired differences, their adjustment, and how often a rank is false."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from gyrobench.reduction.suite.ranking import LEVEL, RankedValue, adjusted, difference, rank


def of(values, seeds=None):
    values = [float(v) for v in values]
    seeds = range(1, len(values) + 1) if seeds is None else seeds
    u = np.std(values, ddof=1) / math.sqrt(len(values))
    k = float(stats.t.ppf(0.975, len(values) - 1))
    return RankedValue(float(np.mean(values)), float(u), k, dict(zip(seeds, values, strict=True)))


def test_pairs_of_equal_seed_are_those_of_the_paired_t_test():
    random = np.random.default_rng(5)
    common = random.normal(0.0, 10.0, 8)  # what a seed does to both
    a, b = common + random.normal(0.0, 0.1, 8), common + 0.3 + random.normal(0.0, 0.1, 8)
    d = difference(of(a), of(b))
    oracle = stats.ttest_rel(b, a)
    assert d.value == pytest.approx(np.mean(b - a)) and d.p == pytest.approx(oracle.pvalue, rel=1e-9)
    low, high = oracle.confidence_interval(0.95)
    assert (d.value - d.k * d.u, d.value + d.k * d.u) == pytest.approx((low, high), rel=1e-9)
    # without pairs the ten times larger scatter of the seeds hides it
    assert d.p < 1e-3 < 0.5 < difference(of(a), of(b, range(11, 19))).p


def test_single_runs_are_compared_by_their_uncertainties():
    """d = 0.5, u = hypot(0.3, 0.4) = 0.5: one standard deviation, p = 0.3173 two-sided."""
    assert difference(RankedValue(1.0, 0.3), RankedValue(1.5, 0.4)).p == pytest.approx(0.31731, abs=1e-5)
    assert difference(RankedValue(1.0, None), RankedValue(1.5, 0.4)).p is None
    assert difference(RankedValue(1.0, 0.0), RankedValue(1.5, 0.0)).p == 0.0
    assert difference(RankedValue(1.0, 0.0), RankedValue(1.0, 0.0)).p == 1.0


def test_equal_numbers_that_differ_by_rounding_are_a_tie():
    a, b = of([0.1 + 0.2] * 4), of([0.3] * 4)
    assert a.value != b.value and [p.place for p in rank([a, b])] == [1, 1]


@pytest.mark.long
def test_adjustment_is_holms():
    p = [0.001, 0.04, 0.03, 0.2, 0.012]
    assert adjusted(p) == pytest.approx(multipletests(p, method="holm")[1])


def test_ranks_and_probability_by_hand():
    """Two pairs at 4.47 and 4.46 u, one at 0.009 u: Holm takes 3, 2 and 1 times their p."""
    places = rank([RankedValue(3.0, 0.316), RankedValue(1.0, 0.316), RankedValue(1.004, 0.316)])
    assert [(p.index, p.place) for p in places] == [(1, 1), (2, 1), (0, 3)]
    z = 2.0 / math.hypot(0.316, 0.316)
    assert places[2].probability == pytest.approx(1.0 - 0.5 * 3.0 * 2.0 * stats.norm.sf(z), abs=1e-12)
    assert places[1].probability == pytest.approx(stats.norm.cdf(0.004 / math.hypot(0.316, 0.316)), abs=1e-12)
    assert places[0].probability is None


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.long
def test_equal_candidates_get_a_false_rank_in_at_most_one_comparison_of_twenty(paired):
    """400 comparisons of seven equal candidates over six seeds.  u of 0.05 in 400: 0.011."""
    random = np.random.default_rng(11)
    false = 0
    for _ in range(400):
        common = random.normal(0.0, 1.0, 6)
        scores = [(common if paired else random.normal(0.0, 1.0, 6)) + random.normal(0.0, 0.3, 6) for _ in range(7)]
        seeds = [range(6) if paired else range(10 * k, 10 * k + 6) for k in range(7)]
        false += rank([of(s, n) for s, n in zip(scores, seeds, strict=True)])[-1].place > 1
    assert false / 400 <= LEVEL + 2.0 * 0.011


@pytest.mark.long
def test_stated_steps_between_ranks_are_true_as_often_as_said():
    """Seven candidates in three true classes 1.5 standard deviations apart, eight seeds, 300 comparisons.

    A step from one rank to the next is stated with a probability above 0.975; it is false where the truth is equal or
    the other way round.  The classes must be found often, or the test would say nothing.
    """
    random = np.random.default_rng(2)
    truth = np.array([0.0, 0.0, 0.0, 1.5, 1.5, 3.0, 3.0])
    stated = false = 0
    for _ in range(300):
        scores = truth[:, None] + random.normal(0.0, 5.0, 8) + random.normal(0.0, 1.0, (7, 8))
        places = rank([of(s) for s in scores])
        leader = places[0]
        for before, p in pairwise(places):
            if p.place != before.place:
                assert p.probability > 0.975
                stated += 1
                false += truth[p.index] <= truth[leader.index]
                leader = p
    assert stated > 300 and false <= 0.025 * stated
