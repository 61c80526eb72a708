"""Margins against closed forms and against python-control on transfer functions; models of run.json."""

from __future__ import annotations

import math
import time
import timeit
from typing import Any

import control
import numpy as np
import pytest

from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.loop_measures import Point
from gyrobench.reduction.loops.margins import (
    deviation,
    excitation_response,
    grid,
    interpolate_response,
    margins,
    measured_margins,
    measured_values,
    model_response,
)


def test_integrator_with_a_lag() -> None:
    """L = k/(s (1 + s T)), k = 5, T = 0.1: |L| = 1 where w2 (1 + w2 T2) = k2, phase margin 90 - atan(w T)."""
    k, lag = 5.0, 0.1
    w2 = (-1 + math.sqrt(1 + 4 * k * k * lag * lag)) / (2 * lag * lag)
    f = grid(0.01, 100.0)
    s = 2j * np.pi * f
    found = margins(f, k / (s * (1 + lag * s)))
    assert found.crossover == pytest.approx(math.sqrt(w2) / (2 * math.pi), rel=1e-5)
    assert found.phase == pytest.approx(90 - math.degrees(math.atan(math.sqrt(w2) * lag)), abs=1e-3)
    assert found.upper is None and found.lower is None


def test_gain_margin_of_three_lags() -> None:
    """L = k/(1 + s)^3: -180 degrees at w = sqrt 3, |1 + j sqrt 3|^3 = 8, so the limit is 8 / k."""
    f = grid(0.01, 10.0)
    found = margins(f, 2.0 / (1 + 2j * np.pi * f) ** 3)
    assert found.upper == pytest.approx(4.0, rel=1e-5)
    assert next(f for f, g in found.gains) == pytest.approx(math.sqrt(3) / (2 * math.pi), rel=1e-5)


@pytest.mark.parametrize("seed", range(8))
def test_margins_are_those_of_python_control(seed: int) -> None:
    """Random loops with up to 3 integrators, resonances, a delay: the same crossings to 1e-6, ten times as fast."""
    rng = np.random.default_rng(seed)
    f = grid(0.05, 200.0)
    s = 2j * np.pi * f
    gain = rng.uniform(1.0, 1000.0) / s ** rng.integers(0, 4) * np.exp(-s * rng.uniform(0.0, 5e-3))
    for _ in range(3):
        n, d = 2 * np.pi * rng.uniform(0.3, 60.0, 2)
        gain = gain * (s * s + 0.1 * n * s + n * n) / (s * s + rng.uniform(0.05, 2.0) * d * s + d * d)
    start = time.process_time()
    data = control.frd(gain, 2.0 * np.pi * f, smooth=True)
    gm, pm, _, w_phase, w_gain, _ = control.stability_margins(data, returnall=True)
    slow = time.process_time() - start
    found = margins(f, gain)
    fast = min(timeit.repeat(lambda: margins(f, gain), time.process_time, number=1, repeat=3))  # undisturbed
    assert fast < 0.1 * slow
    turn = 2.0 * math.pi
    assert np.ravel(found.crossovers) == pytest.approx(np.column_stack([w_gain / turn, pm]).ravel(), rel=1e-6, abs=1e-5)
    assert np.ravel(found.gains) == pytest.approx(np.column_stack([w_phase / turn, gm]).ravel(), rel=1e-6)


def leadlag() -> control.TransferFunction:
    """[STAB-FLOATED-2DOF] K_G (1 + t1 s)(1 + t2 s)/((1 + T1 s)(1 + T2 s)) K / (J s^2), conditionally stable."""
    s = control.tf("s")
    g = 2.0 * (1 + 0.2 * s) * (1 + 0.03 * s) / ((1 + 2.0 * s) * (1 + 0.003 * s))
    return 8250.0 * g / (0.5 * s * s)


def test_conditional_stability_shows_its_lower_limit() -> None:
    """: crossover 100 rad/s, phase margin 52.3 deg, lower limit 0.044; python-control on the same L."""
    loop = leadlag()
    f = grid(0.02, 300.0)
    found = margins(f, np.array([complex(loop(2j * np.pi * x)) for x in f]))
    gm, pm, _, _, wc, _ = control.stability_margins(loop, returnall=True)
    assert found.crossover == pytest.approx(float(wc[0]) / (2 * math.pi), rel=1e-4)
    assert found.crossover == pytest.approx(100.0 / (2 * math.pi), rel=0.01)
    assert found.phase == pytest.approx(float(pm[0]), abs=2e-3)
    assert found.phase == pytest.approx(52.3, abs=0.2)
    assert found.lower == pytest.approx(float(gm[0]), rel=1e-3)
    assert found.lower == pytest.approx(0.044, abs=0.001)
    row = found.row("x")
    assert row[5] == pytest.approx(20 * math.log10(found.lower or 1.0))


def test_margins_from_sparse_points() -> None:
    """16 points over two decades, interpolated, meet the dense margins: crossover 1 %, phase 1 degree, limit 3 %."""
    loop = leadlag()
    points = [Point(x, complex(loop(2j * np.pi * x)), 1e-3, 1.0) for x in np.geomspace(0.3, 60.0, 16)]
    found = measured_margins(points)
    assert found.crossover == pytest.approx(15.92, rel=0.01)
    assert found.phase == pytest.approx(52.3, abs=1.0)
    assert found.lower == pytest.approx(0.044, rel=0.03)
    assert measured_margins(points[:3]).crossovers == []
    at = np.array([p.f for p in points])
    np.testing.assert_allclose(interpolate_response(points, at), [p.value for p in points], rtol=1e-9)


def covered(draws: int) -> dict[str, int]:
    """How many draws have the true crossover 15.92 Hz, phase margin 52.3 degrees and lower limit 0.044 inside 2 u.

    12 points over two decades, each wrong by 0.3 % in both parts; u stays below 1 % and 1 degree.
    """
    loop, rng = leadlag(), np.random.default_rng(4)
    dense = grid(0.02, 300.0)
    true = margins(dense, np.array([complex(loop(2j * np.pi * x)) for x in dense]))
    truth = {"crossover": true.crossover, "phase": true.phase, "lower": true.lower}
    inside = dict.fromkeys(truth, 0)
    for _ in range(draws):
        noise = 1 + 3e-3 * (rng.standard_normal(12) + 1j * rng.standard_normal(12))
        points = [
            Point(x, complex(loop(2j * np.pi * x)) * n, 3e-3, 1.0)
            for x, n in zip(np.geomspace(0.5, 50.0, 12), noise, strict=True)
        ]
        for name, (value, u) in measured_values(points).items():
            if name in inside:
                inside[name] += abs(value - truth[name]) < 2.0 * u
                assert u < {"crossover": 0.16, "phase": 1.5, "lower": 0.004}[name]
    return inside


@pytest.mark.long
def test_uncertainty_of_measured_margins_covers_interpolation_and_noise() -> None:
    """In nine of ten draws or more; tests/benchmarks/loops.py counts 1000."""
    inside = covered(50)
    assert all(n >= 45 for n in inside.values()), inside
    assert measured_values([]) == {}


def test_deviation() -> None:
    """A factor 1.1 is 0.8279 dB; j^(1/45) is 2 degrees; beyond the limit nothing counts."""
    points = [
        Point(1.0, 1.1 + 0j, None, 1.0),
        Point(2.0, np.exp(1j * math.radians(2.0)), None, 1.0),
        Point(9.0, 5j, None, 1.0),
    ]
    db, degrees = deviation(points, np.ones(3, complex), 2.0)
    assert db == pytest.approx(20 * math.log10(1.1)) and degrees == pytest.approx(2.0)
    assert deviation(points, np.ones(3, complex), 0.5) == (0.0, 0.0)


def model(step: float = 0.0, **changes: Any) -> LinearModel:
    """x' = -2 x + 3 torque + acceleration of the base; y = x + angle."""
    names = ["exciter.torque[1]", "exciter.motion_angle[2]", "exciter.motion_acceleration[2]"]
    matrices = {"A": [[-2.0]], "B": [[3.0, 0.0, 1.0]], "C": [[1.0]], "D": [[0.0, 1.0, 0.0]]}
    return LinearModel(**{**matrices, "inputs": names, "outputs": ["p.y"], "states": ["p.x"], "step": step, **changes})


def test_model_response_and_excitations() -> None:
    f = np.array([0.5, 3.0])
    s = 2j * np.pi * f
    np.testing.assert_allclose(model_response(model(), f)[:, 0, 0], 3.0 / (s + 2.0), rtol=1e-14)
    np.testing.assert_allclose(excitation_response(model(), "motion", 2, "p.y", f), 1.0 + s * s / (s + 2.0), rtol=1e-14)
    with pytest.raises(KeyError, match="is not connected"):
        excitation_response(model(), "command", 1, "p.y", f)
    with pytest.raises(KeyError, match="unknown channel"):
        excitation_response(model(), "torque", 1, "p.z", f)


def test_discrete_model_is_evaluated_on_the_circle() -> None:
    """x+ = 0.9 x + u: 1/(z - 0.9) at z = e^(j w h)."""
    m = model(0.01, A=[[0.9]], B=[[1.0]], D=[[0.0]], inputs=["exciter.torque[1]"])
    z = np.exp(2j * np.pi * 3.0 * 0.01)
    assert model_response(m, [3.0])[0, 0, 0] == pytest.approx(1.0 / (z - 0.9), rel=1e-14)


def test_model_without_states() -> None:
    m = model(A=[], B=[], C=[[]], states=[])
    assert model_response(m, [1.0])[0, 0].tolist() == [0.0, 1.0, 0.0]


def test_upper_gain_limit_is_no_part_of_the_uncertainty_of_the_lower() -> None:
    """Two ranges in which the phase may be -180 degrees, about 7 and 128 Hz: each limit has the u of its own."""
    s, w = control.tf("s"), 100.0 * math.pi
    network = ((1 + 5**0.5 * s / w) / (1 + s / (5**0.5 * w))) ** 2 * (1 + 12 * s / w) / (1 + 60 * s / w)
    loop = network / (s * s * (1 + 1e-3 * s) * (1 + 5e-4 * s))
    loop = loop / abs(complex(loop(1j * w)))
    points = [Point(x, complex(loop(2j * np.pi * x)), 0.02, 1.0) for x in np.geomspace(4.0, 220.0, 14)]
    found = measured_values(points)
    for name, f in (("lower", 7.0), ("upper", 128.4)):
        assert found[f"f_{name}"][0] == pytest.approx(f, rel=0.01)
        assert found[f"f_{name}"][1] < 0.1 * f and found[name][1] < 0.15 * found[name][0]
