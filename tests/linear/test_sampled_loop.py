"""Sampled loops with any plant: against python-control, a continuous simulation by scipy, the closed forms."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gyrobench.linear.sampled_loop import AnalogPlant, DigitalLoop, MeasuredPlant, SampledLoopError
from gyrobench.system.system import load_system

J, T = 2.56, 5e-3
W = np.geomspace(1.0, 0.99 * math.pi / T, 60)
#: time constants, a mode (antiresonance 30 Hz, resonance 45 Hz), friction
MODE = (np.polymul([1.0, 4.0, (60 * math.pi) ** 2], [2.25]), np.polymul([J, 0.8, 0.0], [1.0, 6.0, (90 * math.pi) ** 2]))
PLANTS = [([1.0], [J, 0.0, 0.0]), ([1.0], np.polymul([J, 0.4, 0.0], [2e-3, 1.0])), MODE]


def deadbeat(p: float = 0.0) -> tuple[list[float], list[float]]:
    """D(z) of the source with all poles at p."""
    b = (p**3 + 3 * p**2 + 3 * p - 3) / 4
    k = 2 * J / T**2
    return [k * (2 + b - 3 * p), -k * (p**3 - b)], [1.0, -b]


@pytest.mark.parametrize(("num", "den"), PLANTS)
def test_sampling_is_that_of_python_control(num: list[float], den: list[float]) -> None:
    oracle = control.sample_system(control.tf(num, den), T, "zoh")
    wanted = oracle(np.exp(1j * W * T))
    assert AnalogPlant.of_polynomials(num, den).sampled(W, T) == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize("delay", [5e-3, 12.5e-3, 1.2e-3])
def test_a_delay_is_exact(delay: float) -> None:
    """Against the delay split by hand: whole periods turn the phase, the rest is a plant that is sampled m late, which
    the modified z-transform gives as the same plant with the output read T - m after the last sample.
    """
    num, den = PLANTS[1]
    plant = AnalogPlant.of_polynomials(num, den)
    d, m = divmod(delay, T)
    A, B, C = plant.A, plant.B, plant.C
    whole = control.sample_system(control.ss(A, B[:, None], np.eye(3), np.zeros((3, 1))), T, "zoh")
    part = control.sample_system(control.ss(A, B[:, None], np.eye(3), np.zeros((3, 1))), T - m, "zoh")
    z = np.exp(1j * W * T)
    states = [np.linalg.solve(x * np.eye(3) - whole.A, whole.B)[:, 0] for x in z]
    wanted = (
        [C @ (part.A @ s + part.B[:, 0]) / x for s, x in zip(states, z, strict=True)]
        if m > 1e-9
        else [C @ s for s in states]
    )
    assert AnalogPlant(A, B, C, delay).sampled(W, T) == pytest.approx(np.array(wanted) * z**-d, rel=1e-9)


def test_loop_of_the_source() -> None:
    """J = 2.56, T = 5 ms, deadbeat: step 0, 1.25, 1.75, 1, 1 (CTRL-SAMPLED); poles all at 0; unstable with a delay of
    more than 0.36 T.
    """
    loop = DigitalLoop(AnalogPlant.of_polynomials([1.0], [J, 0.0, 0.0]), *deadbeat(), T)
    assert loop.follow(np.ones(6)) == pytest.approx([0.0, 1.25, 1.75, 1.0, 1.0, 1.0], abs=1e-9)
    assert np.abs(loop.poles()).max() < 1e-4  # a triple root: 1e-16 to the power of a third
    for share, stable in ((0.35, True), (0.37, False)):
        late = DigitalLoop(AnalogPlant.of_polynomials([1.0], [J, 0.0, 0.0], share * T), *deadbeat(), T)
        assert bool(np.abs(late.poles()).max() < 1.0) == stable
    assert loop.delay_margin() == pytest.approx(0.36 * T, abs=0.005 * T)


@pytest.mark.parametrize("delay", [0.0, 2e-3])
def test_follows_as_a_continuous_simulation_between_the_samples(delay: float) -> None:
    """A plant with a mode: solve_ivp from sample to sample, the controller as a recursion by hand."""
    num, den = MODE
    plant = AnalogPlant.of_polynomials(num, den, delay)
    (g, a), (_, b) = deadbeat(0.6)
    x, e_last, u_last, held = np.zeros(4), 0.0, 0.0, 0.0
    out = []
    for k in range(60):
        y = float(plant.C @ x)
        out.append(y)
        e = 1e-3 * min(k, 20) - y
        u = -b * u_last + g * e + a * e_last
        for length, value in ((delay, held), (T - delay, u)):
            if length > 0.0:
                x = solve_ivp(lambda t, s, v=value: plant.A @ s + plant.B * v, (0.0, length), x, rtol=1e-10,
                              atol=1e-16).y[:, -1]  # fmt: skip
        e_last, u_last, held = e, u, u
    found = DigitalLoop(plant, [g, a], [1.0, b], T).follow(1e-3 * np.minimum(np.arange(60), 20))
    assert found == pytest.approx(np.array(out), abs=1e-6 * max(1.0, np.abs(out).max()))


def test_gain_margin_is_where_the_loop_becomes_unstable() -> None:
    num, den = PLANTS[1]
    top, bottom = deadbeat(0.7)
    m = DigitalLoop(AnalogPlant.of_polynomials(num, den), top, bottom, T).margins()
    for share, stable in ((0.99, True), (1.01, False)):
        more = DigitalLoop(AnalogPlant.of_polynomials(num, den), [share * m.gain * c for c in top], bottom, T)
        assert bool(np.abs(more.poles()).max() < 1.0) == stable


@pytest.mark.long
def test_a_measured_response_gives_the_margins_of_the_plant_that_it_is_of() -> None:
    """2000 points to 20 times the sampling frequency; the sum over the aliases against the exact discretization."""
    num, den = MODE
    plant = AnalogPlant.of_polynomials(num, den)
    w = np.geomspace(0.1, 40.0 * math.pi / T, 4000)
    measured = MeasuredPlant(w, plant.response(w))
    assert measured.sampled(W, T) == pytest.approx(plant.sampled(W, T), rel=1e-2)
    exact = DigitalLoop(plant, *deadbeat(0.7), T).margins()
    found = DigitalLoop(measured, *deadbeat(0.7), T).margins()
    assert found.phase == pytest.approx(exact.phase, abs=2e-3) and found.gain == pytest.approx(exact.gain, rel=2e-3)


def test_what_cannot_be_sampled_is_refused() -> None:
    with pytest.raises(SampledLoopError, match="must be of higher degree"):
        AnalogPlant.of_polynomials([1.0, 0.0], [1.0, 0.0])
    with pytest.raises(SampledLoopError, match="below half the sampling frequency, 100 Hz"):
        MeasuredPlant(np.arange(1.0, 9.0), np.ones(8) + 0j).sampled([1.0], T)
    with pytest.raises(SampledLoopError, match="frequencies must rise"):
        MeasuredPlant(np.array([1.0, 3.0, 2.0, 4.0]), np.ones(4) + 0j)
    measured = MeasuredPlant(np.arange(1.0, 900.0), np.ones(899) + 0j)
    with pytest.raises(SampledLoopError, match="margins, and no poles"):
        DigitalLoop(measured, [1.0], [1.0], T).poles()


def test_the_rate_test_takes_an_axis_as_data(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """The axis that the loop is designed for has its poles at p; as a table of the same response the same margins."""
    module = importlib.import_module(type(load_system("table_rate_test")).__module__)
    data = importlib.import_module(".axis_as_data", module.__package__)
    law = importlib.import_module(".closed_form", module.__package__)
    loop = law.SampledLoop(J, J, T, 0.5, 0.0, 9.8, 0.0, 1e-3)
    (row,) = data.margins_table("1 | 2.56 0 0", loop).rows
    assert row[4] == pytest.approx(0.5, abs=1e-4)
    f = np.geomspace(0.1, 5e3, 3000)
    lines = [f"{x!r},{1.0 / (J * (2.0 * math.pi * x) ** 2)!r},-180.0" for x in f.tolist()]
    (tmp_path / "axis.csv").write_text("frequency_hz,gain,phase_deg\n" + "\n".join(lines))
    for delay in (0.0, 0.3 * T):  # of the controller: it comes on top of either
        late = replace(loop, delay=delay)
        (row,) = data.margins_table("1 | 2.56 0 0", late).rows
        (measured,) = data.margins_table(str(tmp_path / "axis.csv"), late).rows
        assert measured[:4] == pytest.approx(row[:4], rel=5e-3) and measured[4:] == [None, None]
    assert data.margins_table("", loop) is None
    for text, words in (("1 | 1", "higher degree"), ("a | b", "falling powers"), ("no.csv", "columns frequency_hz")):
        assert words in load_system("table_rate_test").with_values({"plant": text}).check()[0]
