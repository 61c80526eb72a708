"""The live estimator of drift coefficients: generalized least squares, the figures of EST-KF-COEFF, what it refuses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from polar_drift import DPH, PRIOR, Day, Noise, draw, instance, least_squares, play, priors
from scipy import stats

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

A, SD = ([f"{n}[{k}]" for k in range(1, 6)] for n in ("A", "sd"))
WIDE = np.full(5, 20.0 * DPH)
ALL = Noise(white=0.02 * DPH)


@pytest.fixture(scope="module")
def one() -> Iterator[Any]:
    part = instance()
    yield part
    part.free()


def uneven() -> Day:
    """A day of windows of 600 s: one longer, its neighbour shorter, one late (a gap), and two missing."""
    t0 = np.arange(0.0, 86400.0, 600.0)
    t1 = t0 + 600.0
    t1[50] -= 100.0
    t0[51] -= 100.0
    t0[80] += 300.0
    return Day(t0, t1)


# ------------------------------------------------------------------------------------- least squares
def test_end_is_generalized_least_squares(one: Any) -> None:
    """With the prior of EST-KF-COEFF to 1e-14 deg/h (there 1.5e-14), sd to 1e-10.

    Windows uneven, with gaps and shared readings.  Missing windows: those with valid = 0 hold anything.
    """
    day, rng = uneven(), np.random.default_rng(1)
    _, z = draw(day, ALL, rng, 1)
    valid = np.ones(day.t0.size)
    valid[[20, 21, 100]] = 0.0
    there = valid > 0.5
    expected, P = least_squares(Day(day.t0[there], day.t1[there]), ALL, z[0][there])
    wild = np.where(there, z[0], 1.0)
    found = play(one, day, wild, [*A, "w", *SD, "windows"], ALL, valid, **priors(PRIOR))[-1]
    assert np.abs(found[:6] - expected).max() < 1e-14 * DPH
    assert found[6:11] == pytest.approx(np.sqrt(np.diag(P))[:5], rel=1e-10) and found[11] == there.sum()


def test_end_with_next_to_no_prior(one: Any) -> None:
    """20 deg/h each: 1e8 times the variance of the end; still within 1e-5 of the standard deviations."""
    day = uneven()
    _, z = draw(day, ALL, np.random.default_rng(2), 1)
    expected, P = least_squares(day, ALL, z[0], WIDE)
    found = play(one, day, z[0], A, ALL)[-1]
    assert (np.abs(found - expected[:5]) / np.sqrt(np.diag(P))[:5]).max() < 1e-5


def test_every_window_on_the_way(one: Any) -> None:
    """Not only the end: after each of the first 30 windows."""
    day = Day.of(hours=5.0, dT=600.0)
    _, z = draw(day, ALL, np.random.default_rng(3), 1)
    found = play(one, day, z[0], [*A, *SD], ALL, **priors(PRIOR))
    for k in range(30):
        x, P = least_squares(Day(day.t0[: k + 1], day.t1[: k + 1]), ALL, z[0][: k + 1])
        assert np.abs(found[k, :5] - x[:5]).max() < 1e-12 * DPH
        assert found[k, 5:] == pytest.approx(np.sqrt(np.diag(P))[:5], rel=1e-9)


def test_correlation_between_coefficients(one: Any) -> None:
    day = Day.of(hours=8.0, dT=600.0)
    _, P = least_squares(day, ALL, np.zeros(day.t0.size))
    sd = np.sqrt(np.diag(P))[:5]
    rho = (P[:5, :5] / np.outer(sd, sd))[np.tril_indices(5, -1)]
    found = play(one, day, np.zeros(day.t0.size), ["correlation"], ALL, **priors(PRIOR))[-1, 0]
    assert found == pytest.approx(rho[np.argmax(np.abs(rho))], rel=1e-7)


# --------------------------------------------------------------------------------------- its figures
def test_figures_of_the_source(one: Any) -> None:
    """24 h of 100 s windows: sd(a0) 0.00101, harmonics 0.0014 deg/h, rule rms sqrt(2 tau/T) = 0.00102; without a prior
    0.203, 0.0092, 0.00101, 0.00072 deg/h after 6, 12, 24, 48 h.
    """
    for hours, expected in ((6, 0.203), (12, 0.0092), (24, 0.00101), (48, 0.00072)):
        day = Day.of(hours)
        sd = play(one, day, np.zeros(day.t0.size), SD, Noise())[-1] / DPH
        assert sd[0] == pytest.approx(expected, rel=0.02), hours
    sd = play(one, Day.of(), np.zeros(864), SD, Noise(), **priors(PRIOR))[-1] / DPH
    assert sd[0] == pytest.approx(0.00101, abs=1e-5) and sd[1:] == pytest.approx(np.full(4, 0.0014), abs=5e-5)


def nees(one: Any, day: Day, noise: Noise, x: np.ndarray, z: np.ndarray, **believed: float) -> np.ndarray:
    """Of the coefficients and w; the covariance is that of least squares under what the filter believes."""
    belief = Noise(**{**vars(noise), **believed})
    _, P = least_squares(day, belief, z[0])
    error = np.array([play(one, day, row, [*A, "w"], belief, **priors(PRIOR))[-1] for row in z]) - x
    if belief.rms == 0.0:
        error, P = error[:, :5], P[:5, :5]
    return np.asarray(np.sum(error * np.linalg.solve(P, error.T).T, axis=1))


def test_consistent(one: Any) -> None:
    """100 days (the figure of 1,000 is in the README): NEES of six states within its bounds of 99.9 %; NIS likewise."""
    day, noise = Day.of(dT=400.0), Noise()
    x, z = draw(day, noise, np.random.default_rng(5), 100)
    low, high = stats.chi2.ppf([0.0005, 0.9995], 600) / 100
    assert low < np.mean(nees(one, day, noise, x, z)) < high
    mean = np.mean([play(one, day, row, ["mean_nis", "consistent"], noise, **priors(PRIOR))[-1] for row in z], axis=0)
    assert abs(mean[0] - 1.0) < 3.3 * np.sqrt(2.0 / z.size) and mean[1] > 0.97


@pytest.mark.long
def test_drift_taken_white_understates(one: Any) -> None:
    """EST-KF-COEFF: NEES(5) 161 where w is taken white (variance rms2 a window), although the errors hardly grow.

    Its mean nis is below 1 and neighbouring innovations agree.  It must not say that the test may stop.
    """
    day, noise = Day.of(), Noise()
    x, z = draw(day, noise, np.random.default_rng(6), 30)
    wrong = {"rms": 0.0, "white": noise.rms * 10.0}
    assert 100.0 < np.mean(nees(one, day, noise, x, z, **wrong)) < 240.0
    names = ["determined", "may_stop", "mean_nis", "neighbours"]
    wanted = {f"wanted[{k}]": 0.01 * DPH for k in range(1, 6)}
    ends = [play(one, day, row, names, Noise(**{**vars(noise), **wrong}), **wanted)[-1] for row in z]
    determined, may_stop, mean, neighbours = np.mean(ends, axis=0)
    assert determined == 1.0 and may_stop == 0.0 and mean < 1.0 and neighbours > 0.5


# ------------------------------------------------------------------------------------------ may stop
def test_may_stop_where_the_wanted_deviation_is_reached(one: Any) -> None:
    """At the first window after which every sd is below it, not before; 0 is not asked for."""
    day, noise = Day.of(dT=600.0), Noise()
    _, z = draw(day, noise, np.random.default_rng(7), 1)
    wanted = {f"wanted[{k}]": 0.003 * DPH for k in range(1, 6)}
    found = play(one, day, z[0], [*SD, "determined", "may_stop"], noise, **wanted)
    first = int(np.argmax(found[:, 6]))
    reached = np.all(found[:, :5] <= 0.003 * DPH, axis=1) & (found[:, 5] > 0.5)
    assert 0 < first == int(np.argmax(reached)) < 143 and found[first:, 6].all()
    only_mean = play(one, day, z[0], [*SD, "may_stop"], noise, **{**wanted, **dict.fromkeys(list(wanted)[1:], 0.0)})
    assert only_mean[np.argmax(only_mean[:, 5]), 0] <= 0.003 * DPH
    assert int(np.argmax(only_mean[:, 5])) < first


def test_noise_larger_than_stated_forbids_to_stop(one: Any) -> None:
    day, noise = Day.of(dT=600.0), Noise()
    _, z = draw(day, noise, np.random.default_rng(8), 1)
    _, louder = draw(day, Noise(rms=0.012 * DPH, sigma=0.3 * DPH), np.random.default_rng(8), 1)
    wanted = {f"wanted[{k}]": 0.003 * DPH for k in range(1, 6)}
    names = ["may_stop", "consistent", "mean_nis"]
    assert play(one, day, z[0], names, noise, **wanted)[-1, :2].tolist() == [1.0, 1.0]
    may, consistent, mean = play(one, day, louder[0], names, noise, **wanted)[-1]
    assert may == 0.0 and consistent == 0.0 and mean > 3.0


def test_part_of_a_turn_is_not_determined(one: Any) -> None:
    """Two hours, 30 degrees: the mean and the harmonics are one thing; nothing stops, whatever is wanted."""
    day = Day.of(hours=2.0)
    wanted = {f"wanted[{k}]": 19.0 * DPH for k in range(1, 6)}
    found = play(one, day, np.zeros(day.t0.size), ["determined", "may_stop"], Noise(), **wanted)
    assert not found.any()


def test_a_new_phase_begins_anew(one: Any) -> None:
    day = Day.of(dT=600.0)
    _, z = draw(day, ALL, np.random.default_rng(9), 1)
    phase = np.where(np.arange(144) < 60, 2.0, 4.0)
    found = play(one, day, z[0], [*A, *SD, "windows"], ALL, phase=phase)
    alone = play(one, Day(day.t0[60:], day.t1[60:]), z[0][60:], [*A, *SD, "windows"], ALL)
    assert (found[60:] == alone).all()


def test_a_step_without_a_window_changes_nothing(one: Any) -> None:
    """The part steps a million times between two windows."""
    day = Day.of(hours=1.0, dT=600.0)
    z = np.full(6, 1e-8)
    part = load_part("estimator_coefficients")()
    part.initialize()
    t, T = 0.0, 600.0
    for k in range(6):
        travel = 7.2921159e-5 * T
        part.count, part.window_phase, part.t_start, part.t_end = k + 1.0, 2.0, k * T, (k + 1) * T
        part.angle_start, part.angle_end, part.omega_E = k * travel, (k + 1) * travel, z[k] - travel / T
        for _ in range(5):
            part.do_step(t, 1.0)
            t += 1.0
    assert list(part.A) == pytest.approx(play(one, day, z, A)[-1].tolist(), rel=1e-9)
    assert part.windows == 6.0


def test_sign(one: Any) -> None:
    """omega_d = theta' + omega_E,x, precession sign [ER38]: a table in mount S (omega_E = -W) that lags W by
    0.3 deg/h has a drift of -0.3 deg/h.
    """
    part = load_part("estimator_coefficients")()
    part.initialize()
    W, T = 7.2921159e-5, 600.0
    for k in range(144):
        rate = W - 0.3 * DPH
        part.count, part.window_phase, part.t_start, part.t_end = k + 1.0, 2.0, k * T, (k + 1) * T
        part.angle_start, part.angle_end, part.omega_E = k * T * rate, (k + 1) * T * rate, -W
        part.do_step(float(k), 1.0)
    assert part.A[0] / DPH == pytest.approx(-0.3, abs=1e-6)
    assert max(abs(x) for x in list(part.A)[1:]) / DPH < 1e-6


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"tau": 0.0}, "tau = 0 s must be > 0"),
        ({"rms": 0.0, "white": 0.0}, "rms, white and sigma are all 0"),
        ({"prior": [0.0] * 5}, r"prior\[1\] = 0 rad/s must be > 0"),
        ({"wanted": [1e-3] * 5}, "wanted must be below prior"),
        ({"sigma": -1.0}, "sigma = -1 rad must be >= 0"),
    ],
)
def test_refusals(values: dict[str, Any], text: str) -> None:
    with pytest.raises(ComponentError, match=text):
        load_part("estimator_coefficients")(**values).initialize()


def test_a_window_that_ends_before_it_begins() -> None:
    part = load_part("estimator_coefficients")()
    part.initialize()
    part.count, part.t_start, part.t_end = 1.0, 10.0, 10.0
    with pytest.raises(ComponentError, match="t_end = 10 s is not after t_start = 10 s"):
        part.do_step(0.0, 1.0)


def test_an_angle_that_is_not_measured_is_refused() -> None:
    part = load_part("estimator_coefficients")()
    part.initialize()
    part.count, part.t_end, part.angle_end = 1.0, 10.0, float("nan")
    with pytest.raises(ComponentError, match="angle_end"):
        part.do_step(0.0, 1.0)


# ------------------------------------------------------------------------------------------- errata
def test_the_printed_third_state_is_redundant() -> None:
    """Hu 1981 carries Omega = h' A as a state beside A and w [ER37]: the same coefficients, a singular covariance.

    A filter written out with (w, Omega, A), Omega(k+1) = h(k+1)' A, z = w + Omega + V, against (w, A).
    """
    rng, n, phi, s_w, s_v = np.random.default_rng(10), 60, 0.95, 1.0, 0.3
    theta = np.linspace(0.0, 5.0, n)
    h = np.column_stack([np.ones(n), np.cos(theta), np.sin(theta)])
    z = h @ [1.0, 0.5, -0.3] + rng.normal(size=n)
    found = []
    for extra in (False, True):
        size = 5 if extra else 4
        P = np.diag([s_w**2, *([0.0] if extra else []), 1.0, 1.0, 1.0])
        x = np.zeros(size)
        for k in range(n):
            F = np.diag([phi if k else 1.0, *([0.0] if extra else []), 1.0, 1.0, 1.0])
            if extra:
                F[1, 2:] = h[k]
            Q = np.zeros((size, size))
            Q[0, 0] = s_w**2 * (1.0 - phi**2) if k else 0.0
            x, P = F @ x, F @ P @ F.T + Q
            row = np.array([1.0, 1.0, 0.0, 0.0, 0.0]) if extra else np.array([1.0, *h[k]])
            S = row @ P @ row + s_v**2
            K = P @ row / S
            x, P = x + K * (z[k] - row @ x), P - np.outer(K, row @ P)
        found.append(x[-3:])
        smallest = np.linalg.eigvalsh(P)[0] / np.linalg.eigvalsh(P)[-1]
        assert abs(smallest) < 1e-14 if extra else smallest > 1e-6
    assert found[0] == pytest.approx(found[1], abs=1e-13)
