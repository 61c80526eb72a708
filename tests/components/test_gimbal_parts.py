"""The secant of a two-axis gimbal by hand; vibration of a base against the spectrum it was given."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from native_parts import make
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part
from gyrobench.record.vibration_spectrum import VibrationSpectrum
from gyrobench.system.values import flatten

Secant = load_part("decoupler_los", BENCH)
Vibration = load_part("base_vibration", BENCH)
SPECTRUM = VibrationSpectrum(
    np.array([1.0, 5.0, 20.0, 60.0]),
    np.array([[1e-3, 4e-3, 1e-4, 1e-6], [0.0, 0.0, 0.0, 0.0], [2e-3, 0.0, 1e-3, 1e-3]]),
    np.array([[0.0] * 4, [0.1, 0.1, 0.1, 0.1], [0.0] * 4]),
)


@pytest.mark.parametrize(("form", "expected"), [(0, (0.6, 0.8 / math.cos(0.5))), (1, (0.6 / math.cos(-1.0), 0.8))])
def test_secant_of_the_outer_axis(form: int, expected: tuple[float, float]) -> None:
    """K (rate - command): 2 (0.4 - 0.1) and 2 (0.5 - 0.1); theta = 0.5 about pitch, -1 about yaw."""
    part = Secant(form=form, K=2.0)
    part.initialize()
    part.rate, part.command, part.theta = [0.4, 0.5], [0.1, 0.1], [0.5, -1.0]
    part.outputs()
    assert part.u_axes == pytest.approx(expected, rel=1e-14)
    assert part.saturated == 0.0


@pytest.mark.parametrize("theta", [1.4, -1.5, 2.5])
def test_secant_is_held_in_the_keyhole(theta: float) -> None:
    part = Secant()
    part.initialize()
    part.rate, part.theta = [0.0, 1.0], [theta, 0.0]
    part.outputs()
    assert part.u_axes[1] == pytest.approx(1.0 / math.cos(math.radians(75.0)))
    assert part.saturated == 1.0


VALUES = {n.partition(".")[2]: v for n, v in SPECTRUM.parameters().items()}


def moved(h: float, count: int, **given: Any) -> dict[str, np.ndarray[Any, Any]]:
    """Return the outputs of the native part after each step: (count, 3)."""
    part = make("base_vibration", "native")
    for name, value in ({"onset": 0.0} | VALUES | given).items():
        part.set({n: float(x) for n, x in flatten(name, value).items()})
    part.initialize()
    names = [f"{n}[{k}]" for n in ("omega", "alpha", "f") for k in (1, 2, 3)]
    rows = np.zeros((count, 9))
    for k in range(count):
        part.step(k * h, h)
        rows[k] = part.get(names)
    part.free()
    return {"omega": rows[:, :3], "alpha": rows[:, 3:6], "f": rows[:, 6:]}


def test_mean_square_is_that_of_the_spectrum() -> None:
    """200 s; kinks, a density that falls to 0, an axis without one.  Over bands of 16 lines each, within 3 %."""
    h, n = 5e-3, 40000
    out = moved(h, n)
    f = np.fft.rfftfreq(n, h)
    fine = np.geomspace(1.0, 60.0, 20001)
    for name, kind, offset in (("omega", "rate", 0.0), ("f", "acceleration", 9.80665)):
        for axis in range(3):
            y = out[name][:, axis] - (offset if axis == 2 else 0.0)
            wanted = SPECTRUM.rms(kind, axis)
            assert math.sqrt(np.mean(y * y)) == pytest.approx(wanted, rel=0.03, abs=1e-12)
            power = 2.0 * np.abs(np.fft.rfft(y * (w := np.hanning(n)))) ** 2 / (n * np.sum(w * w))
            for low, high in pairwise(60.0 ** (np.arange(4) / 3.0)):
                inside = (fine >= low) & (fine < high)
                whole = float(np.trapezoid(SPECTRUM.density(kind, axis, fine[inside]), fine[inside]))
                here = power[(f >= low) & (f < high)].sum()
                assert here == pytest.approx(whole, rel=0.03, abs=1e-12), (name, axis, low)


def test_a_peak_narrower_than_a_band_has_its_power_in_its_place() -> None:
    """10 (f/f0)^(+-p) times the floor within +-0.5 % of 41.3 Hz, where a band is 10 % wide; 2000 a floor elsewhere.

    ln 2000 = 7.601: each side has about the height times f0 0.005/7.601.
    """
    f0, high = 41.3, 0.02
    spectrum = VibrationSpectrum(
        np.array([1.0, f0 * 0.995, f0, f0 * 1.005, 100.0]), np.array([[1e-5, 1e-5, high, 1e-5, 1e-5]] * 3)
    )
    peak = high * 2.0 * f0 * 0.005 / math.log(2000.0)
    assert spectrum.rms("rate", 0) ** 2 == pytest.approx(peak + 99e-5, rel=0.01)
    h, n = 2e-3, 50000
    out = moved(h, n, **{k.partition(".")[2]: v for k, v in spectrum.parameters().items()})["omega"]
    assert np.mean(out**2, axis=0) == pytest.approx([peak + 99e-5] * 3, rel=0.03)
    f, power = np.fft.rfftfreq(n, h), np.abs(np.fft.rfft(out, axis=0)) ** 2
    inside = np.abs(f / f0 - 1.0) < 0.005
    assert power[inside].sum(axis=0) / power[1:].sum(axis=0) == pytest.approx([peak / (peak + 99e-5)] * 3, abs=0.15)


def test_alpha_is_the_derivative_of_omega_while_it_fades_in() -> None:
    h = 1e-4
    out = moved(h, 3000, onset=0.25)
    slope = (out["omega"][2:] - out["omega"][:-2]) / (2.0 * h)
    # the error of a central difference, w2 h2/6 of a sine of 60 Hz: 2.4e-4 of the largest
    assert out["alpha"][1:-1] == pytest.approx(slope, abs=3e-4 * np.abs(slope).max())
    assert np.abs(out["omega"][0]).max() < 1e-6 < np.abs(out["omega"][-1, 0])


def test_seeds_and_phases_of_the_plan() -> None:
    one, again, other = (moved(1e-2, 50, seed=s)["omega"] for s in (1, 1, 2))
    assert np.array_equal(one, again) and not np.allclose(one, other)
    waits = Vibration(**VALUES, first=3, onset=0.0)
    waits.omega_b = [0.1, 0.2, 0.3]
    waits.phase = 2
    waits.initialize()
    waits.do_step(0.0, 0.1)
    assert waits.omega == [0.1, 0.2, 0.3]
    waits.phase = 3
    waits.do_step(0.1, 0.1)
    waits.do_step(0.2, 0.1)
    assert waits.omega[0] != 0.1 and waits.omega[1] == 0.2


@pytest.mark.long
def test_turning_phasors_stay_on_their_circles() -> None:
    """1e5 steps against cosines, whose arguments come from the frequencies that the part chose."""
    part = Vibration(**VALUES, onset=0.0)
    part.initialize()
    w, x, y = (np.array(getattr(part, n)[0]) for n in "wxy")
    turned = moved(1e-3, 100000)["omega"][-1, 0]
    assert turned == pytest.approx(float(np.sum(x * np.cos(w * 100.0) - y * np.sin(w * 100.0))), abs=1e-10)


@pytest.mark.parametrize(
    ("given", "message"),
    [({"points": 1}, "needs 2 points"), ({"points": 3, "frequency": [1.0, 2.0, 2.0] + [0.0] * 21}, "of point 3 must"),
     ({"points": 2, "frequency": [0.0, 2.0] + [0.0] * 22}, "of point 1 must")],
)  # fmt: skip
def test_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        Vibration(**given).initialize()
