"""The moving part of a table: rigid, with resonance, with friction that is elastic before it slides; frames."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.component.blocks.axis_body import further
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part

Body = load_part("table_body", BENCH)
J = 2.56
COULOMB, REACH = 0.137, 5e-6  # 1400 g.cm; 1 arcsec
RUBBING = {"axis_friction": COULOMB, "axis_friction_presliding": REACH}


def turned(h, time, torque, *, load=None, inputs=None, **parameters):
    """Return (angle, rate, friction) after each step of a body; torque, load: functions of the middle of the step."""
    part = Body(**parameters)
    for name, x in (inputs or {}).items():
        setattr(part, name, x)
    part.initialize()
    rows = []
    for k in range(round(time / h)):
        part.torque = torque((k + 0.5) * h)
        part.M_load = load((k + 0.5) * h) if load else 0.0
        part.do_step(k * h, h)
        rows.append((part.angle, part.rate, part.friction))
    return np.array(rows), part


# ---------------------------------------------------------------------------------------- linear motion
@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_rigid_body_with_drag_and_cable_is_exact(h):
    """Torques held over a step, against the matrix exponential."""
    viscous, cable, zero = 0.8, 12.0, 0.02
    rng = np.random.default_rng(3)
    torques = rng.normal(0.0, 2.0, round(0.4 / h))
    a = np.array([[0.0, 1.0, 0.0], [-cable / J, -viscous / J, 1.0 / J], [0.0, 0.0, 0.0]])
    step, x, expected = expm(a * h), np.array([0.1, 0.3, 0.0]), []
    for m in torques:
        x[2] = m + 0.05 + cable * zero
        x = step @ x
        expected.append(x[:2].copy())
    track, _ = turned(
        h, 0.4, lambda t: torques[int(t / h)], load=lambda t: 0.05, angle0=0.1, rate0=0.3, axis_viscous=viscous,
        axis_cable=cable, axis_cable_zero=zero, step=1.0,
    )  # fmt: skip
    assert np.allclose(track[:, :2], expected, rtol=1e-12, atol=1e-14)


def test_motor_and_plate_resonate():
    """Two bodies, a spring: the poles of the linearization, and a record against the exact two-body solution.

    J_m = 0.1 J, J_p = 0.9 J, k = w2 J_m J_p / J: free pair at w = 2 pi 120 Hz, damping 0.02; the common motion is that
    of J.
    """
    w, zeta, share = 2.0 * math.pi * 120.0, 0.02, 0.1
    values = {"axis_resonance": w, "axis_resonance_damping": zeta, "axis_share": share}
    part = Body(**values)
    part.initialize()
    poles = np.array(state_space(part, ["torque"], ["rate"]).poles())
    pair = sorted(poles, key=abs)[-2:]
    assert np.allclose(np.abs(pair), w) and np.allclose(np.real(pair), -zeta * w)
    jm, jp = share * J, (1.0 - share) * J
    k, d = w * w * jm * jp / J, 2.0 * zeta * w * jm * jp / J
    a = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-k / jm, k / jm, -d / jm, d / jm], [k / jp, -k / jp, d / jp, -d / jp]])
    h, x = 5e-4, np.zeros(4)  # motor, plate, their rates
    step, total = expm(a * h), np.zeros((4, 4))
    for tau, weight in zip(*np.polynomial.legendre.leggauss(8), strict=True):
        total += 0.5 * h * weight * expm(a * (0.5 * h * (1.0 + tau)))
    track, part = turned(h, 0.05, lambda t: 3.0 if t < 0.01 else -1.0, **values)
    for n, row in enumerate(track):
        x = step @ x + total @ np.array([0.0, 0.0, (3.0 if n < 20 else -1.0) / jm, 0.0])
        assert row[:2] == pytest.approx([x[1], x[3]], rel=1e-9, abs=1e-15)
    assert part.rate_motor == pytest.approx(x[2], rel=1e-9)
    assert abs(x[2] - x[3]) > 1e-3  # they did move against each other


def test_base_that_turns_drags_the_table_by_its_bearing_alone():
    """A free table keeps its inertial rate; the angle runs back with Earth rate."""
    earth = 7.292e-5
    track, part = turned(1e-2, 10.0, lambda t: 0.0, inputs={"omega_local": [0.0, 0.0, earth]}, rate0=-earth, step=1.0)
    assert track[-1, 0] == pytest.approx(-10.0 * earth, rel=1e-12) and part.omega[2] == pytest.approx(0.0, abs=1e-18)
    track, part = turned(
        1e-2, 10.0, lambda t: 0.0, inputs={"omega_local": [0.0, 0.0, earth]}, rate0=-earth, axis_viscous=J, step=1.0
    )
    assert part.omega[2] == pytest.approx(earth * (1.0 - math.exp(-10.0)), rel=1e-9)


def test_unbalance_by_elevation_of_the_axis():
    """20 kgf * 0.05 cm = 0.01 kg.m, axis 45 deg above the horizon: G m cos(45 deg) = 707 g.cm, hanging down at rest;
    966 g.cm at 15 deg, nothing for a vertical axis.  [BEARING-AIR]
    """
    for degrees, expected in ((45.0, 707.1), (15.0, 965.9), (90.0, 0.0)):
        base = Rotation.from_euler("x", 90.0 - degrees, degrees=True).as_matrix()
        pulls = []
        for angle in np.linspace(0.0, 2.0 * math.pi, 73):
            part = Body(base=base.tolist(), angle0=float(angle), axis_unbalance=[0.01, 0.0])
            part.initialize()
            part.do_step(0.0, 1e-6)
            pulls.append(part.alpha[2] * J / 9.80665e-5)
        assert max(pulls) == pytest.approx(expected, abs=0.1) and min(pulls) == pytest.approx(-expected, abs=0.1)


# --------------------------------------------------------------------------------------------- friction
def lugre(torque, time, at, static=COULOMB, slip_rate=1e-4, damping=0.0, reach=REACH):
    """Return angle and rate of the LuGre model as a differential equation, at the times."""

    def slope(t, y):
        _, v, z = y
        level = COULOMB + (static - COULOMB) * math.exp(-((v / slip_rate) ** 2))
        dz = v - abs(v) * z * COULOMB / reach / level
        return [v, (torque(t) - COULOMB / reach * z - damping * dz) / J, dz]

    return solve_ivp(slope, (0.0, time), [0.0] * 3, "Radau", t_eval=at, rtol=1e-8, atol=1e-13, max_step=1e-3).y


@pytest.mark.parametrize(("h", "error"), [(1e-3, 1.5e-4), (2.5e-4, 2e-5)])
def test_friction_beside_a_differential_equation(h, error):
    """A torque that swings beyond break-away (0.2 N.m): the table sticks, breaks loose, slides and sticks again."""

    def swing(t):
        return 0.25 * math.sin(4.0 * math.pi * t)

    at = np.arange(1, 11) * 0.06
    expected = lugre(swing, 0.6, at, static=0.2, damping=100.0)
    track, _ = turned(h, 0.6, swing, axis_friction_static=0.2, axis_friction_damping=100.0, **RUBBING)
    found = track[np.round(at / h).astype(int) - 1]
    for k in (0, 1):
        assert np.max(np.abs(found[:, k] - expected[k])) < error * np.max(np.abs(expected[k]))


def test_presliding_holds_and_breaks_loose_at_the_static_level():
    """Slowly loaded: a spring M_c / presliding at first, x = -(M_s / k) ln(1 - M / M_s) before it slides (the closed
    form for v << slip_rate), break-away at M_s = 0.2 N.m, then Coulomb friction 0.137 N.m: J a = M - M_c.
    """
    k = COULOMB / REACH

    def ramp(t):
        return 0.1 * t

    values = {"axis_friction_static": 0.2, "axis_friction_damping": 100.0, "axis_friction_slip_rate": 1e-3, **RUBBING}
    track, part = turned(1e-3, 2.3, ramp, **values)
    for t in (0.2, 1.0, 1.8):  # the damping lags by 100 / k = 4 ms
        expected = -0.2 / k * math.log(1.0 - 0.1 * (t - 100.0 / k) / 0.2)
        assert track[round(t * 1e3) - 1, 0] == pytest.approx(expected, rel=0.01)
    assert np.max(-track[:, 2]) == pytest.approx(0.2, rel=0.02)
    assert -track[-1, 2] == pytest.approx(COULOMB, rel=1e-3) and track[-1, 1] > 5e-3
    assert part.alpha[2] * J == pytest.approx(0.23 - COULOMB, rel=0.01)


def test_small_torque_springs_back_but_for_its_hysteresis():
    """Up to M_c / 2: x = z_c ln 2.  Back by d, z = -z_c + 1.5 z_c exp(-d / z_c), 0 at d = z_c ln 1.5: rest."""
    z_c = REACH

    def pulse(t):
        return 0.5 * COULOMB * max(0.0, 1.0 - abs(t - 1.0))

    track, _ = turned(1e-3, 3.0, pulse, axis_friction_damping=400.0, **RUBBING)
    assert np.max(track[:, 0]) == pytest.approx(z_c * math.log(2.0), rel=0.01)
    assert track[-1, 0] == pytest.approx(z_c * (math.log(2.0) - math.log(1.5)), rel=0.01)


def test_fast_table_is_braked_evenly():
    """1 rad/s: in one step the contact slides 200 times its reach; w = w0 - M_c t / J all the same."""
    track, _ = turned(1e-3, 1.0, lambda t: 0.0, rate0=1.0, **RUBBING)
    assert track[-1, 1] == pytest.approx(1.0 - COULOMB / J, rel=1e-6)


def test_friction_stops_the_table_where_the_energy_ends():
    """v2 J / (2 M_c): from 0.01 rad/s, 9.34e-4 rad; at rest it stays for good."""
    track, _ = turned(1e-3, 3.0, lambda t: 0.0, rate0=0.01, axis_friction_damping=400.0, **RUBBING)
    assert track[-1, 0] == pytest.approx(0.01**2 * J / (2.0 * COULOMB), abs=2.0 * REACH)
    assert abs(track[-1, 1]) < 1e-9 and abs(track[-1, 0] - track[-500, 0]) < 1e-9


# ------------------------------------------------------------------------------------ frames, refusals
def test_rates_and_forces_on_the_face():
    rng = np.random.default_rng(5)
    base, face = (Rotation.random(random_state=n).as_matrix() for n in (1, 2))
    earth, f = rng.normal(0.0, 1e-3, 3), rng.normal(0.0, 9.8, 3)
    inputs = {"omega_local": earth.tolist(), "f_local": f.tolist(), "face": face.tolist()}
    track, part = turned(1e-3, 0.5, lambda t: 1.0, inputs=inputs, base=base.tolist(), angle0=0.7, axis_viscous=0.3)
    c, s = math.cos(track[-1, 0]), math.sin(track[-1, 0])
    local = face @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ base
    spin = face @ np.array([0.0, 0.0, track[-1, 1]])
    assert np.allclose(part.omega, local @ earth + spin, atol=1e-15) and np.allclose(part.f, local @ f)
    before = [np.array(part.omega), part.t]
    part.do_step(part.t, 1e-5)
    assert np.allclose(part.alpha, (np.array(part.omega) - before[0]) / 1e-5, rtol=1e-4, atol=1e-8)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"axis_J": 0.0}, "axis_J = 0"),
        ({"axis_friction": 0.2, "axis_friction_static": 0.1}, "axis_friction_static = 0.1 N.m must be 0 or at least"),
        ({"axis_share": 1.0}, "axis_share = 1"),
        ({"axis_friction": 0.2, "axis_friction_presliding": 1e-8}, "axis_friction_presliding = 1e-08 rad is too small"),
    ],
)
def test_what_is_refused(values, text):
    with pytest.raises(ComponentError, match=text):
        turned(1e-3, 2e-3, lambda t: 0.0, **values)


def test_cosine_and_sine_a_small_way_further():
    """The series below 1 mrad and the addition theorem above it: to the last digits of cos and sin themselves."""
    for x in (0.3, -2.0, 40.0):
        for way in (1e-9, -3e-5, 9.99e-4, 1.01e-3, 0.5):
            c, s = further(math.cos(x), math.sin(x), way)
            assert abs(c - math.cos(x + way)) < 3e-16 + 1e-16 * abs(x) and abs(
                s - math.sin(x + way)
            ) < 3e-16 + 1e-16 * abs(x)


def test_friction_without_its_vanishing_exponentials():
    """Where exp(-50) and less are left out, and at the steady deflection, the law is the same to the last bit."""
    block = load_part("table_body", BENCH)(axis_friction=0.1, axis_friction_static=0.16, axis_friction_slip_rate=1e-4)
    block.initialize()
    contact = block.axis.friction
    for v in (0.0, 3e-5, -6.9e-4, 7.2e-4, 0.3):
        level = 0.1 + 0.06 * math.exp(-((v / 1e-4) ** 2))
        assert contact.limit(v) == level / contact.spring
    for z in (0.0, 2e-6, 5e-6, -5e-6):
        for dx in (1e-8, -4e-6, 2.4e-4, 2.6e-4, -1e-2):
            contact.z = z
            end = math.copysign(5e-6, dx)
            assert contact.after(dx, 5e-6) == end + (z - end) * math.exp(-abs(dx) / 5e-6)
