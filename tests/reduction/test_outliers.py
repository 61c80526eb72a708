"""Outliers are named by row with what they change; the fit stays as it is; a robust fit stands beside it when asked."""

from __future__ import annotations

import numpy as np
import pytest
from finding import judged

from gyrobench import units
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation import nuisances, outliers
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup.setups import Setup

DPH = units.factor("deg/h")
N = 88


def record(shift: dict[int, float], seed: int = 1, slow: float = 0.0, noise: str = "estimated") -> Findings:
    """88 windows of 100 s with noise of 0.01 deg/h; some rows shifted by so many standard deviations."""
    rng = np.random.default_rng(seed)
    e = rng.normal(size=N)
    for k in range(1, N):
        e[k] += slow * e[k - 1]
    x = np.cos(2.0 * np.pi * np.arange(N) / 11.0)
    X = np.column_stack([np.ones(N), x])
    for row, size in shift.items():
        e[row] += size
    t = 100.0 * np.arange(N)
    wanted = [Quantity.of("a", "constant", "deg/h"), Quantity.of("b", "cosine", "deg/h")]
    return fit(wanted, X, DPH * (X @ [0.3, -0.2] + 0.01 * e), t, t + 100.0, [], "rate", "°/h", DPH, noise=noise)


@pytest.mark.parametrize("noise", ["estimated", "white"])
def test_one_row_is_named_with_what_it_changes(noise: str) -> None:
    """60 sigma in row 41 of 88: it moves the mean by 60/88 sigma = 0.0068 deg/h; without it u is that of the rest."""
    clean, spoilt = record({}, noise=noise), record({40: 60.0}, noise=noise)
    odd = outliers.find(spoilt)
    assert odd is not None and odd.rows.tolist() == [40]
    assert abs(odd.t[0]) == pytest.approx(60.0, abs=12.0)
    assert odd.distance[0] == pytest.approx(0.6, abs=0.03)
    assert odd.without.value == pytest.approx(clean.value, abs=0.4 * float(clean.u.max()))
    assert spoilt.u[0] > 5.0 * odd.without.u[0]
    r = judged(spoilt)
    assert r.coefficients[0].estimate == pytest.approx(0.3 + 0.6 / N, abs=0.004)  # the plain fit stays
    (text,) = [w for w in r.warnings if "outside the noise" in w]
    assert text.startswith("Row 41 (+0.") and "without it" in text and "u = " in text
    (table,) = [t for t in r.tables if t.title == "Estimates without outliers"]
    assert table.rows[0][4] < 0.2 * table.rows[0][2]
    # 6.4 u of the mean without it, 0.01/sqrt(88) deg/h: nothing passes; 5.5 sigma move it by 0.6 u
    blocks = [[x.blocks for x in judged(record({40: size}, noise=noise)).reasons if x.id == "outliers"]
              for size in (60.0, 5.5)]  # fmt: skip
    assert blocks == [[("pass", "fail")], [()]]


def test_a_mount_of_outliers() -> None:
    """Eleven mounts of eight windows, all of the last one 60 sigma off, either way: they are named, and the fit to the
    others is that of ten mounts.
    """
    mounts = nuisances.scatter("mount", np.repeat(np.arange(11), 8).tolist())
    plain = record({80 + k: 60.0 * (-1.0) ** k for k in range(8)})
    spoilt = fit(
        plain.data.quantities, plain.X, plain.y, plain.t_start, plain.t_end, [], "", "", DPH, candidates=[mounts]
    )
    odd = outliers.find(spoilt)
    assert odd is not None and odd.rows.tolist() == list(range(80, 88))
    assert np.all(np.abs(odd.without.value / DPH - [0.3, -0.2]) < 0.01)


def test_rows_that_hide_one_another() -> None:
    """Nine neighbours shifted alike raise the scatter so that none stands out by the plain residuals."""
    group = {k: 12.0 for k in range(30, 39)}
    spoilt = record(group)
    plain = np.abs(spoilt.est.residual) / np.std(spoilt.est.residual)
    assert plain.max() < 3.6  # the usual limit for 88 rows
    odd = outliers.find(spoilt)
    assert odd is not None and odd.rows.tolist() == list(group)
    assert abs(odd.without.value[0] / DPH - 0.3) < 0.005


@pytest.mark.parametrize("slow", [0.0, 0.8])
@pytest.mark.long
def test_clean_records_have_none(slow: float) -> None:
    """At 1 % a record not more than two of 40, with drift too."""
    assert sum(outliers.find(record({}, seed, slow)) is not None for seed in range(40)) <= 2


def test_counts_too_coarse_for_a_noise_have_no_outliers() -> None:
    """Readings in counts, 75 of 88 alike: the others were named, 10^14 standard deviations off.  Two rows of a table
    without noise that are off by different amounts are named all the same.
    """
    t, X = 100.0 * np.arange(N), np.ones((N, 1))
    count = np.zeros(N)
    count[[3, 9, 17, 30, 33, 41, 50, 58, 66, 71, 80, 82, 86]] = [1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0] + 6 * [-1.0]
    wanted = [Quantity.of("a", "constant", "deg/h")]
    coarse = fit(wanted, X, DPH * (0.3 + 0.01 * count), t, t + 100.0, [], "rate", "°/h", DPH)
    assert outliers.find(coarse) is None
    off = np.where(np.arange(N) == 9, 3.0, 0.0) + np.where(np.arange(N) == 50, -1.0, 0.0)
    odd = outliers.find(fit(wanted, X, DPH * (0.3 + off), t, t + 100.0, [], "rate", "°/h", DPH))
    assert odd is not None and odd.rows.tolist() == [9, 50]


def test_a_spike_on_drift() -> None:
    """5.5 standard deviations of the innovations on a drift that wanders as far by itself."""
    odd = outliers.find(record({50: 30.0}, 3, 0.8))
    assert odd is not None and odd.rows.tolist() == [50]


def test_robust_fit_beside_the_plain_one() -> None:
    """Bisquare by hand: the location of (0, 0.1 ... ) with weights (1 - (r/4.685 s)^2)^2 is a fixed point; and a spoilt
    record's robust values are those of the clean one within a fraction of u.
    """
    clean, spoilt = record({}, noise="white"), record({40: 60.0, 70: -25.0}, noise="white")
    beta, covariance, light = outliers.bisquare(spoilt)
    r = spoilt.y - spoilt.X @ beta
    s = 1.4826 * np.median(np.abs(r)) * np.sqrt(N / (N - 2))
    w = np.where(np.abs(r) < 4.685 * s, (1.0 - (r / (4.685 * s)) ** 2) ** 2, 0.0)
    assert np.abs(spoilt.X.T @ (w * r)).max() < 1e-8 * DPH
    assert light >= 2
    assert np.all(np.abs(beta - clean.value) < 0.5 * clean.u)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(clean.u, rel=0.2)
    tables = {t.title: t for t in judged(spoilt, setup=Setup(robust=True)).tables}
    assert [row[0] for row in tables["Robust fit"].rows] == ["a", "b"]
    assert "Robust fit" not in {t.title for t in judged(spoilt).tables}


def test_derived_quantities_have_both() -> None:
    found = record({40: 60.0}).derive([Quantity.of("c", "ratio", "1")], lambda b: b[1] / b[0])
    odd = outliers.find(found)
    assert odd is not None and abs(odd.without.value[0] + 2.0 / 3.0) < 4.0 * odd.without.u[0]
    (row,) = outliers.robust(found)[0].rows
    assert row[0] == "c" and abs(row[3] + 2.0 / 3.0) < 4.0 * row[4]


def unequal(seed: int, shift: float = 0.0) -> Findings:
    """40 windows of 60 s and 72 of 240 s in turns, white noise: of the short ones twice as much, 0.02 deg/h; the first
    long one shifted by so many of its standard deviations.
    """
    length = np.tile(np.repeat([60.0, 240.0], [20, 36]), 2)
    e = np.random.default_rng(seed).normal(size=length.size)
    e[20] += shift
    y, t = 0.3 + 0.01 * e * np.sqrt(240.0 / length), np.concatenate([[0.0], np.cumsum(length)])
    wanted = [Quantity.of("a", "constant", "deg/h")]
    return fit(wanted, np.ones((y.size, 1)), DPH * y, t[:-1], t[1:], [], "rate", "°/h", DPH)


def test_short_windows_are_no_outliers_among_long_ones() -> None:
    """A clean record is named in 1 %; by the scatter of all, a 4 sigma of a short one was 5.5: 13 % of the records."""
    assert sum(outliers.find(unequal(seed)) is not None for seed in range(30)) <= 2


def test_an_outlier_among_long_windows_is_in_their_standard_deviations() -> None:
    """10 sigma of a long one, 0.1 deg/h, are 7 of the scatter of all rows, sqrt((40 * 4 + 72)/112) = 1.44 sigma."""
    odd = outliers.find(unequal(3, 10.0))
    assert odd is not None and odd.rows.tolist() == [20]
    assert odd.t[0] == pytest.approx(10.0, abs=2.5)


def test_relative_variances_are_those_of_the_covariance() -> None:
    """White alone goes with 1/T, a reading with 1/T2, a process that is slow against the windows with 1."""
    t1 = np.cumsum([100.0, 100.0, 400.0])
    t0 = np.concatenate([[0.0], t1[:-1]])
    for model, long in (((1.0, 0.0, 0.0), 0.25), ((1.0, 0.0, 1.0), 0.0625), ((1e7, 1.0, 0.0), 1.0)):
        assert noise_model.relative_variance(t0, t1, model) == pytest.approx([1.0, 1.0, long], rel=1e-4)
    process = np.diag(noise_model.process_covariance(t0, t1, 90.0))
    assert noise_model.relative_variance(t0, t1, (90.0, 1.0, 0.0)) == pytest.approx(process / process[0])
