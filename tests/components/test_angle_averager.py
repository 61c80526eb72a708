"""Mean of angle readings on the circle with an error table: figures of the method, refusals.  [EST-ANGLE-AVG]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make
from scipy import stats
from scipy.interpolate import CubicSpline

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

ARCSEC = math.pi / 648000.0
TURN = 2.0 * math.pi
T = 0.1


def wrap(x):
    return (np.asarray(x) + math.pi) % TURN - math.pi


def averager(**given):
    part = load_part("angle_averager")(Ts=T, **given)
    part.initialize()
    return part


def played(part, z, valid=None):
    """estimate, t_mean, sd, spread, count, corrected after each reading."""
    rows = []
    for k, x in enumerate(z):
        part.z, part.valid = float(x), 1.0 if valid is None else float(valid[k])
        part.do_step(k * T, T)
        rows.append([part.estimate, part.t_mean, part.sd, part.spread, part.count, part.corrected])
    return np.array(rows)


def tabulated(delta, points):
    """Values of an error over a cycle, closed, filled up to the length of the part's table."""
    x = np.linspace(0.0, 1.0, points + 1)
    values = [float(delta(u)) for u in x[:-1]]
    values.append(values[0])
    return values + [0.0] * (361 - len(values))


def test_across_zero():
    """Readings at 359.999 and 0.001 deg: true mean to rounding, as scipy's circmean; the plain mean is 180 deg off, the
    mean of the larger class (above 300, below 10 deg) 2.7 arcsec at s = 2 arcsec."""
    rng = np.random.default_rng(9)
    worst = plain = larger = 0.0
    for _ in range(60):
        errors = rng.uniform(-2.0, 2.0) * 2.0 * ARCSEC + 2.0 * ARCSEC * rng.normal(size=10)
        z = errors % TURN
        mean = played(averager(), z)[-1, 0]
        worst = max(worst, abs(wrap(mean - errors.mean())))
        assert wrap(mean - stats.circmean(z)) == pytest.approx(0.0, abs=5e-15)
        plain = max(plain, abs(wrap(z.mean() - errors.mean())))
        high = z > math.radians(300.0)
        chosen = z[high] if high.sum() > 5 else z[~high]
        larger = max(larger, abs(wrap(chosen.mean() - errors.mean())))
    assert worst < 3e-15
    assert plain > 1.0 and larger > 1.0 * ARCSEC
    assert played(averager(n=2), np.radians([359.999, 0.001]))[-1, 0] == pytest.approx(0.0, abs=3e-15)


@pytest.mark.long
def test_ten_readings_of_10_arcsec2_have_1_arcsec2():
    one = make("angle_averager", "native")
    one.set({"Ts": T, "sigma": math.sqrt(10.0) * ARCSEC})
    one.initialize(0.0)
    rng, means, spreads = np.random.default_rng(1), [], []
    for k in range(30000):
        one.set({"z": float((math.sqrt(10.0) * ARCSEC * rng.normal()) % TURN)})
        one.step(k * T, T)
        if k % 10 == 9:
            mean, sd, spread, count = one.get(["estimate", "sd", "spread", "count"])
            means.append(wrap(mean))
            spreads.append(spread)
            assert count == (k + 1) // 10 and sd == pytest.approx(ARCSEC, rel=1e-12)
    one.free()
    # 3000 means: their variance is known to 2.6 %
    assert np.var(np.array(means) / ARCSEC) == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.square(spreads)) == pytest.approx(10.0 * ARCSEC**2, rel=0.05)


def test_recursion_with_a_prior_is_the_estimate_of_bayes():
    """p_k is the variance before reading k; with the one after it in its place the result is another one."""
    rng = np.random.default_rng(3)
    z, s, s0, expected = 1.0 + 1e-3 * rng.normal(size=10), 1e-3, 2e-3, 1.0
    rows = played(averager(sigma=s, sigma_0=s0, prior=expected), z)
    weights = np.r_[1.0 / s0**2, np.full(10, 1.0 / s**2)]
    bayes = np.average(np.r_[expected, z], weights=weights)
    assert rows[-1, 0] == pytest.approx(bayes, abs=1e-14)
    assert rows[-1, 2] == pytest.approx(weights.sum() ** -0.5, rel=1e-12)
    for k in range(1, 10):  # p_k = p_0 R/(k p_0 + R) before reading k is what reading k - 1 leaves
        assert rows[k - 1, 2] ** 2 == pytest.approx(s0**2 * s**2 / (k * s0**2 + s**2), rel=1e-12)
    x, p = expected, s0**2
    for reading in z:
        p = p * s**2 / (p + s**2)
        x += p / (p + s**2) * (reading - x)
    assert abs(x - bayes) > 5e-6
    # a wide prior: the arithmetic mean (6-23)
    assert played(averager(sigma=s, sigma_0=1.0, prior=expected), z)[-1, 0] == pytest.approx(z.mean(), abs=1e-8)


def test_the_mean_of_a_moving_table_belongs_to_its_mean_time():
    """Earth rate, T = 0.1 s: -0.752 arcsec for k-5 ... k+4, 0 for five before and after, -6.77 for the last ten."""
    w = 15.041 * ARCSEC
    t = T * np.arange(1, 31)
    rows = played(averager(), (w * t) % TURN)
    for last in (9, 19, 29):
        at = {lag: (rows[last, 0] - w * t[last - lag]) / ARCSEC for lag in (0, 4)}
        assert at[4] == pytest.approx(-0.752, abs=1e-3) and at[0] == pytest.approx(-6.77, abs=1e-2)
        assert rows[last, 0] == pytest.approx(w * rows[last, 1], abs=1e-15)
    centred = played(averager(mode=1), (w * t) % TURN)
    assert centred[9, 4] == 0.0 and centred[10, 4] == 1.0
    for k in range(10, 30):
        assert centred[k, 1] == pytest.approx(t[k - 5], abs=1e-12)
        assert centred[k, 0] == pytest.approx(w * t[k - 5], abs=1e-15)
    assert centred[-1, 2] == pytest.approx(2.0 * ARCSEC / math.sqrt(10.0))


def test_a_gap_begins_the_centred_window_anew():
    valid = np.ones(40)
    valid[15] = 0.0
    count = played(averager(mode=1), 1e-6 * np.arange(40), valid)[:, 4]
    assert count[14] == 5.0 and count[25] == 5.0 and count[26] == 6.0
    kept = played(averager(), 1e-6 * np.arange(40), valid)
    assert kept[-1, 4] == 3.0  # 39 readings in the recursive mode: three means of ten


@pytest.mark.parametrize(("refine", "least", "most"), [(0, 0.02, 0.024), (1, 5e-5, 3e-4), (2, 0.0, 1e-4)])
def test_error_table(refine, least, most):
    """5 arcsec at 360 cycles a turn: 0.022 arcsec are left by the table at the reading, 1.5e-4 by one more step."""
    part = averager(points=180, cycles=360, refine=refine,
                    table=tabulated(lambda u: 5.0 * ARCSEC * math.sin(TURN * u), 180))  # fmt: skip
    theta = np.linspace(1.0, 1.0 + 2.0 * TURN / 360.0, 200)
    left = played(part, theta + 5.0 * ARCSEC * np.sin(360.0 * theta))[:, 5] - theta
    assert least < np.abs(left).max() / ARCSEC < most


def test_the_table_is_interpolated_on_the_circle():
    """Across its end as inside, against the periodic spline; 36 points of two harmonics: 1e-4 of the amplitude."""
    delta = lambda u: 3.0 * math.sin(TURN * u) + math.cos(2.0 * TURN * u)  # noqa: E731
    values = tabulated(delta, 36)
    spline = CubicSpline(np.linspace(0.0, TURN, 37), values[:37], bc_type="periodic")
    part = averager(points=36, refine=0, table=[1e-3 * x for x in values])
    for angle in np.r_[np.linspace(-0.4, 0.4, 41), np.linspace(2.0, 9.0, 50)]:
        found = 1e3 * part.error(float(angle))
        assert found == pytest.approx(float(spline(angle % TURN)), abs=2e-3)
        assert found == pytest.approx(delta(angle / TURN), abs=2e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sigma": 0.0}, "sigma = 0.* > 0"),
        ({"n": 0}, "n = 0.* >= 1"),
        ({"mode": 1, "n": 9}, "n = 9 in mode 1: must be even"),
        ({"mode": 1, "n": 64}, "62 readings at most"),
        ({"points": 3}, "a table needs 4 intervals or more"),
        ({"points": 4, "table": [0.0, 1e-5, 0.0, -1e-5, 1e-5] + [0.0] * 356}, "the table is not closed"),
    ],
)
def test_refused(given, words):
    with pytest.raises(ComponentError, match=words):
        averager(**given)


@pytest.mark.parametrize("mode", [0, 1])
def test_a_jump_is_refused(mode):
    z = np.where(np.arange(30) < 12, 0.1, 2.0)
    with pytest.raises(ComponentError, match="more than 90 deg away"):
        played(averager(mode=mode), z)
