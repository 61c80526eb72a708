"""Measures of loops against signals whose answers are known by hand."""

from __future__ import annotations

import math
import types

import numpy as np
import pytest
from scipy.signal import lfilter

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.loops import loop_curves
from gyrobench.reduction.loops.loop_drift import drift
from gyrobench.reduction.loops.loop_measures import cross_axis, gates, phasor, response, step, step_noise_std
from gyrobench.reduction.setup.window_checks import ReductionError

DT = 1e-3


def times(length: float, start: float = 0.0) -> np.ndarray:
    return start + DT * np.arange(round(length / DT))


# ------------------------------------------------------------------------------------------- sines
def test_phasor_of_a_sine_beside_a_mean_and_a_slope() -> None:
    """3 cos(wt + 0.7) = Re(3 e^(j 0.7) e^(j w t)); a mean and a drift do not touch it."""
    t = times(2.0, 5.0)
    y = 3.0 * np.cos(2 * np.pi * 4.0 * t + 0.7) + 0.2 - 0.5 * t
    assert phasor(t, y, 4.0) == pytest.approx(3.0 * np.exp(0.7j), abs=1e-12)


def test_response_of_a_first_order_lag() -> None:
    """1/(1 + j w T), T = 0.05 s, at 3 Hz: the steady sine through the lag, written by hand."""
    t, w, lag = times(4.0), 2 * np.pi * 3.0, 0.05
    x = np.sin(w * t)
    y = np.sin(w * t - math.atan(w * lag)) / math.hypot(1.0, w * lag)
    p = response(t, x, y, 3.0)
    assert p.value == pytest.approx(1.0 / (1.0 + 1j * w * lag), abs=1e-12)
    assert p.coherence == pytest.approx(1.0, abs=1e-12)
    assert p.u is not None and p.u < 1e-9


@pytest.mark.long
def test_uncertainty_covers_and_coherence_falls_with_noise() -> None:
    """White noise of sigma s on y: a phasor of N samples has variance 2 s2/N in each part, so u = s sqrt(2/N) / |Y|
    = 0.3 sqrt(2/8000) / 0.5 = 9.5e-3; over 200 draws the mean of u meets it to 5 %, and 95 % of the phases lie inside
    the t interval of 7 degrees of freedom (2.36 u; 200 draws: 0.90 to 0.99)."""
    rng = np.random.default_rng(11)
    t = times(8.0)
    x = np.sin(2 * np.pi * 2.0 * t)
    found = [response(t, x, 0.5 * x + 0.3 * rng.standard_normal(t.size), 2.0) for _ in range(200)]
    assert np.mean([p.u for p in found]) == pytest.approx(0.3 * math.sqrt(2 / 8000) / 0.5, rel=0.05)
    inside = [abs(np.angle(p.value)) < 2.36 * p.u for p in found]
    assert 0.90 <= np.mean(inside) <= 0.99
    assert 0.99 < np.mean([p.coherence for p in found]) < 1.0
    noise = [response(t, x, rng.standard_normal(t.size), 2.0).coherence for _ in range(50)]
    assert np.mean(noise) == pytest.approx(1 / 8, abs=0.08)  # nothing but noise: 1 / segments


def test_response_refuses() -> None:
    t = times(0.4)
    with pytest.raises(ReductionError, match="shorter than one period"):
        response(t, np.sin(t), np.sin(t), 2.0)
    with pytest.raises(ReductionError, match="too coarse"):
        response(t, np.sin(t), np.sin(t), 300.0)
    with pytest.raises(ReductionError, match="no component at this frequency"):
        response(times(1.0), np.zeros(1000), np.ones(1000), 5.0)


# ------------------------------------------------------------------------------------------- steps
def test_step_of_a_second_order_system() -> None:
    """1 - e^(-z w t)(cos wd t + z w/wd sin wd t), z = 0.4, w = 20: overshoot e^(-pi z / sqrt(1 - z2)) = 25.38 %;
    settling times from the same formula on a fine grid."""
    z, w = 0.4, 20.0
    wd = w * math.sqrt(1 - z * z)

    def y(t: np.ndarray) -> np.ndarray:
        return 1 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t))

    t = times(3.0, 7.0)
    found = step(t, 2.0 + 0.5 * y(t - 7.0), np.full(100, 2.0))
    assert found.initial == 2.0
    assert found.change == pytest.approx(0.5, abs=1e-9)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * z / math.sqrt(1 - z * z)), rel=1e-4)
    fine = np.linspace(0, 2, 2_000_001)
    for band, got in ((0.05, found.settled_5), (0.02, found.settled_2)):
        assert got == pytest.approx(fine[np.flatnonzero(np.abs(y(fine) - 1) > band)[-1]], abs=2e-5)


def test_step_that_goes_down_and_one_that_never_settles() -> None:
    t = times(1.0)
    down = step(t, -np.exp(-0.0 * t) + np.exp(-20 * t), np.zeros(10))
    assert down.change == pytest.approx(-1.0, abs=1e-7) and down.overshoot == pytest.approx(0.0, abs=1e-6)
    assert down.settled_5 == pytest.approx(math.log(20.0) / 20.0, abs=1e-5)
    ramp = step(t, t, np.zeros(0))
    assert ramp.settled_5 is None and ramp.slope == pytest.approx(1.0, rel=1e-9)
    still = step(t, np.zeros(t.size), np.zeros(0))
    assert still.change == 0.0 and still.settled_5 is None


def test_uncertainty_of_a_change() -> None:
    """Means of 100 (last tenth) and 400 samples of sigma 0.1: u = 0.1 sqrt(1/100 + 1/400) = 1.118e-2; scatter of 400
    draws agrees to 10 %."""
    rng = np.random.default_rng(3)
    t = times(1.0)
    found = [step(t, 1 + 0.1 * rng.standard_normal(1000), 0.1 * rng.standard_normal(400)) for _ in range(400)]
    assert np.std([s.change for s in found]) == pytest.approx(0.1 * math.sqrt(1 / 100 + 1 / 400), rel=0.1)
    assert np.mean([s.u_change for s in found]) == pytest.approx(0.1 * math.sqrt(1 / 100 + 1 / 400), rel=0.03)


def test_scatter_of_a_change_knows_slow_noise() -> None:
    """A random walk of step s: over a gap of n samples between two short means a change has s sqrt(n) = 0.01 sqrt(200),
    less a third of each mean's length: n - (before + after) / 3 ... by hand 200 - 20/3 - 10/3 = 190, to 10 % over 400
    records; white noise of 0.1: 0.1 sqrt(1/20 + 1/10).  8000 samples are 38 pieces: both times
    t(0.975, 37) / 1.96 = 1.034."""
    rng = np.random.default_rng(9)
    walks = [step_noise_std(np.cumsum(0.01 * rng.standard_normal(8000)), 20, 190, 10) for _ in range(100)]
    assert np.sqrt(np.mean(np.square(walks))) == pytest.approx(1.034 * 0.01 * math.sqrt(210 - 40 / 3 - 20 / 3), rel=0.1)
    white = [step_noise_std(0.1 * rng.standard_normal(8000), 20, 190, 10) for _ in range(50)]
    assert np.mean(white) == pytest.approx(1.034 * 0.1 * math.sqrt(1 / 20 + 1 / 10), rel=0.05)
    assert step_noise_std(np.zeros(49), 20, 190, 10) is None  # four means say nothing


@pytest.mark.parametrize("samples", [4000, 10_000, 14_000, 40_000])
@pytest.mark.parametrize("lasting", [0, 40, 400])
def test_interval_of_a_change_after_a_short_rest(samples: int, lasting: int) -> None:
    """A change over 3000 samples, the rest 1.3 to 13 times as long: white noise and Gauss-Markov drift of 40 and 400
    samples, 150 records each.  With the u of white noise 0.02 to 0.14 of the intervals held at 14000 samples and less.
    """
    before, gap, after = 1000, 2000, 200
    rng = np.random.default_rng(samples + lasting)
    held = 0
    for _ in range(150):
        e = rng.standard_normal(samples + before + gap)
        if lasting:
            a = math.exp(-1.0 / lasting)
            e[0] /= math.sqrt(1.0 - a * a)
            e = lfilter([1.0], [1.0, -a], e)
        y = e[samples:]
        u = step_noise_std(e[:samples], before, gap, after)
        assert u is not None
        held += abs(y[-after:].mean() - y[:before].mean()) < 1.96 * u
    assert held >= 0.91 * 150


# ------------------------------------------------------------------------------------------- drift
@pytest.mark.long
def test_drift_and_random_walk() -> None:
    """White rate of density N: the angle is a random walk N sqrt(t); rate over T has u = N/sqrt(T) = 1e-3/10 = 1e-4.
    60 draws: mean rate and its scatter, u with what 30 parts leave open, walk N to 15 %."""
    rng = np.random.default_rng(5)
    dt, n, density = 0.01, 10000, 1e-3
    t = dt * np.arange(n + 1)
    found = []
    for _ in range(60):
        rate = 2e-3 + density / math.sqrt(dt) * rng.standard_normal(n)
        found.append(drift(t, np.concatenate([[0.0], np.cumsum(rate) * dt])))
    assert np.std([d.rate for d in found]) == pytest.approx(1e-4, rel=0.25)
    assert np.mean([d.rate for d in found]) == pytest.approx(2e-3, abs=4e-5)
    assert 1.0e-4 < np.mean([d.u for d in found]) < 1.5e-4  # the interval of 30 parts allows for drift too
    walks = [d.walk for d in found if d.walk is not None]
    assert len(walks) > 50
    assert np.median([w for w, _ in walks]) == pytest.approx(density, rel=0.15)
    with pytest.raises(ReductionError, match="needs 40 samples"):
        drift(t[:20], t[:20])


# ------------------------------------------------------------------------------------------- records
def record(stop: float | None = None) -> types.SimpleNamespace:
    """Two phases: settle 1 s and 2 s open; settle 0.5 s and 1 s open."""
    time = 0.1 * np.arange(1, 46)
    phase = np.where(time < 3.05, 1.0, 2.0)
    gate = ((time > 1.05) & (time < 3.05)) | (time > 3.55)
    channels = {"time": time, "exciter.phase": phase, "exciter.gate": gate.astype(float), "y": time**2}
    if stop is not None:
        channels = {k: v[time < stop] for k, v in channels.items()}
    rows = [
        {"phase": 1, "label": "a", "mode": "torque", "shape": "step", "axis": 1, "dwell": 2.0},
        {"phase": 2, "label": "b", "mode": "hold", "shape": "constant", "axis": 1, "dwell": 1.0},
    ]
    return types.SimpleNamespace(channels=channels, run=RunDocument(plan=rows))


def test_gates_of_a_record() -> None:
    first, second = gates(record())
    assert first.kind == "torque" and second.label == "b"
    assert first.t[0] == pytest.approx(1.1) and first.t[-1] == pytest.approx(3.0)
    np.testing.assert_allclose(first["y"], first.t**2)
    np.testing.assert_allclose(first.rest("y"), (0.1 * np.arange(6, 11)) ** 2)  # the second half of the settling
    assert [g.label for g in gates(record(stop=3.8))] == ["a"]  # the second phase was not run to its end


def test_gates_that_cannot_be() -> None:
    empty = record()
    del empty.channels["exciter.gate"]
    with pytest.raises(ReductionError, match=r"no channel exciter\.gate"):
        gates(empty)
    with pytest.raises(ReductionError, match="no phase of the plan is complete"):
        gates(record(stop=2.0))
    with pytest.raises(ReductionError, match="no channel z; it has"):
        gates(record())[0]["z"]


def test_cross_axis_table() -> None:
    table = cross_axis({(1, 1): 2.0, (1, 2): 0.1j, (2, 2): -4.0, (2, 1): 1.0}, ["pitch", "roll"], "1 Hz")
    assert table.columns == ["excited axis", "pitch / %", "roll / %"]
    assert table.rows == [["pitch", 100.0, 5.0], ["roll", 25.0, 100.0]]


def test_step_response_of_a_linear_model() -> None:
    """Powers of the model give what its recursion x[k+1] = A x[k] + B u, y = C x + D u gives, to 1e-12 of its size."""
    rng, n = np.random.default_rng(0), 7
    A = rng.standard_normal((n, n))
    A *= 0.999 / np.max(np.abs(np.linalg.eigvals(A)))
    B, C, D = rng.standard_normal((n, 2)), rng.standard_normal((3, n)), rng.standard_normal((3, 2))
    names = {"inputs": ["load.torque[1]", "load.torque[2]"], "outputs": ["u", "v", "w"], "states": list("abcdefg")}
    model = types.SimpleNamespace(**names, A=A, B=B, C=C, D=D, step=1e-3)
    gate = types.SimpleNamespace(kind="torque", axis=2, shape="step", t=3.0 + np.arange(0.0, 5.0, 1e-2), amplitude=2.5)
    x, expected = np.zeros(n), []
    for k in range(4991):
        if k % 10 == 0:
            expected.append(C[1] @ x + D[1, 1] * 2.5)
        x = A @ x + B[:, 1] * 2.5
    computed = loop_curves.simulated(model, gate, "v")  # type: ignore[arg-type]
    np.testing.assert_allclose(computed, expected, rtol=0.0, atol=1e-12 * np.max(np.abs(expected)))


# ------------------------------------------------------------------------------------------- settling
@pytest.mark.parametrize(("lag", "settles"), [(0.2, True), (0.5, True), (2.0, False)])
def test_a_step_that_still_moves_has_no_final_value(lag: float, settles: bool) -> None:
    """1 - exp(-t/T) over 2 s; in the last 0.2 s it moves by exp(-1.8/T) - exp(-2/T): 0.008 %, 0.9 % and 3.9 %."""
    t = times(2.0)
    s = step(t, 1.0 - np.exp(-t / lag), np.zeros(0))
    moves = math.exp(-1.8 / lag) - math.exp(-2.0 / lag)
    assert s.moves == pytest.approx(moves, rel=0.1)
    assert bool(s.unsettled) == (moves > 0.02 * s.change)
    if settles:
        assert abs(s.change - 1.0) < 1.96 * s.u_change < 1.5 * abs(s.change - 1.0)  # what is to come is in u


@pytest.mark.parametrize("seed", range(5))
def test_noise_at_rest_does_not_move(seed: int) -> None:
    """White noise of a tenth of the step, 40 records a seed: at most one in 200 is taken for a signal that moves."""
    rng, t = np.random.default_rng(seed), times(2.0)
    found = [step(t, 1.0 + 0.1 * rng.normal(size=t.size), 0.1 * rng.normal(size=1000)) for _ in range(40)]
    assert sum(s.moves > 0.0 for s in found) <= 1
    assert all(not s.unsettled or s.moves > 0.0 for s in found)


@pytest.mark.long
def test_drift_intervals_hold_with_reading_errors_and_slow_drift() -> None:
    """Holds of 30 s: white rate noise N, errors of the readings, drift of 0.6 N/sqrt(T) that stays in a hold (as the
    Markov drift does).  1.96 times the scatter of ten parts over sqrt(10) held 0.87 of the true rates.
    """
    rng = np.random.default_rng(2)
    n, dt, held, largest = 600, 0.05, 0, 0.0
    for _ in range(150):
        rate = rng.normal(size=n) / np.sqrt(dt) + 0.6 / np.sqrt(30.0) * rng.normal()
        angle = np.concatenate([[0.0], np.cumsum(rate) * dt]) + 0.3 * rng.normal(size=n + 1)
        found = drift(dt * np.arange(n + 1), angle)
        held += abs(found.rate) < 1.959964 * found.u
        largest = max(largest, abs(found.rate) / found.u)
    assert 0.93 <= held / 150 <= 0.987
    assert largest < 5.0


@pytest.mark.long
def test_noise_of_other_frequencies_is_not_taken_for_that_at_a_sine() -> None:
    """Noise that rises with the frequency, as that of a rate in a position loop: it reaches into short segments.

    100 records of 20 periods: u by the lines beside the sine against the rms of the errors, and that by segments.
    """
    rng = np.random.default_rng(8)
    t = np.arange(0.0, 5.0, 5e-3)
    x = np.sin(2 * np.pi * 4.0 * t)
    found = []
    for _ in range(100):
        y = 0.5 * x + np.diff(rng.standard_normal(t.size + 1))
        found.append([response(t, x, y, 4.0, by_neighbours=b) for b in (True, False)])
    true = math.sqrt(np.mean([abs(p.value - 0.5) ** 2 for p, _ in found]) / 2.0)
    beside, segments = (math.sqrt(np.mean([(p[k].u or 0.0) ** 2 for p in found])) * 0.5 for k in (0, 1))
    assert true < beside < 1.45 * true  # 1.11 for the 12 numbers, and what leaks
    assert segments > 1.5 * true
    inside = np.mean([abs((p.value - 0.5).real) < 1.96 * 0.5 * (p.u or 0.0) for p, _ in found])
    assert inside > 0.9
