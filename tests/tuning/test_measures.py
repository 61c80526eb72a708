"""Measures of loops and structures of controllers against closed forms and python-control."""

from __future__ import annotations

from types import SimpleNamespace

import control
import numpy as np
import pytest

from gyrobench.tuning.controller_search import grazing
from gyrobench.tuning.robustness import grid, measure, peak
from gyrobench.tuning.structures import ControllerStructure
from gyrobench.tuning.wishes import parse_wishes

F = np.geomspace(1e-3, 1e3, 800)
S = 2j * np.pi * F


def got(text: str, L: np.ndarray) -> float:
    wish = next(w for w in parse_wishes([text, "S at 7Hz<-3dB"]) if w.f != 7.0)
    return measure(wish, F, L)


@pytest.mark.long
def test_a_loop_in_closed_form() -> None:
    """L = 4/(s (s + 1)(s + 2)): |L(j sqrt 2)| = 4/6 at -180 degrees, so the gain margin is 1.5."""
    L = 4.0 / (S * (S + 1.0) * (S + 2.0))
    assert got("gain margin=2", L) == pytest.approx(1.5, rel=1e-4)
    plant = control.tf([4.0], [1.0, 3.0, 2.0, 0.0])
    _, phase, _, _, crossed, _ = control.stability_margins(plant)
    assert got("phase margin=40deg", L) == pytest.approx(np.radians(phase), rel=1e-3)
    assert got("delay margin=1s", L) == pytest.approx(np.radians(phase) / crossed, rel=1e-3)
    disk = control.disk_margins(plant, 2.0 * np.pi * np.geomspace(1e-3, 10.0, 40000), skew=0.0)[0]
    assert got("disk margin=0.5", L) == pytest.approx(float(disk), rel=1e-3)


def test_a_limit_of_the_gain_at_half_the_frequency_of_the_steps() -> None:
    """L = K h/(z - 1) is -K h/2 at z = -1, where its phase ends at -180 degrees: the limit is 2/(K h)."""
    h, K = 1e-3, 40.0
    f = grid(h, 5.0)
    wish = parse_wishes(["gain margin=2", "bandwidth>1Hz"])[0]
    assert measure(wish, f, K * h / (np.exp(2j * np.pi * f * h) - 1.0)) == pytest.approx(2.0 / (K * h), rel=1e-6)


def test_a_limit_of_the_gain_at_rest() -> None:
    """L = 3/(s - 1) needs a gain above 1/3; with 3/(s + 1) no gain is a limit."""
    assert got("gain margin=2", 3.0 / (S - 1.0)) == pytest.approx(3.0, rel=1e-4)
    assert got("gain margin=2", 3.0 / (S + 1.0)) == np.inf


def test_the_peaks_of_a_second_order_loop() -> None:
    """L = 1/(s (s + 2 z)): T = 1/(s2 + 2 z s + 1) has the peak 1/(2 z sqrt(1 - z2))."""
    z = 0.2
    L = 1.0 / (S * (S + 2.0 * z))
    assert got("peak T<3dB", L) == pytest.approx(1.0 / (2.0 * z * np.sqrt(1.0 - z * z)), rel=1e-3)
    w2 = np.geomspace(0.1, 10.0, 400001)  # |S|2 over w2
    top = np.sqrt((w2 * (w2 + 4 * z * z) / ((1 - w2) ** 2 + 4 * z * z * w2)).max())
    assert got("peak S<3dB", L) == pytest.approx(top, rel=1e-3)


@pytest.mark.parametrize("w", [0.3, 5.0, 80.0])
def test_bandwidth_of_an_integrator(w: float) -> None:
    """L = w/s has the bandwidth w, by definition.  |S(w/10)| = 1/sqrt 101."""
    L = w / S
    assert got("bandwidth>1Hz", L) == pytest.approx(w / (2.0 * np.pi), rel=1e-3)
    f = w / 20.0 / np.pi
    assert got(f"S at {f}Hz<-10dB", L) == pytest.approx(1.0 / np.sqrt(101.0), rel=1e-3)


def test_a_loop_without_gain_at_rest_has_no_bandwidth() -> None:
    """L = 2: |S| = 1/3 from the lowest frequency on, 1 mHz, where an integrator of b = sqrt(8) mHz has it, too."""
    L = 2.0 / (1.0 + S / 1e3)
    assert got("bandwidth>1Hz", L) == pytest.approx(8.0**0.5 * 1e-3, rel=1e-3)
    assert got("bandwidth>1Hz", 0.1 / (1.0 + S)) == 0.0


def test_a_peak_between_frequencies() -> None:
    """A parabola over log f is found exactly."""
    f = np.geomspace(1.0, 10.0, 12)
    curve = np.exp(1.0 - 3.0 * (np.log(f) - 1.2345) ** 2)
    assert peak(f, curve) == pytest.approx(np.e, rel=1e-9)


def test_structures_are_what_their_equations_say() -> None:
    """K (1 + tau1 s)(1 + tau2 s)/((1 + T1 s)(1 + T2 s))(1 + integral/s), and notch and roll-off; |L| = 1 at w."""
    s = 1j * np.geomspace(0.1, 1e4, 30)
    c = ControllerStructure("lead-lag").controller(30.0, [0.1, 20.0, 1.5, 9.0, 0.05], lambda f: 0.25j)
    v = c.values
    expected = (
        v["K"] * (1 + v["tau1"] * s) * (1 + v["tau2"] * s) / ((1 + v["T1"] * s) * (1 + v["T2"] * s))
    ) * (1 + v["integral"] / s)  # fmt: skip
    assert c.response(s) == pytest.approx(expected, rel=1e-7)
    assert v["T1"] == pytest.approx(20.0 * v["tau1"]) and v["tau2"] == pytest.approx(9.0 * v["T2"])
    assert abs(c.response(np.array([30j]))[0]) == pytest.approx(4.0, rel=1e-7)
    c = ControllerStructure("notch+rolloff").controller(30.0, [2.0, 0.3, 0.1, 5.0], lambda f: 1.0)
    w0 = 2.0 * np.pi * c.values["f_notch"]
    assert w0 == pytest.approx(60.0)
    assert c.response(np.array([1j * w0]))[0] == pytest.approx(0.1 * c.values["K"] / (1.0 + 60j / 150.0), rel=1e-6)


def test_no_lead_is_faster_than_the_communication_step() -> None:
    """w = 50 rad/s, lead about 10 w with T2 = 1/(500 sqrt 100) = 0.2 ms, and a step of 0.5 ms.

    T2 = 0.5 ms, and tau2 = 1/(500^2 T2) = 8 ms about the same 10 w.  A lead all of which is faster than the step, about
    100 w = 5000 rad/s, is none.  |L| = 1 at w.
    """
    shape = ControllerStructure("pi+lead+lead").of(SimpleNamespace(step=5e-4))
    c = shape.controller(50.0, [0.1, 10.0, 100.0, 100.0, 9.0], lambda f: 0.25j)
    assert c.values["T2"] == pytest.approx(5e-4) and c.values["tau2"] == pytest.approx(8e-3)
    assert c.values["T2_2"] == pytest.approx(2e-4) and c.values["tau2_2"] == pytest.approx(2e-4)
    assert abs(c.response(np.array([50j]))[0]) == pytest.approx(4.0, rel=1e-7)
    free = ControllerStructure("pi+lead").controller(50.0, [0.1, 10.0, 100.0], lambda f: 0.25j)
    assert free.values["T2"] == pytest.approx(2e-4)


def test_a_resonance_just_under_one_counts_as_a_crossover() -> None:
    """Peaks of 0.97 at 30 degrees from -180, of 0.85 and of 1.2 in three loops: the first alone grazes 1."""
    bump = np.exp(-(np.linspace(-3.0, 3.0, 61) ** 2))
    L = np.array([peak * bump for peak in (0.97, 0.85, 1.2)]) * -np.exp(1j * np.radians(30.0))
    assert grazing(L).tolist() == [pytest.approx(np.radians(30.0)), np.inf, np.inf]
