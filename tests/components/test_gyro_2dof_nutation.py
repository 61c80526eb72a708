"""Two-degree-of-freedom gyro: nutation, springs of the rotor [GYRO-POSITION]."""

import math

import numpy as np
import pytest
from free_rotors import NO_DRIFT, QUIET, STILL, H, drift, looped, settled, started
from scipy.linalg import expm
from wired import DEG_H

from gyrobench.component import ComponentError

# --------------------------------------------------------------------------------------------- nutation
NUTATION = {"J_x": 2e-4, "J_y": 1e-4, "C_x": 0.02, "C_y": 0.03}


def test_nutation_after_a_step_of_current():
    """Equal inertias, no damping: p + j q = Omega (1 - exp(j n t)), n = H / J, Omega = k_y i_y."""
    part = started(**STILL, J_x=1e-4, J_y=1e-4, i_y=1e-3)
    n, rate = 0.2 / 1e-4, 1e-3 * 17.180e3 * DEG_H
    for k in range(200):
        part.do_step(k * H, H)
        t = (k + 1) * H
        wanted = rate * (1.0 - np.exp(1j * n * t))
        angle = rate * (t + (1.0 - np.exp(1j * n * t)) / (1j * n))
        assert abs(complex(part.p, part.q) - wanted) < 1e-12 * rate
        assert abs(complex(part.psi_x, part.psi_y) - angle) < 1e-12 * rate * 0.2


@pytest.mark.parametrize("h", [1e-4, 1e-3, 5e-3])
def test_linear_gyro_is_exact_for_held_inputs(h):
    """Unequal inertias, damping, a turning case: states from expm of the extended matrix."""
    w_z, (jx, jy, cx, cy), spin = 0.3, NUTATION.values(), 0.2
    part = started(**STILL, **NUTATION, omega=[0.0, 0.0, w_z], step=1.0)
    a = np.zeros((8, 8))  # psi_x, psi_y, p, q; held: rate_x, rate_y, omega_x, omega_y
    a[0, [1, 2, 6]] = w_z, 1.0, -1.0
    a[1, [0, 3, 7]] = -w_z, 1.0, -1.0
    a[2, [2, 3, 5, 6]] = -cx / jx, -spin / jx, spin / jx, cx / jx
    a[3, [2, 3, 4, 7]] = spin / jy, -cy / jy, -spin / jy, cy / jy
    m = expm(h * a)[:4]
    rng = np.random.default_rng(2)
    x, worst = np.zeros(4), 0.0
    for k in range(300):
        w, i = rng.normal(size=2) * 1e-3, rng.normal(size=2) * 1e-2
        part.omega = [*w.tolist(), w_z]
        part.i_x, part.i_y = i.tolist()
        part.do_step(k * h, h)
        x = m @ [*x, part.k_y * i[1], part.k_x * i[0], *w]
        found = np.array([part.psi_x, part.psi_y, part.p, part.q])
        worst = max(worst, *(abs(found - x)[:2] / abs(x[:2]).max()), *(abs(found - x)[2:] / abs(x[2:]).max()))
    print(f"h = {h}: {worst:.1g}")
    assert worst < 1e-11


def test_loops_with_nutation():
    """Damped nutation: stable, and the steady state is the same.  Undamped: the loops drive it, as theory has it."""
    f = [3.0, -4.0, 5.0]
    g = settled(J_x=1e-4, J_y=1e-4, C_x=0.05, C_y=0.05, omega=[1e-4, -2e-4, 3e-4], f=f)
    assert g.k_y * g.i_y == pytest.approx(1e-4 - drift(g, "x", f), rel=1e-12)
    assert g.k_x * g.i_x == pytest.approx(-2e-4 - drift(g, "y", f), rel=1e-12)
    assert abs(g.p - 1e-4) < 1e-15 and abs(g.q + 2e-4) < 1e-15
    # one complex equation: s3 = j n (s2 + 100 s + 1000), n = H / J; its root near j n grows with about 100 1/s
    n = 0.2 / 1e-4
    growth = max(np.roots([1.0, -1j * n, -100j * n, -1000j * n]).real)
    pair = looped(**NO_DRIFT, J_x=1e-4, J_y=1e-4, k_x=0.08338795, k_y=0.08338795, omega=[1e-10, 0.0, 0.0])
    rates = []
    for _ in range(4000):
        pair.step(5e-5)
        rates.append(math.hypot(pair.parts["gyro"].p, pair.parts["gyro"].q))
    assert math.log(rates[-1] / rates[1999]) / 0.1 == pytest.approx(growth, rel=0.05)


def test_no_nutation_is_the_limit_of_small_inertia():
    given = {"f": [3.0, -4.0, 5.0], "omega": [1e-4, -2e-4, 1e-2], "i_x": 1e-3, "i_y": -2e-3}
    slow, fast = started(**QUIET, **given), started(**QUIET, **given, J_x=1e-8, J_y=1e-8)
    for part in (slow, fast):
        for k in range(100):
            part.do_step(k * H, H)
    assert [fast.psi_x, fast.psi_y] == pytest.approx([slow.psi_x, slow.psi_y], rel=1e-5)


# ------------------------------------------------------------------------------------- springs [GYRO-POSITION]
@pytest.mark.parametrize("K_q, K_phi", [(0.4, 0.0), (0.0, 0.3), (-0.7, 0.2)])
def test_a_rotor_on_springs_against_the_closed_form(K_q, K_phi):
    """z = psi_x + j psi_y:  z' = -(K_phi + j K_q) z - omega,  from rest  z = -omega (1 - exp(-kappa t))/kappa."""
    w, kappa = complex(2e-4, -3e-4), complex(K_phi, K_q)
    part = started(**STILL, K_q=K_q, K_phi=K_phi, omega=[w.real, w.imag, 0.0])
    for k in range(1500):
        part.do_step(k * H, H)
    z = -w * (1.0 - np.exp(-kappa * 1.5)) / kappa
    assert complex(part.psi_x, part.psi_y) == pytest.approx(z, rel=1e-9)


@pytest.mark.parametrize("nutation", [{}, {"J_x": 1e-4, "J_y": 2e-4, "C_x": 0.02, "C_y": 0.03, "step": 1e-4}])
def test_a_null_of_the_pickoff_makes_a_drift_of_the_springs(nutation):
    """Hu 1981, eq. 5-68 in a loop with integral: the rotor stands at the null of its pickoff and drifts by it.

    k_y i_y = omega_x - (K_q null_y - K_phi null_x),    k_x i_x = omega_y - (-K_q null_x - K_phi null_y)
    """
    null, K_q, K_phi, w = (3e-5, -5e-5), 0.02, 0.01, (1e-4, -4e-5)
    values = {**STILL, "K_q": K_q, "K_phi": K_phi, "null_x": null[0], "null_y": null[1], **nutation}
    gyro = settled(3.0, **values, omega=[*w, 0.0])
    assert gyro.psi_x == pytest.approx(null[0], rel=1e-9) and gyro.psi_y == pytest.approx(null[1], rel=1e-9)
    about_x = 17.180e3 * DEG_H * gyro.i_y  # the torquer about y precesses about x
    about_y = 17.227e3 * DEG_H * gyro.i_x
    assert about_x == pytest.approx(w[0] - (K_q * null[1] - K_phi * null[0]), rel=1e-9)
    assert about_y == pytest.approx(w[1] - (-K_q * null[0] - K_phi * null[1]), rel=1e-9)


def test_springs_are_of_small_angles():
    with pytest.raises(ComponentError, match="K_q and K_phi are of small angles"):
        started(plain=True, **STILL, K_q=0.1, full=1, J_x=1e-4, J_y=1e-4)


def test_springs_are_the_same_in_python_and_native():
    """The reference run has none: both targets, bit for bit, with nutation and without."""
    for nutation in ({}, {"J_x": 1e-4, "J_y": 2e-4, "C_x": 0.02, "C_y": 0.03}):
        values = {"K_q": 0.3, "K_phi": 0.2, "null_x": 1e-5, "null_y": -2e-5, "omega": [1e-4, -2e-4, 0.3], **nutation}
        plain, native = (started(plain=kind, **STILL, **values) for kind in (True, False))
        for k in range(40):
            plain.do_step(k * H, H)
            native.do_step(k * H, H)
            assert (plain.u_x, plain.u_y, plain.psi_x) == (native.u_x, native.u_y, native.psi_x)
