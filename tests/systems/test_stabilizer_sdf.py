"""Closed forms of the three kinds of gyro, their numbers and errata, and the co-simulation against them."""

import importlib
import math
import sys
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "stabilizer_sdf"
SYSTEM = load_system(NAME)
closed = importlib.import_module(type(SYSTEM).__module__ + ".closed")
ARCMIN, DEG = math.pi / 10800.0, math.pi / 180.0
SATELLITE = {"J0": 1e6, "J": 10.0, "H": 1e4, "M": 10.0}
C, K = 62.5, 100.0  # i_g = H/C = 160
assert sys.modules[closed.__name__] is closed


def axis(c=0.0, k=0.0, **more):
    return closed.StabilizedAxis(**{**SATELLITE, "C": c, "K": k, **more})


def by_matrix(p, t):
    """a, b of the linear axis by expm, step by step."""
    a = np.zeros((5, 5))  # a, a', b, b', M/J0
    a[0, 1] = a[2, 3] = 1.0
    a[1, [3, 4]] = -p.H / p.J0, 1.0
    a[3, [1, 2, 3]] = p.H / p.J, -p.K / p.J, -p.C / p.J
    m, x = expm(a * (t[1] - t[0])), np.array([0.0, 0.0, 0.0, 0.0, p.M / p.J0])
    rows = [x]
    for _ in t[1:]:
        rows.append(m @ rows[-1])
    rows = np.array(rows)
    return rows[:, 0], rows[:, 2]


# ------------------------------------------------------------------------------------------ closed forms
@pytest.mark.parametrize(
    "kind, c, k",
    [("integrating", 0.0, 0.0)]
    + [("rate-integrating", c, 0.0) for c in (6.25, 62.5, 200.0)]
    + [("rate", c, k) for c, k in ((62.5, 100.0), (200.0, 500.0), (0.0, 500.0))],
)
def test_closed_forms_solve_the_equations(kind, c, k):
    """Against expm, below and above the aperiodic limit."""
    p, t = axis(c, k), np.linspace(0.0, 100.0, 2001)
    for form, exact in zip(closed.FORMS[kind](p, t), by_matrix(p, t), strict=True):
        assert np.abs(form - exact).max() < 1e-10 * np.abs(exact).max()


def test_errata_of_the_rate_integrating_gyro():
    """5-34 with J0 in the third term of b is within 0.06 of the offset at zeta 0.1, with J 1.7."""
    p, t = axis(6.25), np.linspace(0.0, 100.0, 20001)
    assert p.zeta == pytest.approx(0.0988, abs=1e-4)
    a, b = by_matrix(p, t)
    size = p.J0 * p.C * p.M / p.H**3
    light_a, light_b = closed.light(p, t)
    printed = light_b + (p.J0 - p.J) * p.C * p.M / p.H**3 * (
        1.0 - np.exp(-p.C / (2 * p.J) * t) * np.cos(math.sqrt(p.n**2 - (p.C / (2 * p.J)) ** 2) * t)
    )
    assert np.abs(light_b - b).max() / size == pytest.approx(0.06, abs=0.01)
    assert np.abs(printed - b).max() / size > 1.0
    assert np.abs(light_a - a).max() / (p.J * p.M / p.H**2) == pytest.approx(0.29, abs=0.01)
    # and the light form fails where it does not hold: zeta 0.99
    p = axis(62.5)
    error = np.abs(closed.light(p, t)[0] - by_matrix(p, t)[0]).max() / (p.J * p.M / p.H**2)
    assert error == pytest.approx(3.9, abs=0.1)


def test_numbers_of_the_method():
    """2.15 arcmin (not 6), 1.43 deg, apparent inertia, aperiodic limit 2 sqrt(J/J0) H c, quasi-spring."""
    t = 100.0
    assert closed.line(axis(C))[1] * t / ARCMIN == pytest.approx(2.149, abs=0.001)  # M t / (H i_g)
    p = axis(C, K)
    assert p.inertia == pytest.approx(1e6 + 1e8 / 100.0)
    assert 10.0 * t**2 / (2 * p.inertia) / DEG == pytest.approx(1.432, abs=0.001)
    assert closed.rate(p, np.array([0.0, t]))[0][-1] / DEG == pytest.approx(1.441, abs=0.001)
    assert axis(2 * math.sqrt(10.0 / 1e6) * 1e4).zeta == pytest.approx(1.0)
    assert axis().stiffness == pytest.approx(1e7)


# ------------------------------------------------------------------------------------------ co-simulation
def load(record):
    """t, a, b of the load phase from its opening on."""
    inside = record.channels["exciter.gate"] > 0.5
    inside &= record.channels["exciter.phase"] == 1
    t, a, b = (record.channels[n][inside] for n in ("time", "platform.attitude", "gyro.b"))
    return t - t[0], a - a[0], b - b[0]


def run(session, step, **values):
    session.system.step = step
    return session.run(values, seed=1)


def nonlinear(p, t):
    """With cos(b) as it is, by solve_ivp."""

    def right(_, x):
        c = math.cos(x[2])
        return [x[1], (p.M - p.H * c * x[3]) / p.J0, x[3], (p.H * c * x[1] - p.C * x[3] - p.K * x[2]) / p.J]

    found = solve_ivp(right, (0.0, t[-1]), [0.0] * 4, "DOP853", t_eval=t, rtol=1e-11, atol=1e-16)
    return found.y[0], found.y[2]


CASES = [("integrating", 0.0, 0.0, 10.0), ("rate-integrating", C, 0.0, 100.0), ("rate", C, K, 100.0)]


@pytest.mark.parametrize("kind, c, k, time", CASES)
@pytest.mark.long
def test_cosimulation_converges_to_the_equations(session, kind, c, k, time):
    """The exchange errs by about M h t/(2 J0) in a and some M h/H in b: half of it at half the step."""
    errors = []
    for step in (2e-3, 1e-3, 5e-4):
        t, a, b = load(run(session, step, kind=kind, time=f"{time}s"))
        p = axis(c, k)
        exact_a, exact_b = nonlinear(p, t)
        errors.append((np.abs(a - exact_a).max(), np.abs(b - exact_b).max()))
        assert errors[-1][0] < p.M * step * time / p.J0 + 2.0 * p.M / p.H**2 * p.J * p.n * step
        assert errors[-1][1] < 4.0 * p.M * step / p.H
    print(kind, errors)
    for coarse, fine in pairwise(errors):
        assert coarse[0] / fine[0] == pytest.approx(2.0, rel=0.1)
        assert coarse[1] / fine[1] == pytest.approx(2.0, rel=0.15)


@pytest.mark.long
def test_satellite_example(session):
    """2.15 arcmin with cos(b) and 5.70 deg of float; 1.44 deg for the rate gyro."""
    _, a, b = load(run(session, 2e-4, kind="rate-integrating"))
    assert a[-1] / ARCMIN == pytest.approx(2.15, abs=0.01)
    assert b[-1] / DEG == pytest.approx(5.70, abs=0.01)
    _, a, _ = load(run(session, 2e-4, kind="rate"))
    assert a[-1] / DEG == pytest.approx(1.441, abs=0.001)


@pytest.mark.long
def test_nutation_neither_grows_nor_dies(session):
    """Integrating gyro, 600 s without load: amplitude of b' stays; no pole of the discrete model leaves the circle."""
    record = run(session, 5e-3, kind="integrating", M="1e-3N.m", time="3000s")
    after = record.channels["exciter.phase"] == 2
    b, t = record.channels["gyro.b"][after], record.channels["time"][after]
    b = b - np.polyval(np.polyfit(t, b, 1), t)
    quarter = b.size // 4
    assert np.std(b[-quarter:]) == pytest.approx(np.std(b[:quarter]), rel=1e-3)
    model = record.run.linear.closed.discrete
    assert np.abs(np.linalg.eigvals(np.array(model.A))).max() < 1.0 + 1e-7
    assert not any("unstable" in n for n in record.run.notes)


@pytest.mark.parametrize(
    "kind, name, wanted",
    [
        ("integrating", "S", 1e7),
        ("integrating", "n", 1e4 / math.sqrt(1e7)),
        ("rate-integrating", "H²/C", 1e8 / 62.5),
        ("rate-integrating", "b_o", -1e6 * 62.5 * 10.0 / 1e12 / ARCMIN),
        ("rate", "J0 + H²/K", 2e6),
        ("rate", "slope", 62.5 * 1e8 * 10.0 / (100.0 * 1e6 + 1e8) ** 2 / ARCMIN),
    ],
)
def test_reduction_finds_the_figures(session, kind, name, wanted):
    """M = 1 N.m, so that cos(b) stays within 5e-5 of 1; the estimate is within 1 % and its interval holds the truth."""
    record = run(session, 2e-4, kind=kind, M="1N.m", time="60s" if kind != "integrating" else "20s")
    scale = 0.1 if name in ("b_o", "slope") else 1.0  # proportional to M
    found = next(c for c in session.system.reduce(record).coefficients if c.name == name)
    assert found.estimate == pytest.approx(wanted * scale, rel=0.01)
    assert found.closed == pytest.approx(wanted * scale, rel=1e-3)


@pytest.mark.parametrize(
    "kind, M, share",
    [
        ("integrating", 1e-3, 1.0),
        ("rate-integrating", 1e-3, 1.0),
        ("rate", 1e-3, 1e8 / (1e8 + 100.0 * 1e6)),  # the float leans by -J0 a'/H, the spring gives H2/(H2 + K J0) back
        ("rate-integrating", 10.0, 1.0 / math.cos(5.7 * DEG)),  # behind the load the float stands at 5.7 deg
    ],
)
def test_command_turns_the_axis(session, kind, M, share):
    """Torque H k i on the float's axis: without spring the axis precesses with k i / cos(b)."""
    record = run(session, 2e-3, kind=kind, M=M, time="100s", command=2e-5)
    gain = next(c for c in session.system.reduce(record).coefficients if c.name == "rate gain")
    assert gain.estimate == pytest.approx(share, rel=2e-4)
    assert gain.closed == pytest.approx(share, rel=2e-4)


def test_axis_drifts_with_its_gyro(session):
    """D_F = 2, D_S = 0.5 deg/h per g: at rest omega_d = D_F - D_S; the axis follows with omega_d / cos(b)."""
    dph = DEG / 3600.0
    values = {"gyro.D_F": 2.0 * dph, "gyro.D_S": 0.5 * dph}
    record = run(session, 2e-3, kind="rate-integrating", **values)
    drift = next(c for c in session.system.reduce(record).coefficients if c.name == "drift")
    assert drift.estimate == pytest.approx(1.5 / math.cos(5.7 * DEG), rel=1e-4)
    assert drift.closed == pytest.approx(1.5 / math.cos(5.7 * DEG), rel=1e-4)


def test_motor_takes_the_load_off_the_float(session):
    """M_motor = -offload b: the float comes to rest at M / offload, and the loop measured is that of the model."""
    record = run(session, 2e-3, kind="rate-integrating", offload="2000N.m/rad", time="60s")
    _, _, b = load(record)
    assert b[-1] == pytest.approx(10.0 / 2000.0, rel=0.02)
    result = session.system.reduce(record)
    assert any(r.kind == "loop" for r in result.responses)
    agree = next(t for t in result.tables if t.kind == "margins.agreement")
    assert agree.rows[0][3] < 0.1 and agree.rows[0][4] < 1.0


def test_friction_turns_with_the_base(session):
    """viscous c, no motor: (J0 s2 + (c + H2/C) s) a = c s base at low frequency: isolation c C/H2."""
    record = run(session, 2e-3, kind="rate-integrating", viscous="1e5N.m.s/rad", time="20s")
    response = next(r for r in session.system.reduce(record).responses if r.name == "isolation")
    f = np.array(response.x)
    s = 2j * np.pi * f
    p = axis(C)
    felt = p.H**2 * s / (p.J * s + p.C)  # what the gyro adds: H s * H s a / (J s2 + C s)
    wanted = np.abs(1e5 * s / (p.J0 * s**2 + 1e5 * s + felt))
    assert np.array(response.y) == pytest.approx(wanted, rel=0.01)


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.long
def test_the_stop_ends_the_run(session, tmp_path, command):
    code, _, err = command("run", NAME, "--set", "float_stop=3deg", "--step", "2ms", "--out", tmp_path / "r")
    assert code == 3
    assert (
        "the float has reached its stop" in err and "t = 53.0" in err
    )  # 3 deg H/M, the lag J0 C/H2 of b, and the settling
    said = load_system(NAME).with_values({"float_stop": "3deg"}).warnings()
    assert "will reach its stop of 3° after about 52.4 s" in said[0]


@pytest.mark.parametrize(
    "values, message",
    [
        ({"kind": "free"}, "kind = free: must be one of integrating, rate-integrating, rate"),
        ({"J0": 0.0}, "J0 = 0 kg.m2: must be > 0"),
        ({"H": -1.0}, "H = -1 N.m.s: must be > 0"),
        ({"C": -1.0}, "C = -1 N.m.s/rad: must be >= 0"),
        ({"C": 0.0}, "C = 0 N.m.s/rad: a rate-integrating gyro has damping"),
        ({"kind": "rate", "K": 0.0}, "K = 0 N.m/rad: a rate gyro has a spring"),
        ({"form": "light"}, "form = light with a damping of 0.988: 5-34 holds for light damping, up to 0.3"),
        ({"kind": "rate", "form": "light"}, "form = light is 5-34, of the rate-integrating gyro"),
        ({"H": 1e7}, "step = 0.001 s: the nutation of"),
    ],
)
def test_refuses(values, message):
    with pytest.raises(InvalidConfigurationError, match=message):
        load_system(NAME).with_values(values).refuse()


def test_a_gyro_without_spring_and_momentum_is_refused(tmp_path, command):
    code, _, err = command("run", NAME, "--part", "gyro=compliant_gyro", "--out", tmp_path / "r")
    assert code == 2
    assert "this system needs a gyro with spring and damper" in err
