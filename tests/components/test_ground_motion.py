"""Ground that moves: waves, tilt and seismic noise, against the figures of Hu 1981 and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make
from wired import BENCH

from gyrobench.packaging.instance import InstanceError, Plain
from gyrobench.packaging.loading import load_part

GroundMotion = load_part("ground_motion", BENCH)
ARCSEC = math.pi / 648000.0
W = 7.2921159e-5
G0 = 9.80665
VECTOR = ["[1]", "[2]", "[3]"]


def started(**values):
    made = Plain(GroundMotion)
    made.set({"gravity": G0, "latitude": math.radians(42.36), **values})
    made.initialize(0.0)
    return made


def outputs(made, name):
    return np.array(made.get([name + k for k in VECTOR]))


@pytest.mark.parametrize(
    ("period", "amplitude", "peak"),
    [
        (5.0, 1e-5, 1.6e-6),  # body wave
        (20.0, 1e-2, 1.0e-4),  # surface wave
        (2700.0, 1e-3, 5.5e-10),  # free oscillation of the Earth, 45 min
        (7.0, 1e-5, 0.82e-6),  # microseism, from ...
        (5.0, 3e-5, 4.8e-6),  # ... to 0.003 cm; the printed 0.03 cm would be 25e-6 g and more (ET19)
    ],
)
def test_accelerations_of_the_waves_of_the_source(period, amplitude, peak):
    """(2 pi / period)2 displacement at the crest, in g; the acceleration points against the displacement there."""
    made = started(**{"period[1]": period, "displacement[1,1]": amplitude, "phase[1]": math.pi / 2.0})
    assert -outputs(made, "a")[0] / G0 == pytest.approx((2.0 * math.pi / period) ** 2 * amplitude / G0, rel=1e-9)
    assert -outputs(made, "a")[0] / G0 == pytest.approx(peak, rel=0.03)
    assert outputs(made, "f") == pytest.approx([outputs(made, "a")[0], 0.0, G0], rel=1e-12)


def test_a_tilt_of_an_arc_second_at_the_latitude_of_the_source():
    """About E: Earth rate north + W sin L 1 arcsec = 3.3e-6 ERU, up - W cos L 1 arcsec = 3.6e-6 ERU, north 4.8e-6 g.  A
    body that leans so that its north axis rises sees the sky's pole ahead of it, and is pushed north.
    """
    made = started(**{"tilt_amplitude[1,1]": ARCSEC, "phase[1]": math.pi / 2.0, "period[1]": 1e9})
    latitude = math.radians(42.36)
    change = outputs(made, "omega") / W - [0.0, math.cos(latitude), math.sin(latitude)]
    assert change == pytest.approx([0.0, 3.27e-6, -3.58e-6], abs=0.01e-6)
    assert outputs(made, "f") / G0 - [0.0, 0.0, 1.0] == pytest.approx([0.0, 4.848e-6, 0.0], abs=1e-9)


def test_a_rate_of_an_arc_second_a_second_is_0_0665_eru():
    """Printed as 67e-8 (ET19).  At the crest the acceleration is 1 arcsec/s2 = 4.85e-6 rad/s2, back."""
    swing = {"tilt_amplitude[1,1]": ARCSEC, "period[1]": 2.0 * math.pi}
    assert outputs(started(**swing), "omega")[0] / W == pytest.approx(0.0665, abs=5e-5)
    made = started(**swing, **{"phase[1]": math.pi / 2.0})
    assert outputs(made, "alpha")[0] == pytest.approx(-ARCSEC, rel=1e-9)


def test_rate_and_acceleration_are_derivatives_of_the_motion():
    """omega - (W turned) integrates to the tilt, alpha to omega: central differences over 2 ms."""
    values = {"tilt_amplitude[1,1]": 3e-5, "tilt_amplitude[1,2]": 2e-5, "tilt_amplitude[2,3]": 1e-5, "period[1]": 3.0,
              "period[2]": 1.7, "phase[2]": 0.4, "tilt_ramp[1]": 1e-6, "tilt_ramp[3]": -2e-6}  # fmt: skip
    made = started(**values)
    seen = []
    for k in range(3):
        seen.append({n: outputs(made, n) for n in ("tilt", "omega", "alpha")})
        made.step(k * 1e-3, 1e-3)
    before, now, after = seen
    earth = W * np.array([0.0, math.cos(math.radians(42.36)), math.sin(math.radians(42.36))])
    turned = earth - np.cross(now["tilt"], earth)
    assert now["omega"] - turned == pytest.approx((after["tilt"] - before["tilt"]) / 2e-3, rel=1e-5, abs=1e-12)
    assert now["alpha"] == pytest.approx((after["omega"] - before["omega"]) / 2e-3, rel=1e-5, abs=1e-12)


def test_without_motion_it_is_the_site():
    site, ground = Plain(load_part("site", BENCH)), Plain(GroundMotion)
    for made in (site, ground):
        made.set({"latitude": -0.6, "height": 1200.0})
        made.initialize(0.0)
    for name in ("f", "omega"):
        assert list(outputs(ground, name)) == list(outputs(site, name))


def test_seismic_noise_has_its_size_and_its_peak():
    """rms and spectrum from 1000 s: power in bands of S ~ f2 / ((f0^2 - f2)2 + (2 d f0 f)2), integrated here."""
    made = make("ground_motion", "native")
    try:
        made.set({"seismic_n": 1e-5, "gravity": G0, "seed": 5})
        made.initialize(0.0)
        h, n = 0.05, 20000
        a = np.empty(n)
        for k in range(n):
            made.step(k * h, h)
            a[k] = made.get(["a[2]"])[0]
    finally:
        made.free()
    f = np.fft.rfftfreq(n, h)
    power = np.abs(np.fft.rfft(a)) ** 2 / n / (n / 2.0)
    fine = np.linspace(1e-4, 60.0, 600000)
    shape = fine**2 / ((0.2**2 - fine**2) ** 2 + (2.0 * 0.3 * 0.2 * fine) ** 2)
    shape *= 1e-10 / (shape.sum() * (fine[1] - fine[0]))
    for low, high in ((0.05, 0.15), (0.15, 0.25), (0.25, 0.5), (0.5, 2.0)):
        wanted = shape[(fine >= low) & (fine < high)].sum() * (fine[1] - fine[0])
        found = power[(f >= low) & (f < high)].sum()
        width = (high - low) * n * h  # independent estimates
        assert found == pytest.approx(wanted, rel=5.0 / math.sqrt(width))
    assert a.std() == pytest.approx(1e-5, rel=0.2)
    assert abs(a.mean()) < 6e-8  # nothing at frequency 0: the mean of a broad peak there would be some 5e-7


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (
            {"displacement[3,1]": 1e-3, "acceleration[3,2]": 1e-4},
            "motion 3 is given by displacement and by acceleration",
        ),
        ({"period[2]": 0.0}, r"period\[2\] = 0 s must be > 0"),
        ({"latitude": 1.6}, r"latitude = 1.6 rad must be <= 1.5708"),
        ({"tilt_amplitude[1,1]": 0.006, "tilt_amplitude[2,1]": -0.006}, "tilts add up to more than 0.01 rad"),
        ({"local_e": 1e-6, "local_frequency": 200.0}, "frequency = 200 Hz is too high for the step"),
    ],
)
def test_refusals(values, words):
    with pytest.raises(InstanceError, match=words):
        made = started(**values)
        made.step(0.0, 1e-3)


def test_a_ramp_ends_where_the_model_does():
    made = started(**{"tilt_ramp[2]": 0.1})
    made.step(0.0, 0.09)
    with pytest.raises(InstanceError, match=r"the ground has tilted by 0\.01 rad"):
        made.step(0.09, 0.02)
