"""Two power gyros on a platform: equations by a second integration, momentum, the turn by 90 degrees, drift."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH

from gyrobench.packaging import load_part

Part = load_part("platform_power_gyros", BENCH)


def run(M, S, base, time=0.3, h=1e-4, **parameters):
    part = Part(white=0.0, **parameters)
    part.M, part.S, part.omega_b = list(M), list(S), [*base, 0.0]
    part.initialize()
    for k in range(round(time / h)):
        part.do_step(k * h, h)
    return np.array([part.get(f"{n}[{k}]") for n in ("attitude", "omega", "precession") for k in (1, 2)])


def complex_axis(M, S, base, time, H=10.0, J_x=0.5, J_y=0.02, C_x=10.0, C_y=2.0, drift=0.0):
    """The same as one axis with complex angles, written on its own: th, th', be, be'.

    A servo torque S on the gyros reacts on the platform: S_2 about x, -S_1 about y, that is -i S.
    """

    def right(t, y):
        w, r = y[1], y[3]
        c = r + 1j * w
        torque = M - C_x * (w - base) - H * r + 1j * C_y * c - 1j * S
        return [w, torque / J_x, r, (H * (w - drift) - C_y * c + S) / J_y]

    y = solve_ivp(right, (0.0, time), np.zeros(4, complex), rtol=1e-10, atol=1e-13).y[:, -1]
    c = y[2] + 1j * y[0]
    return np.array([y[0].real, y[0].imag, y[1].real, y[1].imag, c.real, c.imag])


@pytest.mark.parametrize(
    ("M", "S", "base", "drift"),
    [((0.5, -0.3), (0.0, 0.0), (0.0, 0.0), 0.0), ((0.0, 0.0), (0.02, -0.05), (0.0, 0.0), 0.0),
     ((0.1, 0.2), (0.01, 0.0), (0.02, -0.03), 1e-3)],
)  # fmt: skip
def test_complex_form_of_one_axis(M, S, base, drift):
    found = run(M, S, base, drift=[drift, 2 * drift])
    wanted = complex_axis(complex(*M), complex(*S), complex(*base), 0.3, drift=drift + 2j * drift)
    assert found == pytest.approx(wanted, rel=2e-6, abs=1e-10)


def test_turned_by_ninety_degrees():
    """A load about y does about y and -x what one about x does about x and y."""
    x = run((0.5, 0.0), (0.0, 0.0), (0.0, 0.0))
    y = run((0.0, 0.5), (0.0, 0.0), (0.0, 0.0))
    assert y[[0, 2, 4]] == pytest.approx(-x[[1, 3, 5]], rel=1e-9, abs=1e-15)
    assert y[[1, 3, 5]] == pytest.approx(x[[0, 2, 4]], rel=1e-9, abs=1e-15)


def test_momentum_about_an_axis():
    """Without damping J_x a_x' + H b_1 grows with the load: the gyro takes what the platform does not."""
    part = Part(white=0.0, C_x=0.0, C_y=0.0)
    part.M = [0.4, 0.0]
    part.initialize()
    for k in range(2000):
        part.do_step(k * 1e-4, 1e-4)
    b1 = part.get("precession[1]") + part.get("attitude[2]")
    assert 0.5 * part.get("omega[1]") + 10.0 * b1 == pytest.approx(0.4 * 0.2, rel=1e-9)


@pytest.mark.long
def test_a_free_gyro_drifts_with_its_drift_rate():
    """Held by its loop the platform turns with d; here free and undamped, the nutation about it averages out."""
    part = Part(white=0.0, C_x=0.0, C_y=0.5, drift=[1e-3, 0.0])
    part.initialize()
    angles = []
    for k in range(40000):
        part.do_step(k * 1e-4, 1e-4)
        angles.append(part.get("attitude[1]"))
    assert np.polyfit(np.arange(20000) * 1e-4, angles[20000:], 1)[0] == pytest.approx(1e-3, rel=1e-2)
