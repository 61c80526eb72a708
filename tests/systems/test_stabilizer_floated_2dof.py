"""The floated gyro as sensor of a stabilizer: closed forms, errata, conditional stability, margins, refusals."""

from __future__ import annotations

import importlib
import json
import logging
import math
from itertools import pairwise
from typing import Any

import control
import numpy as np
import pytest
from gimballed import session as with_methods
from scipy.integrate import solve_ivp

from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.step_effect import step_effects, with_step
from gyrobench.reduction.loops import margins
from gyrobench.result import StepCheck
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "stabilizer_floated_2dof"
ARCSEC = math.pi / 648000.0
#: no drift, no noise, no friction: what is left is the loop of the closed forms
STILL = {f"gyro.{n}_{c}": 0.0 for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"} | {
    f"gyro.D{c}_{k}": 0.0 for c in "xy" for k in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")
}
IDEAL = {**STILL, "viscous": 0.0}
DEFAULT = {"J": 0.5, "K": 16500.0, "tau1": 0.2, "T1": 2.0, "tau2": 0.03, "T2": 0.003}


MODULE = type(load_system(NAME)).__module__
closed: Any = importlib.import_module(".closed", MODULE)


def session(*phases: LoopPhase) -> Session:
    """The system with another plan."""
    plan = LoopPlan(list(phases))
    return with_methods(NAME, plan=lambda self: plan)


def polynomial(p: Any) -> Any:
    """J s2 (1 + T1 s)(1 + T2 s) + K (1 + tau1 s)(1 + tau2 s), by hand."""
    t, big = p.tau1 + p.tau2, p.T1 + p.T2
    return [p.J * p.T1 * p.T2, p.J * big, p.J + p.K * p.tau1 * p.tau2, p.K * t, p.K]


@pytest.fixture(scope="module")
def whole() -> Any:
    """The default plan with its noise."""
    with Session(NAME) as s:
        return s.run({}, seed=4)


@pytest.fixture(scope="module")
def steps() -> Any:
    with session(LoopPhase("load step", "torque", "step", 1, 0.2, settle=0.1, dwell=8.0)) as s:
        yield s


def angle(record: Any) -> tuple[Any, Any]:
    inside = record.channels["exciter.gate"] > 0.5
    t = record.channels["time"][inside]
    return t - t[0], record.channels["platform.attitude"][inside]


# ------------------------------------------------------------------------------------ closed forms
def test_numbers_of_the_method() -> None:
    """Crossover 100 rad/s, margin 52.3 degrees, slope -24 dB/dec, lower limit 0.044; python-control agrees."""
    p = closed.LagLeadLoop(**DEFAULT)
    s = control.tf("s")
    loop = p.K * (1 + p.tau1 * s) * (1 + p.tau2 * s) / (1 + p.T1 * s) / (1 + p.T2 * s) / (p.J * s**2)
    gm, pm, w_gm, w_pm = control.margin(loop)
    assert p.margin() == pytest.approx((w_pm, pm), rel=1e-6)
    assert p.limit() == pytest.approx((w_gm, gm), rel=1e-6)
    assert (w_pm, pm, gm) == pytest.approx((100.07, 52.29, 0.04398), rel=1e-3)
    assert p.slope(w_pm) == pytest.approx(-23.7, abs=0.05)
    assert p.compliance(0.0) == pytest.approx(1.0 / (8250.0 * 2.0))


def test_limit_and_routh_are_those_of_the_roots() -> None:
    """Random networks, with a net lead or not: stable() and the share of the gain at the limit, by the roots."""
    rng, kinds = np.random.default_rng(5), set()
    for _ in range(300):
        p = closed.LagLeadLoop(*10.0 ** rng.uniform([-1, 2, -2, -2, -3, -3], [1, 5, 1, 1, 0, 0]))
        roots = np.roots(polynomial(p))
        assert p.stable() == bool(np.max(roots.real) < 0.0), p
        at = p.limit()
        kinds.add((p.stable(), at is not None))
        if at is not None:
            values = {**p.__dict__, "K": at[1] * p.K}
            there = np.roots(polynomial(closed.LagLeadLoop(**values)))
            near = there[np.argmin(np.abs(there - 1j * at[0]))]
            assert near == pytest.approx(1j * at[0], rel=1e-6)
    assert len(kinds) == 4


def test_static_error_is_not_removed_by_the_lag(steps: Session) -> None:
    """theta/M at rest = 1/(K_m K_x K_G), 2.5 arcsec for 0.2 N.m; it goes with K_G, as T1 goes to infinity."""
    _, a = angle(steps.run(IDEAL))
    assert a[-1] == pytest.approx(0.2 / 16500.0, rel=1e-6)
    _, a = angle(steps.run({**IDEAL, "T1": 20.0, "K_G": 20.0}))  # the same loop at the crossover
    assert a[-1] == pytest.approx(0.2 / 165000.0, rel=1e-4)


def test_5_25_prints_the_loop_gain(steps: Session) -> None:
    """theta/M of the parts is the closed form; the printed K_m K_x/(J s2) is another quantity altogether."""
    linear = steps.prepare(IDEAL)[2].linear
    model = linear.closed.continuous
    f = np.array([0.01, 0.5, 2.0, 16.0, 60.0])
    s = 2j * np.pi * f
    found = margins.excitation_response(model, "torque", 1, "platform.attitude", f)
    np.testing.assert_allclose(found, closed.LagLeadLoop(**DEFAULT).compliance(s), rtol=1e-6)
    assert np.min(np.abs(8250.0 / (0.5 * s**2) / found)) > 1e3
    loop = linear.loops["stabilizer"].continuous
    np.testing.assert_allclose(
        margins.model_response(loop, f)[:, 0, 0], closed.LagLeadLoop(**DEFAULT).gain(s), rtol=1e-6
    )  # with G, it is L


# ------------------------------------------------------------------------------------ conditional stability
@pytest.mark.parametrize(("share", "grows"), [(0.05, False), (0.04, True), (10.0, False)])
def test_stability_by_the_gain(steps: Session, share: float, grows: bool, caplog: pytest.LogCaptureFixture) -> None:
    """Stable at 5 % and at ten times the gain, unstable at 4 %, with the rate of the roots: measured on the
    maxima of |theta| about its rest.  The step shifts the damping: by 0.03 1/s at 4 %, of 0.2."""
    with caplog.at_level(logging.WARNING, "gyrobench"):
        record = steps.run({**IDEAL, "stiffness": share * 8250.0, "load": 0.2})
    p = closed.LagLeadLoop(**{**DEFAULT, "K": share * 16500.0})
    assert p.stable() is not grows
    t, a = angle(record)
    swing = a - 0.2 / p.K
    early, late = (np.max(np.abs(swing[(t > x) & (t < x + 1.0)])) for x in (1.0, 6.5))
    assert (late > early) == grows
    if share < 1.0:
        slowest = max(np.roots(polynomial(p)), key=lambda r: (r.imag > 1.0, r.real))
        assert math.log(late / early) / 5.5 == pytest.approx(slowest.real, abs=0.06)
    said = " ".join(caplog.messages)
    assert ("is unstable: pole +" in said) == grows


def reference(M: float, time: float, t: Any) -> Any:
    """theta under a blow with the motor limited to 2.7 N.m and the pickoff to 0.1 rad, by solve_ivp."""

    def right(now: float, x: Any) -> list[float]:
        e = min(max(x[0], -0.1), 0.1)
        lag = x[2] + 0.1 * (e - x[2])
        y = x[3] + 10.0 * (lag - x[3])
        motor = min(max(-16500.0 * y, -2.7), 2.7)
        load = M if now < time else 0.0
        return [x[1], (motor + load - 0.02 * x[1]) / 0.5, (e - x[2]) / 2.0, (lag - x[3]) / 0.003]

    return solve_ivp(right, (0.0, t[-1]), [0.0] * 4, t_eval=t, max_step=5e-4, rtol=1e-7, atol=1e-10).y[0]


@pytest.mark.long
def test_a_motor_at_its_limit_makes_the_loop_unstable(caplog: pytest.LogCaptureFixture) -> None:
    """5 N.m for 50 ms comes back, for 100 ms it does not: the same linear loop, the motor gives 2.7 N.m."""
    summaries = []
    for time, comes_back in ((0.05, True), (0.1, False)):
        blow = LoopPhase("blow", "torque", "step", 1, 5.0, settle=0.1, dwell=time)
        with session(blow, LoopPhase("after the blow", dwell=3.0)) as s:
            with caplog.at_level(logging.WARNING, "gyrobench"):
                record = s.run({**STILL, "blow": 5.0, "blow_time": time})
            summaries.append(s.system.reduce(record))
        t, a = record.channels["time"] - 0.1, record.channels["platform.attitude"]
        t, a = t[t >= 0.0], a[t >= 0.0]
        wanted = reference(5.0, time, t[t <= 0.6])  # later the growing swing takes small differences apart
        assert np.max(np.abs(a[t <= 0.6] - wanted)) < 0.04 * np.max(np.abs(wanted))
        assert (np.max(np.abs(a[t > 2.0])) < 1e-3 * np.max(np.abs(a))) == comes_back
    assert "becomes unstable at 0.044 of its gain, where it swings with 2.05 Hz" in " ".join(caplog.messages)
    quiet, loud = summaries
    assert any("comes back to rest" in x for x in quiet.summary)
    assert not any("did not come to rest" in w for w in quiet.warnings)
    assert any("the motor's limit made it unstable" in w for w in loud.warnings)
    assert any("beyond its range" in w for w in loud.warnings)


# ------------------------------------------------------------------------------------ sweep, margins, measures
@pytest.mark.long
def test_margins_of_sweep_and_jacobians_agree(whole: Any) -> None:
    """Issue: within 1 dB and 3 degrees up to twice the crossover; here far closer, with the gyro's noise."""
    result = load_system(NAME).reduce(whole)
    table = next(t for t in result.tables if t.kind == "margins.agreement")
    (exact, far, count, db, degrees, _), (smooth, _, _, db_c, degrees_c, _) = table.rows
    assert exact == "linear, with step and delays" and smooth == "linear, continuous"
    assert far == pytest.approx(31.5, abs=0.1) and count >= 14
    assert db < 0.02 and degrees < 0.15
    assert db_c < 0.2 and degrees_c < 1.0
    note = next(t for t in result.tables if t.kind == "margins").caption
    assert "stabilizer.v → platform.v: 0.0001 s" in note


def test_the_step_costs_margin_in_the_first_order(steps: Session) -> None:
    """Half the step, half the loss: gain and phase of the linear model with step against the closed form."""
    f = np.array([2.0, 16.0])
    exact = closed.LagLeadLoop(**DEFAULT).gain(2j * np.pi * f)
    lost = []
    for h in (2e-4, 1e-4, 5e-5):
        model = steps.prepare(IDEAL, step=h)[2].linear.loops["stabilizer"].discrete
        lost.append(margins.model_response(model, f)[:, 0, 0] / exact - 1.0)
    assert abs(lost[1][1]) == pytest.approx(0.0138, abs=1e-3)  # 1.3 % and 0.27 degrees at the crossover
    for coarse, fine in pairwise(lost):
        np.testing.assert_allclose(coarse / fine, 2.0, atol=0.08)


@pytest.mark.long
def test_measures_of_the_whole_run(whole: Any) -> None:
    result = load_system(NAME).reduce(whole, {"PM": (45.0, None)})
    assert "the gain may fall by 27.0791 ± 0.0078 dB (95 %) to an oscillation at 2.04 Hz" in result.summary[0]
    assert any(s.endswith("carried over by viscous friction (100 %).") for s in result.summary)
    c = {c.name: c for c in result.coefficients}
    assert result.verdict == "pass" and c["PM"].verdict == "pass"
    for name in ("θ*", "S", "rate gain"):
        assert abs(c[name].estimate - c[name].closed) < 4.0 * c[name].u, name
    assert abs(c["drift"].z) < 4.0 and abs(c["N"].z) < 4.0
    # -0.3 + 0.7 + 0.04 deg/h; the command has turned the platform by 16 mrad: (-0.1 - 0.02) 0.016 deg/h more
    assert c["drift"].truth == pytest.approx(0.44 - 0.0019, abs=1e-4)
    assert c["f_c"].estimate == pytest.approx(c["f_c"].closed, rel=1e-3)
    assert c["PM"].estimate == pytest.approx(c["PM"].closed, abs=0.1)
    assert c["lower limit"].estimate == pytest.approx(c["lower limit"].closed, rel=0.01)
    assert c["slope"].estimate == pytest.approx(c["slope"].closed, abs=0.2)
    assert c["isolation"].estimate == pytest.approx(c["isolation"].closed, abs=0.4)
    assert [r.kind for r in result.responses] == ["step", "step", "loop", "ratio"]
    for r in result.responses[:2]:
        worst = np.max(np.abs(np.array(r.curves[0].y) - np.array(r.y)))
        assert worst < 5e-3 * np.ptp(r.y), r.name  # the rate is noisy
    without = c["lower limit"].models[1]  # the linear model without the step
    assert any("conditionally stable" in w and f"{without:.3g}" in w for w in result.warnings)


def test_isolation_is_friction_and_with_a_real_motor_its_back_emf() -> None:
    """th/base = c s/(J s2 + c s + K_m K_x G): c = 0.02, and with the real motor k_t k_e/R = 0.1 more."""
    sines = [LoopPhase(f"{f} Hz", "motion", "sine", 1, 0.02, f, settle=4.0, dwell=2.0) for f in (1.0, 3.0)]
    with session(*sines) as s:
        for values, drag in (({}, 0.02), ({"motor": "real"}, 0.12)):
            result = s.system.reduce(s.run({**STILL, **values}))
            r = next(r for r in result.responses if r.name == "isolation")
            wanted = np.abs(closed.LagLeadLoop(**DEFAULT).isolation(2j * np.pi * np.array(r.x), drag))
            np.testing.assert_allclose(r.y, wanted, rtol=0.03)
            linear = next(c for c in r.curves if c.label.startswith("linear, with step"))
            there = np.interp(np.log(r.x), np.log(linear.x), linear.y)
            np.testing.assert_allclose(r.y, there, rtol=2e-3)


def test_command_and_drift_turn_the_platform() -> None:
    """A current in the torquer about y turns the platform about x; so does the drift: 0.44 deg/h at rest, and
    (-0.1 - 0.02) sin(a) deg/h with the platform turned by a = 8 mrad (Dx_y and Dx_yz)."""
    with session(
        LoopPhase("command step", "command", "step", 1, 2e-3, settle=2.0, dwell=4.0), LoopPhase("drift", dwell=4.0)
    ) as s:
        record = s.run({n: 0.0 for n in STILL if ".D" not in n})
    t, a = record.channels["time"], record.channels["platform.attitude"]
    for end, turn in ((5.95, 2e-3), (9.95, 0.0)):
        here = (t > end - 0.5) & (t < end)
        drift = (0.44 - 0.12 * np.mean(a[here])) * ARCSEC  # rad/s
        assert np.polyfit(t[here], a[here], 1)[0] == pytest.approx(turn + drift, abs=2e-4 * drift)


def test_the_second_channel_is_caged() -> None:
    """A base that turns about y by w leaves u_y = w/(CAGE k_x) = 0.01/(12 0.0835) V, and x at rest."""
    with session(LoopPhase("turn", "motion", "step", 2, 0.1, 0.1, settle=0.1, dwell=21.0)) as s:
        record = s.run(STILL)
    assert np.max(np.abs(record.channels["platform.attitude"])) < 1e-5  # H k_x i_x on the axis: 0.2 0.02 N.m / 16500
    assert not np.any(record.channels["gyro.saturated"] > 0.5)


# ------------------------------------------------------------------------------------ bad input
@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"T1": 0.0}, r"T1 = 0 s: must be > 0"),
        ({"T2": -0.003}, r"T2 = -0\.003 s: must be > 0"),
        ({"J_x": 0.0}, r"J_x = 0 kg\.m2: must be > 0"),
        ({"motor": "perfect"}, "motor = perfect: must be one of ideal, real"),
        ({"load": 3.0}, r"load = 3 N\.m: the motor gives 2\.7 N\.m"),
    ],
)
def test_refuses(values: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=says):
        load_system(NAME).with_values(values).refuse()


def test_a_poor_network_is_told_and_fails_acceptance(steps: Session, caplog: pytest.LogCaptureFixture) -> None:
    """tau2 below T2 is no lead: said before the run; a margin below 45 degrees fails the specification."""
    with caplog.at_level(logging.WARNING, "gyrobench"):
        steps.run({**IDEAL, "tau2": 0.002})
    said = " ".join(caplog.messages)
    assert "T1 > tau1 > tau2 > T2 does not hold" in said
    assert "is unstable: pole +" in said
    weak = closed.LagLeadLoop(**{**DEFAULT, "tau2": 0.015})
    assert 20.0 < weak.margin()[1] < 45.0
    sines = [LoopPhase(f"{f} Hz", "test", "sine", 1, 5e-4, f, settle=2.0, dwell=1.0) for f in (5.0, 8.0, 12.0, 18.0)]
    with session(*sines) as s:
        result = s.system.reduce(s.run({**STILL, "tau2": 0.015}), {"PM": (45.0, None)})
    pm = next(c for c in result.coefficients if c.name == "PM")
    assert pm.estimate == pytest.approx(weak.margin()[1], abs=1.0)
    assert pm.verdict == "fail" and result.verdict == "fail"
    assert any("more than 45° is wanted" in w for w in result.warnings)


@pytest.mark.long
def test_a_load_step_too_short_for_a_slow_loop_is_void(command: Any, tmp_path: Any) -> None:
    """tau1 = 2 s, T1 = 20 s put a closed-loop pole at about -1/tau1: after 3 s it has exp(-1.5) = 22 % to go, and moves
    by 3.5 % in the last tenth.  Stiffness and angle at rest have no value; the rate gain, with a fast pole, has one.
    """
    slow = ("--set", "tau1=2s", "--set", "T1=20s", "--set", "hold=1s")
    code, out, _ = command("run", NAME, *slow, "--strict", "--out", tmp_path / "a")
    assert code == 1 and "verdict: void" in out
    (said,) = (line for line in out.splitlines() if "not settled" in line)
    assert said.startswith("no value of θ*, S") and "of the change, more than its u" in said
    result = json.loads((tmp_path / "a" / "result.json").read_text())
    found = {c["name"]: c for c in result["coefficients"]}
    assert found["S"]["estimate"] is None and found["S"]["verdict"] == "void"
    assert found["f_c"]["estimate"] > 10.0


def test_margins_are_those_without_the_communication_step() -> None:
    """Against the closed form of the loop: the step of 0.1 ms lowers crossover and phase margin by 0.17 Hz and 0.34
    deg, far more than their u with the step taken out.
    """
    tones = (6.5, 9.0, 12.0, 15.0, 18.0, 23.0, 30.0)
    phases = sweep("loop", "test", tones, lambda f: 1e-3 * max(1.0, 15.0 / f) ** 1.5, settle=3.0)
    with session(*phases) as s:
        found, other = (load_system(NAME).with_values(IDEAL).reduce(s.run(IDEAL, step=h)) for h in (1e-4, 2e-4))
    rows = step_effects(found.coefficients, other.coefficients, 2.0)
    r = with_step(found, StepCheck(1e-4, rows, 2e-4))
    w, pm = closed.LagLeadLoop(**DEFAULT).margin()
    for name, true, effect in (("f_c", w / (2.0 * math.pi), 0.17), ("PM", pm, 0.34)):
        assert abs(r[name].estimate - true) < 2.0 * r[name].u, name
        assert true - found[name].estimate == pytest.approx(effect, rel=0.2) and effect > 4.0 * r[name].u, name
        assert r[name].closed == pytest.approx(true, rel=1e-3)
