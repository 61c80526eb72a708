"""Errata of the chapter on turntables and of the sampled loop (Hu 1981, chapter 5, section 6.1)."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from gyrobench.units import DEG

ARCSEC = DEG / 3600.0  # rad, and 1 deg/h in rad/s
GCM = 9.80665e-5  # N.m of 1 g.cm
AIR = 1.837e-5  # Pa.s at 25 C


def test_servo_loop() -> None:
    """ET5: solving the loop for w gives K_e/((K/s) G_g G_1), without G_M."""
    s, K, Gg, G1, GM, J, Ke = 0.3j, 2.0, 1.3, 0.7, 1.9, 2.5, 0.4
    L = K / s * Gg * G1 * GM

    def rate(drift: float, torque: float, base: float) -> Any:  # J s w = L (drift - w) - K_e G_M (w - base) + torque
        return (L * drift + Ke * GM * base + torque) / (J * s + Ke * GM + L)

    G = L / (J * s + Ke * GM + L)
    assert rate(1, 0, 0) == pytest.approx(G) and rate(0, 1, 0) == pytest.approx(G / L)
    assert rate(0, 0, 1) == pytest.approx(G * Ke / (K / s * Gg * G1)) and abs(rate(0, 0, 1) - G * Ke / L) > 0.01


def test_bearing_figures() -> None:
    """ET7: 4.26e-2 g.cm needs D = 2 r2 = 25 cm.  ET8: 700 g.cm is at 45 deg; 15 deg gives 966."""

    def viscous(D: float) -> float:  # 5-33 and 5-34 at 1 deg/s, gaps of 0.02 cm
        journal = np.pi * D**3 * 0.158 / (4 * 2e-4)
        return float(AIR * DEG * (journal + np.pi * (0.125**4 - 0.075**4) / 2e-4) / GCM)

    assert viscous(0.25) == pytest.approx(4.26e-2, rel=2e-3) and viscous(0.15) == pytest.approx(1.78e-2, rel=0.01)
    assert [round(1000 * np.cos(a * DEG)) for a in (15, 45)] == [966, 707]


def psi(b: float, g: float = 1.4) -> float:
    """Flow function of an orifice, choked below the critical pressure ratio."""
    c = (2 / (g + 1)) ** (g / (g - 1))
    b = max(b, c)
    return float(np.sqrt(2 * g / (g - 1) * (b ** (2 / g) - b ** ((g + 1) / g))))


def test_orifice() -> None:
    """ET9: 5-27 with 1/sqrt(p_a rho_a) is the balance of mass; the printed sqrt(p_0/(p_a rho_a)) is not."""
    p0, pa, rho, h, n, length, R = 6e5, 1.013e5, 1.184, 2e-5, 24, 0.0625, 0.125
    flow = 0.8 * np.pi * 1e-8  # Phi A
    ratio = pa / p0

    def balance(b: float) -> float:
        into = n * flow * psi(b) * p0 * np.sqrt(rho / pa)
        return float(into - np.pi * R * h**3 * rho * ((b * p0) ** 2 - pa**2) / (12 * AIR * length * pa))

    b = scipy.optimize.brentq(balance, ratio + 1e-9, 1 - 1e-12)
    xi = 12 * AIR * n * length * flow / (np.pi * R * h**3)
    assert (b * b - ratio**2) / (ratio * psi(b)) == pytest.approx(xi / np.sqrt(pa * rho), rel=1e-9)
    assert (b * b - ratio**2) / (ratio * psi(b)) < xi * np.sqrt(p0 / (pa * rho)) / 100.0


def test_two_phase_excitation() -> None:
    """ET11: d/dt of sin(w t + p a) with a = rate t has the amplitude 1 + p rate/w."""
    t, w, p, rate = np.linspace(0, 1e-3, 200_001), 2 * np.pi * 2e3, 360, 1.0
    voltage = np.gradient(np.sin(w * t + p * rate * t), t) / w
    assert voltage[1:-1].max() == pytest.approx(1 + p * rate / w, rel=1e-6)


def test_phase_shifter_error() -> None:
    """ET12: an all-pass shifter in the cosine channel gives 5-57; its maximum is rate/w, its mean half of that."""
    W, p = 2 * np.pi * 2e3, 360

    def error(rate: float) -> Any:
        d, a = p * rate / W, np.linspace(0, 2 * np.pi / p, 361)

        def shift(x: float) -> complex:
            return (1 - 1j * x) / (1 + 1j * x)  # -90 deg at x = 1

        plus, minus = np.exp(1j * p * a), np.exp(-1j * p * a)  # of the two sidebands w +- p rate
        cosine = 0.5j * ((1 + d) * plus * shift(1 + d) + (1 - d) * minus * shift(1 - d))
        sine = 0.5 * (-(1 + d) * plus + (1 - d) * minus)
        difference = np.angle((cosine - sine) * np.conj(cosine + sine) * np.exp(-2j * p * a))
        return a, difference / (2 * p)

    a, small = error(0.02)
    assert small == pytest.approx(-0.02 / (2 * W) * (1 - np.cos(2 * p * a)), abs=0.02 * 0.02 / W)
    _, one = error(1.0)
    assert one.min() / ARCSEC == pytest.approx(-16.4, abs=0.6) and one[:-1].mean() / ARCSEC == pytest.approx(
        -8.2, abs=0.3
    )


def test_analog_rebalance() -> None:
    """ET16: I/M_d has K_sg K/c above; at rest 1/K_tg; its size needs the square; the band is K_v."""
    Ktg, Ksg, K, c, tau, w = 0.05, 10.0, 3.0, 0.2, 1e-3, 4.0
    Kv, s = Ktg * Ksg * K / c, 1j * w
    b = 1.0 / (c * s * (tau * s + 1) + Ktg * Ksg * K)  # float angle per torque: c s (tau s + 1) b = M - K_tg K K_sg b
    assert Ksg * K * b == pytest.approx((Ksg * K / c) / (Kv + s * (tau * s + 1)))
    assert abs(Ksg * K * b) == pytest.approx((Ksg * K / c) / np.sqrt(w**2 + (Kv - tau * w**2) ** 2))
    assert abs(Ksg * K * b) != pytest.approx((Ksg * K / c) / np.sqrt(w**2 + (Kv - tau * w**2)), rel=0.01)
    assert (Ksg * K / c) / Kv == pytest.approx(1 / Ktg)


def test_binary_loop_counts_in_twos() -> None:
    """ET17: n+ + n- is fixed, so n+ - n- moves in steps of two."""
    clocks, saws = 1000, 200  # clocks in a saw period
    found = set()
    for wish in np.linspace(-3e-4, 3e-4, 61):
        left = plus = 0.0
        for _ in range(saws):  # first-order loop: what is left is carried over
            left += wish * clocks
            n = round((clocks + left) / 2)
            plus += n
            left -= 2 * n - clocks
        found.add(int(2 * plus - clocks * saws))
    assert all(n % 2 == 0 for n in found) and {0, 2, 4} <= found


def test_errors_of_the_binary_loop() -> None:
    """ET18: +(dI+ - dI-)/2 + 2 I dT(0)/T_s in 5-74; factor 2 in 5-76."""
    current, period, up, down, edge0, edge = 1.0, 1e-3, 2e-4, 5e-5, 3e-8, 7e-8

    def mean(b: float, dT: float) -> float:
        positive, negative = period * (1 + b) / 2 + dT, period * (1 - b) / 2 - dT
        return ((current + up) * positive - (current + down) * negative) / period

    bias = mean(0.0, edge0)
    assert bias == pytest.approx((up - down) / 2 + 2 * current * edge0 / period, rel=1e-3)
    assert abs(bias + (up - down) / 2 - 2 * current * edge0 / period) > 1e-4
    b = 0.4
    slope = (up + down) / 2 + 2 * current * (edge - edge0) / (b * period)
    assert (mean(b, edge) - bias) / b - current == pytest.approx(slope, rel=1e-3)


def test_sampled_loop() -> None:
    """ET22: hold factor 1 - 1/z; N_0 ends in a_1; the deadbeat loop has the numerator of 1 + D W equal to z^3."""
    J, T, z = 2.56, 5e-3, 1.3 + 0.4j
    held = control.sample_system(control.tf([1.0], [J, 0.0, 0.0]), T, "zoh")
    W = T**2 / (2 * J) * (z + 1) / (z - 1) ** 2
    assert held(z) == pytest.approx(W)
    Z = T**2 * z * (z + 1) / (2 * (z - 1) ** 3) / J  # of W(s)/s, that is of t^2/(2 J)
    assert (1 - 1 / z) * Z == pytest.approx(W) and abs((1 - z) * Z - W) > 1e-6
    # D(z) = (2 J/T^2) (1.25 z - 0.75)/(z + 0.75): (z - 1)^2 (z + 0.75) + (1.25 z - 0.75)(z + 1) = z^3
    numerator = np.polyadd(np.polymul([1, -2, 1], [1, 0.75]), np.polymul([1.25, -0.75], [1, 1]))
    assert numerator == pytest.approx([1, 0, 0, 0])
    # a_2 x'' + a_1 x' + a_0 x = 0 from x(0), x'(0): X = (a_2 s x + a_2 x' + a_1 x)/D
    a2, a1, a0, x, v, s = 2.0, 3.0, 5.0, 0.7, -0.4, 1.1
    t = np.linspace(0, 60, 600_001)
    r = np.roots([a2, a1, a0])
    c = np.linalg.solve(np.array([[1, 1], r]), [x, v])
    transform = np.trapezoid((c[0] * np.exp(r[0] * t) + c[1] * np.exp(r[1] * t)).real * np.exp(-s * t), t)
    D = a2 * s * s + a1 * s + a0
    assert transform == pytest.approx((a2 * s * x + a2 * v + a1 * x) / D, rel=1e-6)
    assert transform != pytest.approx((a2 * s * x + a2 * v + a0 * x) / D, rel=0.01)


def test_vibration_along_the_bisector() -> None:
    """ET24: 1 g along the bisector of I and S is cos 45 degrees of it along each; D_II with ET19."""
    D_IS, D_II, D_SS = 1e-3, 5e-5, 5e-5  # ERU/g2
    of = lambda x, z: D_IS * x * z + D_II * x * x + D_SS * z * z  # noqa: E731
    along = of(np.cos(np.pi / 4.0), np.sin(np.pi / 4.0))
    assert along == pytest.approx(5.5e-4) and of(1.0, 1.0) == pytest.approx(1.1e-3)
    greatest = max(of(np.cos(a), np.sin(a)) for a in np.linspace(0.0, np.pi, 721))
    assert greatest == pytest.approx(along)  # so no direction has the printed 1e-3
