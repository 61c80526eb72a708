"""Servo loop of a table: closed forms and their figures, and what a run measures of a loop drawn at random."""

import copy
import importlib
import math

import control
import numpy as np
import pytest

import gyrobench as gb
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system

NAME = "table_servo_loop"
closed = importlib.import_module(type(load_system(NAME)).__module__ + ".closed")
ARCSEC = math.pi / 648000.0
GCM = 9.80665e-5
QUIET = {f"gyro.{n}": 0.0 for n in ("turn_on", "markov", "white", "pickoff")}


def loop(network=2, w_c=100.0 * math.pi, J_g=3e-5, c=0.03):
    """The gyro of TABLE-SERVO: H 0.04, H/c 4/3."""
    return closed.ServoLoop(network, w_c, 2.56, 0.0, 5e-4, 9.80665, 0.04, J_g, c, 10.0)


LOOPS = [
    (loop(1, J_g=1.2e-5), 53.8, 11.6, -22.7, 15876.0),
    (loop(2), 53.4, 9.4, -22.6, 13209.0),
    (loop(3, 20.0 * math.pi, c=1e-9), 45.4, 16.9, 20.0 * math.log10(0.098), None),
    (loop(4, 20.0 * math.pi, c=1e-9), 49.7, 12.0, -13.7, None),
]


@pytest.mark.parametrize(("servo", "phase", "upper", "lower", "stiffness"), LOOPS)
def test_networks(servo, phase, upper, lower, stiffness):
    """TABLE-SERVO: margins, both gain limits (control.margin alone shows one), K_T; unstable below the lower limit."""
    limits = servo.limits()
    assert servo.phase_margin() == pytest.approx(phase, abs=0.06)
    assert 20.0 * math.log10(limits[-1][1]) == pytest.approx(upper, abs=0.06)
    assert 20.0 * math.log10(limits[0][1]) == pytest.approx(lower, abs=0.06)
    assert servo.poles().real.max() < 0.0
    assert servo.poles(0.97 * limits[0][1]).real.max() > 0.0 and servo.poles(1.03 * limits[-1][1]).real.max() > 0.0
    assert servo.poles(1.03 * limits[0][1]).real.max() < 0.0 and servo.poles(0.97 * limits[-1][1]).real.max() < 0.0
    if stiffness:
        assert servo.stiffness * ARCSEC / GCM == pytest.approx(stiffness, abs=1.0)
    gain, _, _, _ = control.margin(servo.transfer_function())
    assert gain in (pytest.approx(limits[0][1], rel=1e-6), pytest.approx(limits[-1][1], rel=1e-6)) or servo.c < 1e-6


def test_network_on_another_gyro_is_unstable():
    """The network for 0.4 ms on a gyro of 10 ms."""
    assert loop(1, J_g=3e-4).poles().real.max() > 0.0


def test_damping_of_an_undamped_gyro_by_its_crossover():
    """w_gr = H / sqrt(J J_g): damping 0.036, 0.13, 0.29, 0.47, 0.68 at w_c / w_gr = 1.05, 1.2, 1.5, 2, 3."""
    w_gr = 0.04 / math.sqrt(2.56 * 3e-5)
    for ratio, damping in ((1.05, 0.036), (1.2, 0.13), (1.5, 0.29), (2.0, 0.47), (3.0, 0.68)):
        poles = loop(3, ratio * w_gr, c=1e-9).poles()
        poles = poles[np.abs(poles) > 1e-3]
        assert np.min(-poles.real / np.abs(poles)) == pytest.approx(damping, abs=0.02)


def test_closed_form_is_the_loop_of_the_parts():
    """Poles of the linearized table and gyro, connected by python-control, beside those of 1 + L."""
    servo = closed.ServoLoop(2, 100.0 * math.pi, 2.56, 0.02, 5e-4, 9.80665, 0.04, 3e-5, 0.03, 10.0)
    table = load_part("table_servo")(capture=0, viscous=0.02, H_g=0.04, J_g=3e-5, C_g=0.03, K_g=10.0)
    table.mode, table.face = 3.0, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    table.initialize()
    table.do_step(0.0, 1e-4)
    gyro = load_part("floated_gyro")(H=0.04, J=3e-5, C=0.03, **{n[5:]: 0.0 for n in QUIET})
    gyro.initialize()
    parts = control.feedback(
        state_space(table, ["u"], ["omega[1]"]), state_space(gyro, ["omega[1]"], ["u"]), sign=1
    ).poles()
    parts = sorted((p for p in parts if abs(p) > 1e-6), key=lambda p: (abs(p), p.imag))  # but the angle's own pole at 0
    assert np.allclose(parts, sorted(servo.poles(), key=lambda p: (abs(p), p.imag)), rtol=1e-5)


def test_static_angle():
    """1400 g.cm at 13209 g.cm/arcsec: 0.10599 arcsec; the compliance at rest is 1 / K_T."""
    servo = loop(2)
    assert servo.at_rest(1400.0 * GCM) / ARCSEC == pytest.approx(0.10599, abs=1e-5)
    assert servo.compliance(1e-6j).real == pytest.approx(1.0 / servo.stiffness, rel=1e-6)


# -------------------------------------------------------------------------------------------------- runs
def draw(seed):
    """Return options of a loop drawn at random: inertia, crossover, gyro, leads of the rings."""
    rng = np.random.default_rng(seed)
    return {
        "J": float(rng.uniform(1.5, 4.0)),
        "crossover": float(rng.uniform(40.0, 60.0)),
        "gyro.H": float(rng.uniform(0.1, 0.3)),
        "rings.ring_k_w": float(rng.uniform(20.0, 60.0)),
    }


def covered(runs: int) -> dict[str, tuple[int, int]]:
    """Return how many of the 95 % intervals hold the true value, and how many values there are, by name.

    Loops drawn at random, with the noise of the standard gyro.  Without the effect of the communication step: the
    truth of crossover, margin, limits and compliance is that of the model with step and delays or, for limits, moves
    by less than their u.
    """
    counts: dict[str, tuple[int, int]] = {}
    for k in range(runs):
        for c in gb.load(NAME, **draw(1000 + k)).run(seed=k + 1, check_step=False).result.coefficients:
            if c.closed is not None and not c.no_value:
                inside, n = counts.get(c.name, (0, 0))
                counts[c.name] = inside + (c.interval[0] <= c.closed <= c.interval[1]), n + 1
    return counts


@pytest.fixture(scope="module")
def drawn():
    """A loop drawn at random, with the noise of the standard gyro."""
    values = draw(11)
    return gb.load(NAME, **values).run(seed=5, check_step=False), values


@pytest.mark.long
def test_run_recovers_the_loop(drawn):
    """Each value within 3 u of its closed form; the margins of the linear model with step and delays are those too."""
    run, _ = drawn
    by_name = {c.name: c for c in run.result.coefficients}
    for name in ("K_T", "θ(M)", "b(M)", "f_c", "PM", "lower limit", "f_lower", "compliance", "M_r"):
        c = by_name[name]
        assert abs(c.estimate - c.closed) < 3.0 * c.u + 1e-3 * abs(c.closed), name
    assert by_name["K_T"].u < 0.03 * by_name["K_T"].estimate
    assert any("conditionally stable" in w for w in run.result.warnings)


@pytest.mark.long
def test_warnings_of_loads_and_of_a_low_crossover(drawn):
    """K_s below 9 k_w; a gap of 0.2 mm; an undamped gyro whose crossover is below 2 w_gr: said in the report."""
    run, values = drawn
    record = copy.deepcopy(run.record)
    soft = [w for w in run.result.warnings if "follower is soft" in w]
    assert bool(soft) == (9.0 * values["rings.ring_k_w"] > 300.0)
    p = record.run.parameters
    p |= {"rings.ring_K_s": 100.0, "bearing.air_gap": 2e-4, "table.network": 3, "table.crossover": 10.0, "gyro.J": 2e-5}
    warnings = load_system(NAME).reduce(record).warnings
    for text in ("follower is soft: K_s = 100", "bearing.air_gap = 200 µm is wide", "below twice the resonance"):
        assert any(text in w for w in warnings), text


@pytest.mark.long
def test_linear_model_of_the_run(drawn):
    """The discrete model, from the parts alone, has the phase margin and the limits of the closed form."""
    run, values = drawn
    table = next(t for t in run.result.tables if t.kind == "margins")
    model = next(r for r in table.rows if r[0].startswith("linear, with step"))
    servo = closed.loop_of(run.record.run.parameters)
    assert model[1] == pytest.approx(values["crossover"], rel=1e-3)
    assert model[2] == pytest.approx(servo.phase_margin(), abs=0.1)
    assert model[3] == pytest.approx(20.0 * math.log10(servo.limits()[-1][1]), abs=0.05)


def quiet(**values):
    run = gb.load(NAME, **QUIET, **values).run(seed=1, check_step=False)
    return {c.name: c for c in run.result.coefficients}


@pytest.mark.long
def test_follower_and_shaper_by_comparison():
    """Rings on the axis: 1397 g.cm instead of 127.  Without shaper 1400 g.cm turn the table by 8.4 times the angle."""
    rings = quiet(follower=False, hold=2.0)
    assert rings["M_r"].estimate == pytest.approx(rings["M_r"].closed, rel=2e-3)
    assert rings["M_r"].closed / GCM == pytest.approx(1400.0, rel=1e-3)
    bare = quiet(shaper=False, hold=2.0, load="1400g.cm", friction=0.0)
    assert bare["b(M)"].estimate == pytest.approx(bare["b(M)"].closed, rel=0.01)
    assert bare["b(M)"].closed * ARCSEC == pytest.approx(8.45 * 1400.0 * GCM / rings["K_T"].closed, rel=0.01)
    assert "K_T" not in bare and "PM" not in bare  # H/c = 1: table and float turn by the same angle, 0.896 arcsec


@pytest.mark.long
def test_vortex_torque_of_the_bearing_moves_the_null():
    """M_2 = 0.05 N.m acts at rest: the table stands M_2/K_T aside; differences, so stiffness and M_r, do not show it.

    Within a second: later the float, which is aside by M_2/(G K_g) too, lets in the Earth's rate about its spin axis.
    """
    runs = [gb.load(NAME, **QUIET, **more).run(seed=1, check_step=False) for more in ({}, {"bearing.air_vortex": 0.05})]
    still, aside = ({c.name: c for c in r.result.coefficients} for r in runs)
    time = runs[0].record.channels["time"]
    null = [r.record.channels["table.angle"][(time > 0.5) & (time < 1.0)].mean() for r in runs]
    assert null[1] - null[0] == pytest.approx(0.05 / still["K_T"].closed, rel=1e-3)
    for name in ("K_T", "M_r"):
        assert aside[name].estimate == pytest.approx(still[name].estimate, rel=1e-6)


@pytest.mark.long
def test_undamped_gyro_returns_the_table_and_holds_the_torque_by_its_float():
    """c -> 0: the table angle under a constant torque is 0, the float holds M / (G K_g); no stiffness is given."""
    c = quiet(network=3, hold=2.0, friction=0.0)
    assert abs(c["θ(M)"].estimate) < 1e-3 * c["b(M)"].estimate
    assert c["b(M)"].estimate == pytest.approx(c["b(M)"].closed, rel=1e-3)
    assert "integrates" in c["K_T"].no_value and c["PM"].estimate == pytest.approx(c["PM"].closed, abs=0.5)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"J": 0.0}, "J = 0"),
        ({"load": 5.0}, "twice it is hung too, and the motor gives 9.80665 N.m"),
        ({"network": 3, "load": 0.2}, "twice it turns the float by"),
        ({"crossover": 500.0}, "the test sines of four times it need a step"),
        ({"network": 3, "table.stiffness": 1e5}, "stiffness"),
    ],
)
def test_what_is_refused(values, text):
    with pytest.raises(gb.GyrobenchError, match=text):
        gb.load(NAME, **values).run()
