"""Errata of the test of four accelerometers on one index head (Dong 2014).

U_i' of sensor i, over its scale factor, at the head angle a with the angle error D(a) common to all four, to first
order; harmonics by exact sums over 64 positions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

ALPHA = 2 * np.pi * np.arange(64) / 64
S, C = np.sin(ALPHA), np.cos(ALPHA)
INPUT, OUTPUT = (S, C, -S, -C), (C, -S, -C, S)  # a_I, a_O of the four sensors
RNG = np.random.default_rng(44)
F, K, KO, IO, II, ETA = RNG.normal(size=(6, 4))  # relative: bias, scale, output axis, cross, square; tilt
DC, DS = RNG.normal(size=(2, 8))  # harmonics of D; DS[0] unused


def error() -> Any:
    return sum(DC[k] * np.cos(k * ALPHA) + DS[k] * np.sin(k * ALPHA) for k in range(8))


def reading(i: int, d: Any = None) -> Any:
    d = error() if d is None else d
    a, o = INPUT[i], OUTPUT[i]
    return F[i] + (1 + K[i]) * a + (KO[i] + ETA[i] + d) * o + IO[i] * a * o + II[i] * a * a


def harmonic(y: Any, n: int) -> tuple[float, float]:
    """(cosine, sine) amplitude of order n."""
    size = 1 if n == 0 else 2
    return size * float(np.mean(y * np.cos(n * ALPHA))), size * float(np.mean(y * np.sin(n * ALPHA)))


def test_first_order() -> None:
    """EA1: K_II goes with a_I^2, K_IO with a_I a_O: the first-order form is that of the exact readings."""
    e = 1e-6
    for i in range(4):
        a = ALPHA + e * (error() + ETA[i])
        aI, aO = ((np.sin(a), np.cos(a)), (np.cos(a), -np.sin(a)), (-np.sin(a), -np.cos(a)), (-np.cos(a), np.sin(a)))[i]
        exact = e * F[i] + (1 + e * K[i]) * aI + e * (KO[i] * aO + IO[i] * aI * aO + II[i] * aI * aI)
        assert (exact - INPUT[i]) / e == pytest.approx(reading(i) - INPUT[i], abs=1e-3)


def test_combination() -> None:
    """EA3: 15 has the constant 2 D0 + 1/2 sum(K_O' + eta), F1 - F3 in its cosine, eta in cos 2a.  Harmonics 4: 2 D."""
    V = reading(0) * C - reading(1) * S - reading(2) * C + reading(3) * S
    assert harmonic(V, 0)[0] == pytest.approx(0.5 * np.sum(KO + ETA) + 2 * DC[0])
    assert abs(harmonic(V, 0)[0] - 4 * (DC[0] + ETA.sum())) > 0.1
    q = 0.25
    cosine = F[0] - F[2] + q * (II[0] + IO[1] - II[2] - IO[3]) + 2 * DC[1]
    sine = -F[1] + F[3] + q * (IO[0] - II[1] - IO[2] + II[3]) + 2 * DS[1]
    assert harmonic(V, 1) == pytest.approx((cosine, sine))
    second = 0.5 * ((KO + ETA) @ [1, -1, 1, -1]) + 2 * DC[2]
    assert harmonic(V, 2) == pytest.approx((second, 0.5 * (K @ [1, -1, 1, -1]) + 2 * DS[2]))
    for n in (4, 5, 6, 7):
        assert harmonic(V, n) == pytest.approx((2 * DC[n], 2 * DS[n]))


def test_harmonics_of_one_sensor() -> None:
    """EA4: half of D2s and D2c in 18 and 21.  EA1: K_II in the constant and cos 2a, K_IO in sin 2a."""
    U = reading(0)
    assert harmonic(U, 0)[0] == pytest.approx(F[0] + II[0] / 2 + DC[1] / 2)
    assert harmonic(U, 1) == pytest.approx((KO[0] + ETA[0] + DC[0] + DC[2] / 2, 1 + K[0] + DS[2] / 2))
    assert abs(harmonic(U, 1)[1] - (1 + K[0] + DS[2])) > 0.01
    assert harmonic(U, 2) == pytest.approx(((-II[0] + DC[1] + DC[3]) / 2, (IO[0] + DS[1] + DS[3]) / 2))
    assert harmonic(U, 4) == pytest.approx(((DC[3] + DC[5]) / 2, (DS[3] + DS[5]) / 2))


def fitted(i: int) -> Any:
    """K(1) to K(5) of sensor i with D = D1c cos a + D1s sin a.  EA5: cos first and cos^2 for sensors 2 and 4."""
    even = i in (1, 3)
    a, o = (C, S) if even else (S, C)
    basis = np.c_[np.ones(64), a, o, S * C, a * a]
    return np.linalg.lstsq(basis, reading(i, DC[1] * C + DS[1] * S), rcond=None)[0]


def test_first_harmonic_of_the_head() -> None:
    """EA7: K3(2) = -(1 + dK), K3(3) = -K_O in 26, exchanged in print.  EA12: D1 shifts F, IO and II in full."""
    c, s, out = DC[1], DS[1], KO + ETA
    expected = (
        (F[0] + c, 1 + K[0], out[0], IO[0] + s, II[0] - c),
        (F[1] - s, 1 + K[1], -out[1], -IO[1] - c, II[1] + s),
        (F[2] - c, -(1 + K[2]), -out[2], IO[2] - s, II[2] + c),
        (F[3] + s, -(1 + K[3]), out[3], -IO[3] + c, II[3] - s),
    )
    for i in range(4):
        assert fitted(i) == pytest.approx(expected[i])
    assert abs(fitted(2)[1] + out[2]) > 0.01


def test_printed_table_1_needs_the_scale_factor() -> None:
    """EA8: B_w to B_z of Table 1 in volts: eleven of twelve cells with K_I D1, at most five with D1 alone."""
    c, s, scale = 1.5e-5, -1.9e-6, (1.2993698, 1.3245304, 1.297999, 1.29999)
    before = (
        (-8.142e-4, -3.093e-5, -1.552e-5),
        (-4.131e-3, 2.774e-5, 1.325e-5),
        (-9.397e-4, -1.661e-5, 2.682e-5),
        (-1.3e-3, -2.877e-5, 4.92e-6),
    )
    after = (
        (-8.336e-4, -2.849e-5, 3.91e-6),
        (-4.133e-3, 7.93e-6, 1.573e-5),
        (-9.2e-4, -1.905e-5, 7.41e-6),
        (-1.2999e-3, -9.327e-6, 2.48e-6),
    )
    step = ((-c, -s, c), (s, -c, -s), (c, s, -c), (-s, c, s))
    right = np.array(before) + np.array(scale)[:, None] * np.array(step) - np.array(after)
    printed = np.array(before) + np.array(step) - np.array(after)
    assert np.sum(np.abs(right) < 6e-7) >= 11 and np.sum(np.abs(printed) < 6e-7) <= 5


def test_degrees_of_freedom() -> None:
    """EA9: after the angle error is taken out, n - 5 of 30 understates sigma; the joint fit has rank 41 of 96."""
    n = 24
    a = 2 * np.pi * np.arange(n) / n
    s, c = np.sin(a), np.cos(a)
    D = np.column_stack([f(k * a) for k in range(2, 12) for f in (np.sin, np.cos)] + [np.cos(12 * a)])
    M = np.zeros((4 * n, 20 + D.shape[1]))
    for i, (x, y) in enumerate(((s, c), (c, -s), (-s, -c), (-c, s))):
        M[i * n : (i + 1) * n, 5 * i : 5 * i + 5] = np.c_[np.ones(n), x, y, x * y, x * x]
        M[i * n : (i + 1) * n, 20:] = D * y[:, None]
    assert np.linalg.matrix_rank(M) == 41
    Q = np.linalg.qr(M)[0]
    noise = np.random.default_rng(45).normal(size=(4 * n, 4000))
    left = noise - Q @ (Q.T @ noise)
    assert np.sqrt(np.sum(left**2, axis=0) / 55).mean() == pytest.approx(1.0, abs=0.01)
    single = np.sqrt(np.sum(left[:n] ** 2, axis=0) / (n - 5)).mean()
    assert single < 0.9
