"""Normalized errors, weighted mean and consistency test: by hand, and by counting on synthetic results."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.reduction.suite import estimable_combinations
from gyrobench.reduction.suite.consistency import MethodValue, combine_values, normalized_error, outlier
from gyrobench.reduction.suite.method_comparison import Member, combine_methods, compare
from gyrobench.result import Coefficient, DriftTestResult, SuiteResult, TypeB

NORMAL = 1.959963984540054


def result(values: dict[str, tuple[float, float]], dof: float | None = None, **more: Any) -> DriftTestResult:
    """A result that reports name -> (estimate, u) in deg/h, uncorrelated."""
    coefficients = [
        Coefficient(n, "", "°/h", x, u, NORMAL, (x - 2 * u, x + 2 * u), u_a=u, dof=dof, combination=made_of.get(n, {}))
        for made_of in [more.pop("made_of", {})]
        for n, (x, u) in values.items()
    ]
    base: dict[str, Any] = {
        "system": "s", "title": "t", "method": "m", "sources": [], "equation": "", "conventions": [],
        "coefficients": coefficients, "series": [], "correlation": np.eye(len(coefficients)).tolist(), "condition": 1.0,
        "rank": len(coefficients), "dof": 10.0, "noise": {}, "tests": [], "residual_std": 1.0, "residual_unit": "°/h",
        "simulated": False,
    }  # fmt: skip
    return DriftTestResult(**{**base, **more})


def suite(results: dict[str, DriftTestResult], **more: Any) -> SuiteResult:
    members = {n: Member(r) for n, r in results.items()}
    limits = more.pop("limits", None)
    return conclude(combine_methods(members, system="x", title="t", method="m", sources=(), **more), None, limits)


# ------------------------------------------------------------------------------------------- by hand
def test_normalized_error_by_hand() -> None:
    """U = 1.95996 * 0.1 and 1.95996 * 0.2: E_n = 0.5 / (1.95996 sqrt(0.05)) = 0.5/0.438261."""
    pair = normalized_error(MethodValue("a", 1.0, 0.1), MethodValue("b", 1.5, 0.0, 0.2))
    assert pair.difference == pytest.approx(-0.5)
    assert pytest.approx(0.438261, abs=1e-6) == pair.U
    assert pair.E_n == pytest.approx(1.140872, abs=1e-6)


def test_few_degrees_of_freedom_widen() -> None:
    """t(0.975, 4) = 2.776445: U_a^2 = (2.776445 * 0.1)^2 + (1.959964 * 0.2)^2 = 0.0770865 + 0.1536584."""
    value = MethodValue("a", 0.0, 0.1, 0.2, dof=4.0)
    assert math.sqrt(0.0770865 + 0.1536584) == pytest.approx(value.U, rel=1e-6)
    assert value.u == pytest.approx(math.sqrt(0.05))


def test_a_shared_error_does_not_part_methods_and_does_not_average_out() -> None:
    """Both have the error s = 0.3 of one scale factor beside u = 0.1 of their own.  In the difference it drops out:
    U = 1.96 sqrt(0.02); in the mean it stays: u^2 = 0.1^2/2 + 0.3^2.  Taken as independent it would be 0.1/2.
    """
    shared = {"k": np.array([0.3])}
    a, b = MethodValue("a", 1.0, 0.1, shared=shared), MethodValue("b", 1.4, 0.1, shared=shared)
    assert pytest.approx(NORMAL * math.sqrt(0.02)) == normalized_error(a, b).U
    found = combine_values([a, b])
    assert found.mean == pytest.approx(1.2) and found.u == pytest.approx(math.sqrt(0.095))
    assert pytest.approx(0.4**2 / 0.02) == found.Q  # against 0.4^2/0.2, were they independent
    opposite = MethodValue("b", 1.4, 0.1, shared={"k": np.array([-0.3])})  # errors that part the methods
    assert pytest.approx(NORMAL * math.sqrt(0.02 + 0.36)) == normalized_error(a, opposite).U


def test_weighted_mean_and_birge_ratio_by_hand() -> None:
    """1, 2, 4 with u 1, 1, 2: weights 1, 1, 1/4; mean 4/2.25 = 16/9; Q = (49 + 4 + 400/4)/81 = 17/9; over 2 dof."""
    found = combine_values([MethodValue("a", 1.0, 1.0), MethodValue("b", 2.0, 0.0, 1.0), MethodValue("c", 4.0, 2.0)])
    assert found.mean == pytest.approx(16.0 / 9.0) and found.u == pytest.approx(2.0 / 3.0)
    assert found.weights == pytest.approx([4.0 / 9.0, 4.0 / 9.0, 1.0 / 9.0])
    assert pytest.approx(17.0 / 9.0) == found.Q and found.birge == pytest.approx(math.sqrt(17.0 / 18.0))
    assert found.p == pytest.approx(math.exp(-17.0 / 18.0))  # chi^2 with two degrees of freedom
    assert pytest.approx(NORMAL * 2.0 / 3.0) == found.U


def test_two_values_are_welch_s_t_test() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.normal(0.0, 1.0, 6), rng.normal(1.0, 3.0, 9)
    values = [MethodValue(n, float(v.mean()), float(v.std(ddof=1) / math.sqrt(v.size)), dof=v.size - 1.0)
              for n, v in (("x", x), ("y", y))]  # fmt: skip
    assert combine_values(values).p == pytest.approx(float(stats.ttest_ind(x, y, equal_var=False).pvalue), rel=1e-9)


def test_the_one_that_is_off_is_named() -> None:
    values = [MethodValue("a", 1.0, 0.1), MethodValue("b", 1.1, 0.1), MethodValue("c", 2.0, 0.1)]
    assert outlier(values) == ("c", pytest.approx(float(stats.chi2.sf(0.5, 1))))
    assert outlier(values[1:]) is None  # of two nobody can tell
    assert outlier([values[0], values[2], MethodValue("d", 3.0, 0.1)]) is None  # none agree


# ----------------------------------------------------------------------------------------- by counting
@pytest.mark.parametrize(("sigma", "dof"), [((1.0, 1.0), (6.0, 9.0)), ((1.0, 3.0, 0.5), (math.inf, 8.0, 20.0))])
@pytest.mark.long
def test_false_alarms_and_coverage(sigma: tuple[float, ...], dof: tuple[float, ...]) -> None:
    """Values that agree raise the alarm in 5 %, estimated u and all; the mean's interval holds the truth in 95 %."""
    n, rng = 3000, np.random.default_rng(7)
    shared = [np.array([s]) for s in np.linspace(0.4, 0.8, len(sigma))]
    alarms = covered = 0
    for _ in range(n):
        error = rng.standard_normal()
        values = [
            MethodValue(str(k), s * rng.standard_normal() + float(c[0]) * error,
                  s * math.sqrt(rng.chisquare(v) / v) if math.isfinite(v) else s, dof=v, shared={"k": c})
            for k, (s, v, c) in enumerate(zip(sigma, dof, shared, strict=True))
        ]  # fmt: skip
        found = combine_values(values)
        alarms += found.p < 0.05
        covered += abs(found.mean) < found.U
    low, high = stats.binom.ppf([1e-3, 1.0 - 1e-3], n, 0.05)
    assert low <= alarms <= high
    assert stats.binom.ppf(1e-3, n, 0.94) <= covered <= stats.binom.ppf(1.0 - 1e-3, n, 0.965)


@pytest.mark.long
def test_false_alarms_of_a_whole_suite() -> None:
    """Nine coefficients by three methods: one alarm in any of them in 5 % of suites, as p is adjusted."""
    n, rng, names = (
        400,
        np.random.default_rng(11),
        ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"),
    )
    alarms = 0
    for _ in range(n):
        found = compare(
            {
                m: result({k: (u * rng.standard_normal(), u) for k in names})
                for m, u in (("a", 1.0), ("b", 2.0), ("c", 0.5))
            },
            (),
        )
        alarms += any(c.disagree for c in found)
    low, high = stats.binom.ppf([1e-3, 1.0 - 1e-3], n, 0.0489)  # 1 - (1 - 0.05/9)^9
    assert low <= alarms <= high


def test_a_shift_of_five_u_is_found_and_named() -> None:
    """Power: nine in ten at least, and never another method blamed."""
    rng, found, blamed = np.random.default_rng(3), 0, []
    for _ in range(100):
        values = {m: {k: rng.standard_normal() for k in ("D_F", "D_I")} for m in "abcd"}
        values["b"]["D_I"] += 6.0
        results = {m: result({k: (x, 1.0) for k, x in v.items()}) for m, v in values.items()}
        c = next(c for c in compare(results, ()) if c.quantity.name == "D_I")
        found += c.disagree
        blamed += [c.words().split()[0]] if "deviates by" in c.words() and c.disagree else []
    assert found >= 95 and blamed and set(blamed) == {"b"}


# ------------------------------------------------------------------------------------------ combinations
def test_a_quantity_from_several_estimates() -> None:
    """b sees D_F + D_II in one attitude: from a it is the sum, with the sum's uncertainty and its correlation."""
    of_a = [TypeB("mount", "mount", [[0.1, -0.1], [0.2, 0.2]]), TypeB("k", "k", [[0.3, 0.1]])]
    a = result({"D_F": (1.0, 0.3), "D_II": (0.5, 0.4)}, correlation=[[1.0, -0.5], [-0.5, 1.0]], type_b=of_a)
    of_b = [TypeB("k", "k", [[0.2]])]
    b = result({"ω_d": (1.6, 0.1)}, made_of={"ω_d": {"D_F": 1.0, "D_II": 1.0}}, type_b=of_b)
    found = {c.quantity.name: c for c in compare({"a": a, "b": b}, ("k",))}
    assert set(found) == {"D_F", "D_II", "ω_d"} and len(found["D_F"].values) == 1
    v = found["ω_d"].values[0]
    assert v.estimate == pytest.approx(1.5) and not v.reported
    assert v.u_a**2 == pytest.approx(0.09 + 0.16 - 0.12)
    assert v.u_b == pytest.approx(0.4) and v.shared["k"] == pytest.approx([0.4])  # 0.1 - 0.1 and 0.2 + 0.2; 0.3 + 0.1


def test_names_of_the_source_are_mapped_by_what_they_stand_for() -> None:
    """u_zx = -1.5 Dy_y: 3 there is -2 here; an unknown of no model is compared where name and unit are the same."""
    a = result({"u_zx": (3.0, 0.3), "k_x": (5.0, 1.0)}, made_of={"u_zx": {"Dy_y": -1.5}})
    b = result({"Dy_y": (-2.1, 0.1), "k_x": (5.5, 1.0)})
    found = {c.quantity.name: c for c in compare({"a": a, "b": b}, ())}
    assert [v.estimate for v in found["Dy_y"].values] == pytest.approx([-2.0, -2.1])
    assert found["Dy_y"].values[0].u == pytest.approx(0.2) and found["Dy_y"].quantity.unit == "°/h/g"
    assert len(found["k_x"].values) == 2


def test_attitudes_some_arcseconds_apart_are_one() -> None:
    """Two composite drifts, the second in an attitude turned by 1e-5 rad (2 arcsec), then by 1e-4 rad (21 arcsec)."""
    first = result({"ω_d": (1.0, 0.1)}, made_of={"ω_d": {"D_F": 1.0, "D_I": 1.0}})
    for turned, count in ((1e-5, 1), (1e-4, 2)):
        second = result({"ω_d": (1.2, 0.1)}, made_of={"ω_d": {"D_F": 1.0, "D_I": 1.0, "D_S": turned}})
        found = compare({"a": first, "b": second}, ())
        assert len(found) == count
        assert {c.quantity.name for c in found} == ({"ω_d"} if count == 1 else {"ω_d, a", "ω_d, b"})


def test_what_the_rank_does_not_give_is_not_compared() -> None:
    """R + K_zx together do not give R."""
    a = result({"D_F + D_II": (1.0, 0.1)}, made_of={"D_F + D_II": {"D_F": 1.0, "D_II": 0.5}})
    b = result({"D_F": (1.0, 0.1)})
    assert [len(c.values) for c in compare({"a": a, "b": b}, ())] == [1, 1]
    assert estimable_combinations.weights(compare({"b": b}, ())[0].quantity, a) is None


# ------------------------------------------------------------------------------------------ suite
def test_disagreement_enlarges_u_and_withholds_conformity() -> None:
    limits = {"D_F": (-5.0, 5.0), "D_I": (-5.0, 5.0)}
    values = {"a": 1.0, "b": 1.0, "c": 3.0}
    r = suite({n: result({"D_F": (x, 0.2), "D_I": (x / 10.0, 0.2)}) for n, x in values.items()}, limits=limits)
    f, i = r.coefficients
    assert r.suite.disagreeing == ["D_F"] and r.suite.consistency == "inconsistent"
    assert "c deviates by +2 °/h; the others are consistent" in " ".join(r.summary)
    assert f.u == pytest.approx(
        combine_values([MethodValue("", x, 0.2) for x in values.values()]).birge * 0.2 / math.sqrt(3.0)
    )
    assert (f.verdict, i.verdict, r.verdict) == ("inconclusive", "pass", "inconclusive")
    assert i.u == pytest.approx(0.2 / math.sqrt(3.0))


def test_tests_of_different_gyros_are_refused() -> None:
    one, two = result({"D_F": (1.0, 0.1)}), result({"Dx_0": (1.0, 0.1)})
    with pytest.raises(ReductionError, match=r"a: of a single-degree.*; b: of a two-degree.*a suite compares"):
        suite({"a": one, "b": two})
    with pytest.raises(ReductionError, match="different instruments: gyro 7: a; gyro 8: b"):
        suite({n: result({"D_F": (1.0, 0.1)}, instrument=f"gyro {k}") for n, k in (("a", 7), ("b", 8))})
    with pytest.raises(ReductionError, match="b: simulated; a: measured"):
        suite({"a": one, "b": result({"D_F": (1.0, 0.1)}, simulated=True)})
    with pytest.raises(ReductionError, match="no test of the suite has a result"):
        suite({})
