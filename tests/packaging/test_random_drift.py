"""Blocks of random drift: spectra and Allan variances against closed forms at two steps, and in the gyros.

Statistics are of 2^15 samples with fixed seeds; every bound is below a tenth, so that a factor of 1.1 in a variance or
a PSD fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gyrobench.component.blocks.random_drift import INNER, OUTER, RATIO, RELAXATIONS
from gyrobench.component.numerics import normal
from gyrobench.packaging import load_part

Array = NDArray[np.float64]
N = 1 << 15
STEPS = (0.005, 0.02)  # s, of communication
B, K, Q, TAU, TAU_Q = 0.3, 0.2, 0.7, 1e5, 0.02
NAMES = ["a", "b", "c"]
#: variance and correlation time of each relaxation for B = 1
VARIANCES = np.array([OUTER**2, *[INNER**2] * (RELAXATIONS - 2), OUTER**2])
TAUS = RATIO ** -np.arange(float(RELAXATIONS))[::-1]


def play(one: Any, h: float, n: int, **parameters: float) -> Array:
    one.set(dict(parameters))
    one.initialize()
    rows = [one.get(NAMES)]
    for k in range(n):
        one.step(k * h, h)
        rows.append(one.get(NAMES))
    return np.array(rows).T


@pytest.fixture(scope="module")
def series() -> Iterator[Callable[[float], Array]]:
    """One run of all three blocks for each step: flicker, walk, quantization."""
    from toybench import TOYS

    from gyrobench.packaging.instance import make

    kept: dict[float, Array] = {}

    def of(h: float) -> Array:
        if h not in kept:
            one = make("drifting", "native", bench=TOYS)
            kept[h] = play(one, h, N, flicker=B, walk=K, quantization=Q, quantization_tau=TAU_Q, seed=5)[:, 1:]
            one.free()
        return kept[h]

    yield of


def psd_over(x: Array, h: float, expected: Callable[[Array], Array], first: int = 3) -> float:
    """Return the mean over frequency of periodogram / expected two-sided PSD (Hann: scatter sqrt(1.94 / bins))."""
    taper = np.hanning(x.size + 1)[:-1]
    p = np.abs(np.fft.rfft(taper * (x - x.mean()))) ** 2 * h / np.sum(taper**2)
    f = np.fft.rfftfreq(x.size, h)
    return float(np.mean(p[first:-1] / expected(f[first:-1])))


def allan(x: Array, m: int) -> float:
    """Return the Allan variance of means of m samples, overlapping: half the mean square of their differences."""
    total = np.concatenate([[0.0], np.cumsum(x)])
    means = (total[m:] - total[:-m]) / m
    return 0.5 * float(np.mean((means[m:] - means[:-m]) ** 2))


def test_bank_is_flicker_noise() -> None:
    """B2 / (2 pi f) within 1 % from 0.46 / tau to 0.055 / tau_0; Allan variance 2 ln 2 B2 / pi within 1.5 %.

    A process that is exact at the multiples of h = tau_j / 16, a = exp(-1/16), and held between has the PSD
    h sinc2(f h) (1 - a2) / |1 - a exp(2 pi i f h)|2, sinc(x) = sin(pi x) / (pi x): none at f = 1/h.
    """
    f = np.logspace(math.log10(0.46), math.log10(0.055 / TAUS[0]), 4000)
    s = np.sum(2.0 * VARIANCES * TAUS / (1.0 + (2.0 * math.pi * f[:, None] * TAUS) ** 2), axis=1)
    assert np.max(np.abs(2.0 * math.pi * f * s - 1.0)) < 0.01
    f = np.union1d(f, 16.0 / TAUS[5:])
    h, a = TAUS / 16.0, math.exp(-1.0 / 16.0)
    beside = np.abs(1.0 - a * np.exp(2j * math.pi * f[:, None] * h)) ** 2
    held = np.sum(VARIANCES * h * np.sinc(f[:, None] * h) ** 2 * (1.0 - a * a) / beside, axis=1)
    off = np.abs(2.0 * math.pi * f * held - 1.0)
    assert np.max(off) < 0.0135 and np.mean(off > 0.01) < 0.02
    assert VARIANCES.sum() == pytest.approx(5.59, abs=0.005)
    t = np.logspace(math.log10(30.0 * TAUS[0]), math.log10(0.03), 50)[:, None]  # s, of a Gauss-Markov process:
    gm = (
        2.0
        * VARIANCES
        * TAUS
        / t
        * (1.0 - TAUS / (2.0 * t) * (3.0 - 4.0 * np.exp(-t / TAUS) + np.exp(-2.0 * t / TAUS)))
    )
    assert np.max(np.abs(gm.sum(axis=1) / (2.0 * math.log(2.0) / math.pi) - 1.0)) < 0.015


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.long
def test_flicker(h: float, series: Callable[[float], Array]) -> None:
    """PSD of the samples of all relaxations, that of flicker noise; Allan variance from their covariances."""
    x = series(h)[0]
    a = np.exp(-h / (TAU * TAUS))

    def sampled(f: Array) -> Array:
        c = np.cos(2.0 * math.pi * f * h)[:, None]
        return B**2 * h * np.sum(VARIANCES * (1.0 - a**2) / (1.0 - 2.0 * a * c + a**2), axis=1)

    assert psd_over(x, h, sampled) == pytest.approx(1.0, abs=4.0 * math.sqrt(1.94 / (N / 2)))
    low = psd_over(x, h, lambda f: np.where(f < 2.3, B**2 / (2.0 * math.pi * f), np.inf))
    share = np.mean(np.fft.rfftfreq(N, h)[3:-1] < 2.3)
    assert low / share == pytest.approx(1.0, abs=0.08)
    lags = np.arange(32)
    for m in (1, 2, 8):
        cov = B**2 * np.sum(VARIANCES * a[None, :] ** lags[:, None], axis=1)
        weights = np.concatenate([-np.ones(m), np.ones(m)]) / m
        expected = 0.5 * sum(weights[i] * weights[j] * cov[abs(i - j)] for i in range(2 * m) for j in range(2 * m))
        assert allan(x, m) == pytest.approx(expected, rel=4.0 * math.sqrt(1.5 * m / N))


@pytest.mark.parametrize("h", STEPS)
def test_rate_random_walk(h: float, series: Callable[[float], Array]) -> None:
    """PSD of the samples K2 h2 / (4 sin2(pi f h)); Allan variance of means of m samples K2 tau (2 m2 + 1) / (6 m2)."""
    x = series(h)[1]
    found = psd_over(x, h, lambda f: K**2 * h**2 / (4.0 * np.sin(math.pi * f * h) ** 2), first=10)
    assert found == pytest.approx(1.0, abs=4.0 * math.sqrt(1.94 / (N / 2)))
    for m in (1, 2, 8):
        expected = K**2 * m * h * (2 * m**2 + 1) / (6 * m**2)
        assert allan(x, m) == pytest.approx(expected, rel=4.0 * math.sqrt(1.5 * m / N) + 0.01)


@pytest.mark.parametrize("h", STEPS)
def test_quantization(h: float, series: Callable[[float], Array]) -> None:
    """The rate is the difference of angle errors: 4 sin2 / h2 times their PSD, Q2 (3 - 4 r + r2) / tau2."""
    x = series(h)[2]
    a = math.exp(-h / TAU_Q)

    def sampled(f: Array) -> Array:
        angle = Q**2 * h * (1.0 - a**2) / (1.0 - 2.0 * a * np.cos(2.0 * math.pi * f * h) + a**2)
        return angle * (2.0 * np.sin(math.pi * f * h) / h) ** 2

    assert psd_over(x, h, sampled) == pytest.approx(1.0, abs=4.0 * math.sqrt(1.94 / (N / 2)))
    for m in (1, 2, 8, 24):
        r = a**m
        expected = Q**2 * (3.0 - 4.0 * r + r**2) / (m * h) ** 2
        assert allan(x, m) == pytest.approx(expected, rel=0.08)
        if m * h > 5.0 * TAU_Q:
            assert allan(x, m) == pytest.approx(3.0 * Q**2 / (m * h) ** 2, rel=0.08)


def test_every_relaxation(instance: Callable[..., Any]) -> None:
    """Each is exact at the multiples of a sixteenth of its correlation time; of streams 0 to 11, then 12 and 13."""
    h, n, seed = 3.0, 5, 9
    sizes = {"flicker": B, "walk": K, "quantization": Q, "quantization_tau": TAU_Q, "seed": seed}
    got = {t: play(instance("drifting", t, toy=True), h, n, **sizes) for t in ("plain", "native", "python")}
    assert np.array_equal(got["plain"], got["native"]) and np.array_equal(got["plain"], got["python"])
    xi = np.array([[normal(seed, j, k) for j in range(RELAXATIONS + 2)] for k in range(n + 1)])
    x = B * xi[0, :RELAXATIONS]
    error, walk = Q * xi[0, -1], 0.0
    rows = [(np.sqrt(VARIANCES) @ x, 0.0, 0.0)]
    for k in range(1, n + 1):
        held = np.floor(k * h / (TAU * TAUS / 16.0)) - np.floor((k - 1) * h / (TAU * TAUS / 16.0))
        a = np.exp(-held / 16.0)
        x = a * x + np.sqrt(1.0 - a**2) * B * xi[k, :RELAXATIONS]
        walk += K * math.sqrt(h) * xi[k, -2]
        r = math.exp(-h / TAU_Q)
        later = r * error + math.sqrt(1.0 - r**2) * Q * xi[k, -1]
        rows.append((np.sqrt(VARIANCES) @ x, walk, (later - error) / h))
        error = later
    assert pytest.approx(np.array(rows), rel=1e-9) == got["plain"].T


@pytest.mark.parametrize("h", STEPS)
def test_rate_ramp(h: float, instance: Callable[..., Any]) -> None:
    """A gyro without other noise: the Allan variance of a ramp R is R2 tau2 / 2 exactly."""
    one = instance("floated_gyro", "native")
    one.set({"ramp": 2e-6, "markov": 0.0, "white": 0.0})
    one.initialize()
    x = []
    for k in range(64):
        one.step(k * h, h)
        x += one.get(["drift"])
    for m in (1, 2, 8):
        assert allan(np.array(x), m) == pytest.approx((2e-6 * m * h) ** 2 / 2.0, rel=1e-6)


GYROS = (("floated_gyro", ""), ("compliant_gyro", ""), ("gyro_2dof", "_x"), ("gyro_2dof", "_y"))


@pytest.mark.parametrize(("gyro", "channel"), GYROS)
def test_in_the_gyros(gyro: str, channel: str, instance: Callable[..., Any]) -> None:
    """The drift rate is that without them plus all four; their ports come last: the others keep their streams."""
    names = [n.name for n in load_part(gyro).noises]
    old = [n for n in names if n.split("_")[0] in ("turn", "markov", "white", "pickoff")]
    assert names[: len(old)] == old and load_part(gyro).streams[: len(old)] == list(range(len(old)))
    sizes = {"flicker": 3e-7, "walk": 2e-6, "quantization": 1e-7, "ramp": -4e-4}
    bare, full = instance(gyro, "native"), instance(gyro, "native")
    full.set({f"{n}{channel}": x for n, x in sizes.items()})
    for one in (bare, full):
        one.initialize()
        for k in range(20):
            one.step(k * 0.01, 0.01)
    own = [f"{n}{channel}_{what}" for n, what in (("flicker", "value"), ("walk", "value"), ("quantization", "rate"))]
    values = full.get(own)
    assert all(x != 0.0 for x in values)
    (before,), (after,) = bare.get([f"drift{channel}"]), full.get([f"drift{channel}"])
    assert after - before == pytest.approx(sum(values) - 4e-4 * 0.2, rel=1e-9)
    assert bare.get(own) == [0.0, 0.0, 0.0]
