"""accelerometer_static: the model by hand at four mounts, misalignment, refusals.  [ACCEL-MODEL]"""

import math

import numpy as np
import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Accelerometer = load_part("accelerometer_static", BENCH)
G0 = 9.80665
TERMS = {"K_F": -4.13e-3, "K_I": 1.32453, "K_O": -7.3e-4, "K_IO": 8e-4, "K_II": 1.6e-3}


def voltage(f, **parameters):
    part = Accelerometer(white=0.0, **parameters)
    part.f[:] = f
    part.initialize()
    return part.get("U")


@pytest.mark.parametrize("sensor", [1, 2, 3, 4])
def test_axes_of_the_four_sensors(sensor):
    """a_I = sin, cos, -sin, -cos of b and a_O = cos, -sin, -cos, sin: U in V, gravity of 1 g0 along (sin b, cos b)."""
    turn = (sensor - 1) * math.pi / 2.0
    mount = [[math.cos(turn), math.sin(turn), 0.0], [-math.sin(turn), math.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    for b in (0.3, 1.9, -2.4):
        s, c = math.sin(b), math.cos(b)
        a_i, a_o = ((s, c), (c, -s), (-s, -c), (-c, s))[sensor - 1]
        expected = -4.13e-3 + 1.32453 * a_i - 7.3e-4 * a_o + 8e-4 * a_i * a_o + 1.6e-3 * a_i**2
        found = voltage([G0 * s, G0 * c, 0.3], mount=mount, **TERMS)
        assert found == pytest.approx(expected, rel=1e-12)


def test_misalignment_turns_both_axes():
    """eta turns input and output axis together: the reading at b is that of a sensor without it at b + eta."""
    eta, b = 4e-3, 0.7
    turned = voltage([G0 * math.sin(b), G0 * math.cos(b), 0.0], eta=eta, **TERMS)
    straight = voltage([G0 * math.sin(b + eta), G0 * math.cos(b + eta), 0.0], **TERMS)
    assert turned == pytest.approx(straight, rel=1e-12)


def test_noise_of_a_mean():
    """9.5e-6 V/sqrt(Hz) leaves 3.0e-6 V in 10 s: 40 means within 2.5 standard deviations (11 % each)."""
    part = Accelerometer(seed=3)
    part.initialize()
    means = []
    for k in range(40):
        readings = []
        for j in range(100):
            part.do_step((100 * k + j) * 0.1, 0.1)
            readings.append(part.get("U"))
        means.append(np.mean(readings))
    assert float(np.std(means)) == pytest.approx(3.0e-6, rel=0.28)


def test_refused():
    with pytest.raises(ComponentError, match="K_I = 0"):
        Accelerometer(K_I=0.0).initialize()
    for eta in (0.0101, -0.0101):
        with pytest.raises(ComponentError, match="eta"):
            Accelerometer(eta=eta).initialize()
    with pytest.raises(ComponentError):
        Accelerometer(K_I=math.nan).initialize()
