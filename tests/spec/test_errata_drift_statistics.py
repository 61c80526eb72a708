"""Errata of the drift statistics and of the wavelets (Xia 2008, chapters 2 to 4)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import pywt
import scipy.linalg
import scipy.signal
import scipy.stats
from statsmodels.regression.linear_model import burg

#: Table 3.4.2: coefficients as printed, variance
TABLE = {
    1: ((0.4947,), 4.0617e-6),
    2: ((0.6612, 0.3366), 3.6016e-6),
    3: ((0.7466, 0.5044, 0.2538), 3.3697e-6),
    4: ((0.7956, 0.6017, 0.3979, 0.1930), 3.2440e-6),
    5: ((0.8268, 0.6661, 0.4953, 0.3217, 0.1617), 3.1592e-6),
    6: ((0.8493, 0.7108, 0.5641, 0.4142, 0.2766, 0.1390), 3.0982e-6),
}
LENGTH = 17158  # of the record behind the tables: see test_length_of_the_record


def test_rebalance_loop() -> None:
    """EX3: i = k_u k_i k_w G b with J b'' + D b' = H w - k_m i: G above, k_m below."""
    H, J, D, ku, ki, kw, km, G, s = 0.02, 2.5e-5, 0.02, 10.0, 0.3, 2.0, 0.05, 1.7, 40j
    gain = ku * ki * kw * G
    b = H / (J * s * s + D * s + km * gain)  # for w = 1
    assert gain * b == pytest.approx(H * gain / (J * s * s + D * s + ku * ki * kw * km * G))
    assert abs(gain * b - H * ku * ki * kw / (J * s * s + D * s + ku * ku * ki * kw * G)) > 0.01 * abs(gain * b)


def standard_errors(n: int) -> tuple[float, float]:
    """Of skewness and kurtosis of n normal values, 3.4.7, 3.4.8."""
    skew = np.sqrt(6 * n * (n - 1) / ((n - 2) * (n + 1) * (n + 3)))
    return float(skew), float(np.sqrt(24 * n * (n - 1) ** 2 / ((n - 3) * (n - 2) * (n + 3) * (n + 5))))


def test_length_of_the_record() -> None:
    """EX6: the printed error 0.018699 of the skewness belongs to 17156 or 17157 readings, not to 27500."""
    assert {n for n in range(16000, 28000) if round(standard_errors(n)[0], 6) == 0.018699} == {17156, 17157}
    assert 86400 / 5 == 17280 and round(27500 * 5 / 3600, 1) == 38.2


def runs(signs: Any) -> int:
    return 1 + int(np.count_nonzero(np.diff(signs)))


def test_runs_are_changes_and_one() -> None:
    """EX7: the moments of 3.1.1 to 3.1.3 are those of runs; the number of changes is one less."""
    rng, base = np.random.default_rng(47), np.r_[np.ones(89, int), np.zeros(111, int)]
    counted = np.array([runs(rng.permutation(base)) for _ in range(20_000)])
    mean = 2 * 89 * 111 / 200 + 1
    variance = 2 * 89 * 111 * (2 * 89 * 111 - 200) / (200**2 * 199)
    assert abs(counted.mean() - mean) < 4 * np.sqrt(variance / 20_000) < 0.5
    assert counted.var() == pytest.approx(variance, rel=0.04)


def test_up_and_down_runs() -> None:
    """EX8: N of 3.1.4, 3.1.5 is the number of observations; the printed u = -2.3141 comes from the number of signs."""
    x = np.random.default_rng(48).normal(size=(20_000, 200))
    counted = 1 + np.count_nonzero(np.diff(np.sign(np.diff(x, axis=1)), axis=1), axis=1)
    assert counted.mean() == pytest.approx((2 * 200 - 1) / 3, abs=0.17)
    assert abs(counted.mean() - (2 * 199 - 1) / 3) > 0.5
    u = {n: (118 - (2 * n - 1) / 3) / np.sqrt((16 * n - 29) / 90) for n in (198, 200)}
    assert u[198] == pytest.approx(-2.3141, abs=2e-4) and u[200] == pytest.approx(-2.527, abs=1e-3)


def test_a_line_nearly_vanishes_from_the_difference() -> None:
    """EX10: d differences; 2 sin(pi f T) = 0.00723 for 2.3e-4 Hz at 5 s, phase + (pi/2 - pi f T)."""
    turn = np.pi * 2.3e-4 * 5.0
    t = 2.0 * turn * np.arange(20_000)
    assert 2.0 * np.sin(turn) == pytest.approx(0.0072257, rel=1e-4)
    assert np.diff(np.sin(t)) == pytest.approx(2.0 * np.sin(turn) * np.sin(t[1:] + np.pi / 2.0 - turn), abs=1e-12)
    assert np.diff(np.arange(5.0) ** 2, n=2) == pytest.approx([2.0, 2.0, 2.0])


def test_phase_of_a_line() -> None:
    """EX11: atan2(b, a) returns a phase of 2.5 rad, the printed arctan(b/a) does not."""
    t = 2 * np.pi * 2.3e-4 * 5 * np.arange(1, 20_001)
    y = 1.5 * np.sin(t + 2.5) + np.random.default_rng(49).normal(size=t.size)
    a, b, _ = np.linalg.lstsq(np.c_[np.sin(t), np.cos(t), np.ones(t.size)], y, rcond=None)[0]
    assert np.arctan2(b, a) == pytest.approx(2.5, abs=0.03) and abs(np.arctan(b / a) - 2.5) > 3.0


@pytest.mark.long
def test_error_of_a_mean_kurtosis() -> None:
    """EX12: 0.3422 is the error of one block of 200; of the mean of 85 blocks it is 0.037, and u is 3.9, not 0.42."""
    one = standard_errors(200)[1]
    blocks = scipy.stats.kurtosis(np.random.default_rng(50).normal(size=(600, 85, 200)), axis=2, bias=False)
    assert round(one, 4) == 0.3422 and blocks.std() == pytest.approx(one, rel=0.02)
    assert blocks.mean(axis=1).std() == pytest.approx(one / np.sqrt(85), rel=0.06)
    assert 0.14473 / (one / np.sqrt(85)) == pytest.approx(3.9, abs=0.05)


def test_burgs_sum() -> None:
    """EX13: forward and backward errors exist from p + 1 on: over those Burg's coefficient of order 1 is least."""
    x = np.random.default_rng(51).normal(size=60)

    def power(a: float, first: int) -> float:
        x0 = np.r_[0.0, x]  # a reading before the first one, for the printed limit
        now, before = x0[first:], x0[first - 1 : -1]
        return float(np.sum((now + a * before) ** 2 + (before + a * now) ** 2))

    a = -float(burg(x, order=1, demean=False)[0][0])
    right, printed = ((power(a + 1e-5, first) - power(a - 1e-5, first)) / 2e-5 for first in (2, 1))
    assert abs(right) < 1e-6 and abs(printed) > 0.01


def test_table_lists_a_not_phi() -> None:
    """EX14: Levinson's recursion fits the table as a = -phi to 1.1e-4 and misses as phi; so do the variances."""
    as_a, as_phi = [], []
    for p in range(2, 7):
        before, now = np.array(TABLE[p - 1][0]), np.array(TABLE[p][0])
        as_a.append(np.abs(before + now[-1] * before[::-1] - now[:-1]).max())
        as_phi.append(np.abs(before - now[-1] * before[::-1] - now[:-1]).max())
        assert TABLE[p][1] / TABLE[p - 1][1] == pytest.approx(1 - now[-1] ** 2, abs=1e-4)
    assert max(as_a) < 1.2e-4 and min(as_phi) > 0.2
    radius = [np.abs(np.roots(np.r_[1.0, sign * np.array(TABLE[3][0])])).max() for sign in (1.0, -1.0)]
    assert radius[0] == pytest.approx(0.647, abs=1e-3) and radius[1] == pytest.approx(1.290, abs=1e-3)


def test_variance_of_the_third_order() -> None:
    """EX30: the recursion s2(p) = s2(p - 1) (1 - a_p2) with half a unit of the last printed digit everywhere."""
    low, high = (TABLE[2][1] + d * 5e-11 for d in (-1.0, 1.0))
    from_second = [low * (1.0 - 0.25385**2), high * (1.0 - 0.25375**2)]
    from_third = [(3.2440e-6 + d * 5e-11) / (1.0 - (0.1930 + d * 5e-5) ** 2) for d in (-1.0, 1.0)]
    assert from_second[0] < 3.3696e-6 < from_second[1]
    assert from_third[0] < 3.3696e-6 < from_third[1] < 3.3697e-6 - 5e-11


def test_final_prediction_errors_of_the_table() -> None:
    """EX31: FPE = s2 (N + p + 1)/(N - p - 1), the formula above the table."""
    printed = {1: 4.0623e-6, 2: 3.6025e-6, 3: 3.3710e-6, 4: 3.2459e-6, 5: 3.1615e-6, 6: 3.1007e-6}
    right = {1: 4.0627e-6, 2: 3.6029e-6, 3: 3.3712e-6}
    variance = {p: v for p, (_, v) in TABLE.items()} | {3: 3.3696e-6}
    lengths = []
    for p, said in printed.items():
        fpe = variance[p] * (LENGTH + p + 1) / (LENGTH - p - 1)
        room = 5e-11 + 5e-11  # of the printed value, of the variance
        assert (abs(fpe - said) > room) == (p < 4), p
        assert abs(fpe - right.get(p, said)) < room, p
        lengths.append(2.0 * (p + 1) / (said / TABLE[p][1] - 1.0))
    assert lengths[:3] == pytest.approx([27_100, 24_000, 20_700], rel=0.01)
    assert lengths[3:] == pytest.approx([LENGTH] * 3, rel=0.05)


def test_ljung_box_of_the_table() -> None:
    """EX15: with r_1 = -0.4947 and n = 17158 LB(6) exceeds 4000; the printed 44.91 needs a record of some 184."""
    assert LENGTH * (LENGTH + 2) * 0.4947**2 / (LENGTH - 1) > 4000.0
    n = next(n for n in range(10, 1000) if n * (n + 2) * 0.4947**2 / (n - 1) > 44.91)
    assert 175 < n < 190


def test_degrees_of_freedom_of_a_whiteness_test() -> None:
    """EX16: on residuals of a fitted AR(3) LB(6) follows chi2(3), not chi2(6)."""
    rng, found = np.random.default_rng(52), []
    for _ in range(400):
        x = scipy.signal.lfilter([1.0], [1.0, 0.7466, 0.5044, 0.2538], rng.normal(size=1200))[200:]
        phi = burg(x, order=3)[0]
        e = scipy.signal.lfilter(np.r_[1.0, -phi], [1.0], x)[3:]
        e, n = e - e.mean(), e.size
        found.append(n * (n + 2) * sum((e[k:] @ e[:-k] / (e @ e)) ** 2 / (n - k) for k in range(1, 7)))
    assert np.mean(found) == pytest.approx(3.0, abs=0.5)


def test_table_is_that_of_differenced_white_noise() -> None:
    """EX17: a_k = (p + 1 - k)/(p + 1) to 0.0144, one variance in all orders; so says Burg on such a series too."""
    for p, (a, variance) in TABLE.items():
        assert np.abs(np.array(a) - (p + 1 - np.arange(1, p + 1)) / (p + 1)).max() < 0.0145
        assert variance * (p + 1) / (p + 2) == pytest.approx(2.70e-6, rel=0.005)
    rng = np.random.default_rng(53)
    phi = [burg(np.diff(rng.normal(size=LENGTH + 1)), order=3)[0] for _ in range(40)]
    z = (-np.array(TABLE[3][0]) - np.mean(phi, axis=0)) / np.std(phi, axis=0)
    assert np.abs(z).max() < 3.0


def test_vanishing_moments_and_shifts() -> None:
    """EX22: symN has N vanishing moments, printed 2N - 1; the decimated transform is not shift invariant."""
    for n in (2, 4, 6):
        high, k = np.array(pywt.Wavelet(f"sym{n}").dec_hi), np.arange(2 * n)
        moments = [abs(high @ k**m) for m in range(2 * n)]
        assert max(moments[:n]) < 1e-6 and moments[n] > 0.1
    x = np.random.default_rng(54).normal(size=64)
    decimated = [pywt.dwt(y, "db4", "periodization")[1] for y in (x, np.roll(x, 1))]
    whole = [pywt.swt(y, "db4", level=1)[0][1] for y in (x, np.roll(x, 1))]
    assert all(not np.allclose(np.roll(decimated[0], s), decimated[1]) for s in range(32))
    assert np.roll(whole[0], 1) == pytest.approx(whole[1])


def test_error_at_rest_is_the_same_for_every_wavelet() -> None:
    """EX29: constant truth, white noise: sigma 2^(-J/2) whatever the wavelet, so that table 4.3.2 ranks nothing."""
    rng, n, J = np.random.default_rng(55), 2**14, 5
    for name in ("db4", "sym4", "coif4"):
        found = []
        for _ in range(20):
            c = pywt.wavedec(rng.normal(size=n), name, "periodization", level=J)
            c[1:] = [pywt.threshold(d, np.sqrt(2 * np.log(n)), "soft") for d in c[1:]]
            found.append(np.mean(pywt.waverec(c, name, "periodization") ** 2))
        assert np.sqrt(np.mean(found)) == pytest.approx(2 ** (-J / 2), rel=0.06)
