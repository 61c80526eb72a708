"""Errata of the reduction mathematics (Hu 1981, chapter 4, eq. 6-31): the right form holds, the printed one fails."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
import scipy.stats

Array = np.ndarray[Any, np.dtype[np.float64]]


def generator() -> np.random.Generator:
    return np.random.default_rng(41)


def test_rates_from_angles() -> None:
    """ER1: two readings, sqrt(2) and a lag-one correlation of -1/2.  ER2: a forward difference is at t + dT/2."""
    e = generator().normal(size=400_000)
    d = np.diff(e)
    assert d.std() == pytest.approx(np.sqrt(2.0), rel=0.01)
    assert np.mean(d[1:] * d[:-1]) / d.var() == pytest.approx(-0.5, abs=0.01)
    mean_of_nine = np.diff(e.reshape(40_000, 10), axis=1).mean(axis=1)
    assert mean_of_nine.std() == pytest.approx(np.sqrt(2.0) / 9.0, rel=0.02)  # not over the root of nine
    theta, rate = np.poly1d([0.004, 0.02, 0.3, 0.0]), np.poly1d([0.012, 0.04, 0.3])
    forward = (theta(7.0) - theta(5.0)) / 2.0
    assert abs(forward - rate(6.0)) == pytest.approx(0.004, abs=1e-12) and abs(forward - rate(4.0)) > 0.1


def test_the_shortest_interval_is_not_the_best() -> None:
    """ER4: errors of the rate of sin t with noise: least near sqrt2 s/dT = dT^2/24, not at the shortest interval."""
    t, s = np.arange(0.0, 2000.0, 0.05), 1e-3
    theta = np.sin(t) + s * generator().normal(size=t.size)
    rms = []
    for n in (1, 8, 40):
        rate = (theta[n:] - theta[:-n]) / (n * 0.05)
        rms.append(float(np.sqrt(np.mean((rate - np.cos(t[:-n] + n * 0.025)) ** 2))))
    assert rms[1] < rms[0] / 3 and rms[1] < rms[2] / 3
    assert rms[0] == pytest.approx(np.sqrt(2) * s / 0.05, rel=0.03)
    # the mean of cos over dT is sin(dT/2)/(dT/2) of it
    assert rms[2] == pytest.approx((1 - np.sin(1.0)) / np.sqrt(2), rel=0.03)


def test_moving_mean_as_a_filter() -> None:
    """ER3: beyond f dT = 1 the mean over dT turns the sign of a sine and lets 22 % of it pass."""
    t, f = np.linspace(0.0, 50.0, 5001), 1.43
    mean = (np.cos(2 * np.pi * f * (t - 0.5)) - np.cos(2 * np.pi * f * (t + 0.5))) / (2 * np.pi * f)  # of sin, dT = 1
    gain = float(mean @ np.sin(2 * np.pi * f * t) / np.sum(np.sin(2 * np.pi * f * t) ** 2))
    assert gain == pytest.approx(float(np.sinc(f)), abs=1e-3) and gain < -0.21


def test_sums_of_sines() -> None:
    """ER6: (n - 1)/2, not (2n - 1)/2.  ER7: + 1/2 before both product sums."""
    n, x = 12, 1.7
    m = np.arange(n)
    common = np.sin(n * x / 2) / np.sin(x / 2)
    assert np.sin(m * x).sum() == pytest.approx(common * np.sin((n - 1) * x / 2))
    assert abs(np.sin(m * x).sum() - common * np.sin((2 * n - 1) * x / 2)) > 0.5
    a, b = 0.7, 0.31
    product = float(np.sum(np.cos(a * m) * np.cos(b * m)))
    sums = float(np.sum(np.cos((a - b) * m) + np.cos((a + b) * m)))
    assert product == pytest.approx(0.5 * sums) and abs(product + 0.5 * sums) > 0.5


def test_harmonics_of_equal_steps() -> None:
    """ER5: a_0 is +mean.  ER8: n even has a_{n/2} beyond l = (n - 1)/2.  ER9: atan2(a, b).  ER10: L - 1."""
    n = 8
    angle = 2 * np.pi * np.arange(n) / n
    y = 2.0 + 0.4 * np.cos(4 * angle) + 0.5 * np.sin(angle - 2.4981)
    F = np.fft.rfft(y) / n
    assert F[0].real == pytest.approx(2.0) and F[4].real == pytest.approx(0.4)
    a, b = 2 * F[1].real, -2 * F[1].imag
    assert np.arctan2(a, b) == pytest.approx(-2.4981) and abs(np.arctan(a / b) + 2.4981) > 3.0
    cycles = generator().normal(size=(200_000, 4))
    assert cycles.var(axis=1).mean() == pytest.approx(0.75, abs=0.01)  # divisor L; with L - 1 it is 1
    assert cycles.var(axis=1, ddof=1).mean() == pytest.approx(1.0, abs=0.01)


def correlation(x: Array) -> Array:
    n = x.size
    return np.array([np.sum(x[p:] * x[: n - p]) / n for p in range(n)])


def test_correlation_by_transform() -> None:
    """ER11: with n zeros and 1/(2n) the recipe gives r/2.  ER21: the circular one is no substitute below n/5."""
    n = 64
    x = generator().normal(size=n)
    A = np.fft.fft(np.r_[x, np.zeros(n)]) / (2 * n)
    padded = (np.fft.ifft(np.abs(A) ** 2) * 2 * n).real[:n]
    assert 2.0 * padded == pytest.approx(correlation(x)) and padded[0] / correlation(x)[0] == pytest.approx(0.5)
    ramp = np.arange(n) / n - 0.5
    r = correlation(ramp)
    circular = r + np.r_[0.0, r[:0:-1]]
    assert abs(circular[n // 5] - r[n // 5]) / r[0] > 0.2


def recursion(A: Array, whole: bool) -> Any:
    """x_j = sum A_k W^(jk) by 4-36, W = exp(+2 pi i / N), bit by bit; whole: the exponent holds the j known so far."""
    bits, N = A.size.bit_length() - 1, A.size
    W = np.exp(2j * np.pi / N)
    now = {((), k): A[k] for k in range(N)}
    for left in range(bits - 1, -1, -1):
        then: dict[Any, Any] = {}
        for known, k in {(j, k & ((1 << left) - 1)) for j, k in now}:
            for bit in (0, 1):
                j = (*known, bit)
                power = sum(v << i for i, v in enumerate(j)) if whole else j[0]
                then[(j, k)] = sum(now[(known, k + (b << left))] * W ** (power * b << left) for b in (0, 1))
        now = then
    out = np.zeros(N, complex)
    for j, _ in now:
        out[sum(v << i for i, v in enumerate(j))] = now[(j, 0)]
    return out


def test_factorizations_of_the_transform() -> None:
    """ER12: twiddle factor W^(j0 k0) in 4-28.  ER13: the exponent of 4-34 holds the whole j known so far."""
    rng = generator()
    A = rng.normal(size=16)
    assert recursion(A, True) == pytest.approx(np.fft.ifft(A) * 16)
    assert not np.allclose(recursion(A, False), np.fft.ifft(A) * 16)
    r, s, N = 3, 4, 12
    B = rng.normal(size=N)
    right, printed = np.zeros(N, complex), np.zeros(N, complex)
    for j1, j0, k0 in np.ndindex(s, r, s):
        inner = sum(B[k1 * s + k0] * np.exp(2j * np.pi * j0 * k1 / r) for k1 in range(r))
        inner = inner * np.exp(2j * np.pi * j1 * k0 / s)
        right[j1 * r + j0] += inner * np.exp(2j * np.pi * j0 * k0 / N)
        printed[j1 * r + j0] += inner * np.exp(2j * np.pi * j1 * k0 / N)
    assert right == pytest.approx(np.fft.ifft(B) * N) and not np.allclose(printed, np.fft.ifft(B) * N)


def test_transform_of_a_real_series() -> None:
    """ER15: A_1 and A_2 are conjugate symmetric, A is not over N/2.  ER17: +1/2 in 4-44.  ER19: W^(-2jk) in 4-52."""
    N = 16
    x = generator().normal(size=N)

    def transform(v: Any) -> Any:
        return np.fft.fft(v) / len(v)

    Z, k, W = transform(x[::2] + 1j * x[1::2]), np.arange(N // 2), np.exp(-2j * np.pi / N)
    mirrored = np.conj(Z[-k % (N // 2)])
    A1, A2, A = (Z + mirrored) / 2, (Z - mirrored) / 2j, transform(x)[: N // 2]
    for half in (A1, A2):
        assert half[-k % (N // 2)] == pytest.approx(np.conj(half))
    assert not np.allclose(A[-k % (N // 2)], np.conj(A))
    assert 0.5 * (A1 + W**k * A2) == pytest.approx(A) and not np.allclose(-0.5 * (A1 + W**k * A2), A)
    both = (A + np.conj(transform(x)[N // 2 - k])) + 1j * (A - np.conj(transform(x)[N // 2 - k])) * W**-k
    series = x[::2] + 1j * x[1::2]
    for power, fits in ((2, True), (1, False)):
        back = np.array([np.sum(both * W ** (-power * j * k)) for j in range(N // 2)])
        assert np.allclose(back, series) is fits


def test_operations_of_a_radix() -> None:
    """ER20: r / log2 r of 3, 6, 9 is 1.89, 2.32, 2.84; printed 1.88, 2.31, 2.82."""
    assert [round(r / np.log2(r), 2) for r in (3, 6, 9)] == [1.89, 2.32, 2.84]


def test_variance_and_tests_of_a_regression() -> None:
    """ER23: divisor N - n - 1.  ER26: the residual sum, not the total.  ER27: over p_ii.  ER28: two sides."""
    rng, N = generator(), 40
    X = np.c_[np.ones(N), rng.normal(size=(N, 3))]
    P, n = np.linalg.inv(X.T @ X), 3
    Y = X @ np.array([1.0, 2.0, -1.0, 0.0]) + rng.normal(size=(40_000, N))
    B = Y @ X @ P
    residual = ((Y - B @ X.T) ** 2).sum(axis=1)
    total = ((Y - Y.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    assert (residual / (N - n - 1)).mean() == pytest.approx(1.0, abs=0.005) and (residual / (N - n)).mean() < 0.985
    limit = scipy.stats.t.ppf(0.975, N - n - 1)
    t = B[:, 3] / np.sqrt(P[3, 3] * residual / (N - n - 1))
    assert np.mean(abs(t) > limit) == pytest.approx(0.05, abs=0.005)
    assert np.mean(abs(B[:, 3]) / np.sqrt(P[3, 3] * total / (N - n - 1)) > limit) < 1e-3
    assert np.mean(t > scipy.stats.t.ppf(0.95, N - n - 1)) == pytest.approx(0.05, abs=0.005)  # misses negative ones
    F = scipy.stats.f.ppf(0.95, 1, N - n - 1)
    assert np.mean(t**2 > F) == pytest.approx(0.05, abs=0.005)
    assert np.mean(B[:, 3] ** 2 / (residual / (N - n - 1)) > F) < 1e-3


def test_unequal_accuracy() -> None:
    """ER29: variances 1, 1, 1, 25: the plain mean has 1.75, the weighted one 0.33."""
    v = np.array([1.0, 1.0, 1.0, 25.0])
    assert v.sum() / 16.0 == pytest.approx(1.75) and 1.0 / np.sum(1.0 / v) == pytest.approx(0.329, abs=1e-3)


def test_orthogonalization() -> None:
    """ER34: without "- phi_k" in 4-101 the functions are not orthogonal."""
    X = np.vander(np.linspace(-1.0, 1.0, 50), 6, increasing=True)
    for complete in (True, False):
        Q: list[Array] = [X[:, 0] / np.linalg.norm(X[:, 0])]
        for k in range(1, 6):
            w = sum((X[:, k] @ q) * q for q in Q) - (X[:, k] if complete else 0.0)
            Q.append(w / np.linalg.norm(w))
        off = np.abs(np.array(Q) @ np.array(Q).T - np.eye(6)).max()
        assert off < 1e-12 if complete else off > 0.1


def test_a_polar_run_determines_five_combinations() -> None:
    """ER36: input axis on the polar axis: the nine columns of 4-136 have rank 5."""
    angle, s = np.linspace(0.0, 2 * np.pi, 60), np.sin(0.8)
    x, y, z = np.full(60, s), np.cos(0.8) * np.sin(angle), np.cos(0.8) * np.cos(angle)
    assert np.linalg.matrix_rank(np.c_[np.ones(60), x, y, z, x * x, z * z, x * y, x * z, y * z], tol=1e-9) == 5


def test_covariance_of_the_compensation_filter() -> None:
    """ER39: Phi p Phi' is a covariance; the printed Phi p Phi is not even symmetric."""
    rng = generator()
    Phi, p = rng.normal(size=(3, 3)), np.diag([1.0, 2.0, 3.0])
    assert Phi @ p @ Phi.T == pytest.approx((Phi @ p @ Phi.T).T) and not np.allclose(Phi @ p @ Phi, (Phi @ p @ Phi).T)
