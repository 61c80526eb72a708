"""The single-axis platform in its loop: linear model, stiffness, drift, and estimators and loops swapped."""

import math

import numpy as np
import pytest
from gimballed import only

from gyrobench.engine.session import run
from gyrobench.system.system import load_system

NAME = "platform_single_axis"
QUIET = {"gyro.white": 0.0, "gyro.markov": 0.0, "gyro.pickoff": 0.0, "reading_noise": 0.0}
SHORT = {"hold": 10.0}


def reduced(parts=None, **values):
    system = load_system(NAME)
    record = run(system, parts, values={**SHORT, **values})
    result = load_system(NAME).reduce(record)
    return record, result, {c.name: c for c in result.coefficients}


def rows(result, kind):
    table = next(t for t in result.tables if t.kind == kind)
    return [dict(zip(table.columns, row, strict=True)) for row in table.rows]


@pytest.fixture(scope="module")
def quiet():
    return reduced(**QUIET)


def test_margins_of_the_sweep_are_those_of_the_linear_parts(quiet):
    """Within 1 dB and 3 degrees up to twice the crossover; without noise far closer, as the delays are in the model."""
    _, result, found = quiet
    row, without = rows(result, "margins.agreement")
    assert row["gain / dB"] < 0.01 and row["phase / °"] < 0.1
    assert without["model"] == "linear, continuous" and 1.0 < without["phase / °"] < 3.0  # 1.2° at the crossover
    assert found["f_c"].estimate == pytest.approx(10.0, rel=0.03)  # the gain is set for it; delays shift it
    margins = rows(result, "margins")
    assert margins[0]["phase margin / °"] == pytest.approx(margins[1]["phase margin / °"], abs=0.3)
    assert 55.0 < found["PM"].estimate < 70.0


def test_drift_of_the_platform_is_that_of_its_gyro(quiet):
    """x level, z up: (X, Y, Z) = (0, 0, -1), so omega_d = D_F - D_S + D_SS = -0.3 + 0.7 + 0.04 = 0.44 deg/h."""
    _, _, found = quiet
    assert found["drift"].truth == pytest.approx(0.44, rel=1e-9)
    assert found["drift"].estimate == pytest.approx(0.44, abs=2e-3)  # the lag of 50 s still moves a little


def test_commanded_rate_is_reached(quiet):
    _, _, found = quiet
    assert found["rate gain"].estimate == pytest.approx(1.0, abs=2e-3)
    assert found["settling"].estimate < 0.3


@pytest.mark.long
def test_isolation_is_that_of_the_friction_and_the_back_emf(quiet):
    """The base drags by (viscous + k_e k_t / R) (omega_b - omega): without both it cannot."""
    _, result, _ = quiet
    _, free, _ = reduced(**QUIET, **{"platform.viscous": 0.0, "platform.k_e": 0.0, "gyro.D_F": 0.0, "gyro.D_S": 0.0,
                                     "gyro.D_SS": 0.0, "gyro.D_O": 0.0, "gyro.D_IS": 0.0, "gyro.D_OS": 0.0,
                                     "gyro.D_I": 0.0, "gyro.D_IO": 0.0, "gyro.D_II": 0.0})  # fmt: skip
    taken = next(r for r in result.responses if r.name.startswith("attitude over"))
    left = next(r for r in free.responses if r.name.startswith("attitude over"))
    assert np.max(left.y) < 1e-9 < 1e-4 < np.min(taken.y)
    # 0.05 against 1/|2 + 0.025j| N·m·s/rad at 1 Hz, next to which the platform is at rest
    (said,) = [s for s in result.summary if s.startswith("Base motion at 1 Hz reaches the platform 56.8")]
    assert said.endswith("it is carried over by the back EMF of the motor (91 %) and viscous friction (9 %).")
    assert not [s for s in free.summary if s.startswith("Base motion")]


def test_answer_says_how_far_the_loop_is_from_its_limits(quiet):
    _, result, found = quiet
    first = result.summary[0]
    assert first.startswith(f"Crossover {found['f_c'].estimate:.1f}") and "phase margin 6" in first
    rise, fall = "rise by 18.8 dB to an oscillation at 79.7 Hz", "fall by 25.7 dB to an oscillation at 1.26 Hz"
    assert f"; the gain may {rise} or {fall}, by the linear model" in first  # 16.9 dB at 72 Hz with the step of 0.5 ms
    assert any(s.startswith("A load of 1 N·m turns it by up to 75.") for s in result.summary)


@pytest.mark.long
def test_estimators_are_ranked_by_platform_error_not_by_smoothness():
    """With the same noise: the moving average has the smoothest estimate and the worst margin of the three."""
    found = {e: reduced({"estimator": f"estimator_{e}"}, hold=30.0, reading_noise=3e-4)[1:]
             for e in ("none", "kalman_rate", "moving_average")}  # fmt: skip
    value = {e: {c.name: c.estimate for c in r.coefficients} for e, (r, _) in found.items()}
    assert all(r.ranked_by == "platform error" for r, _ in found.values())
    assert value["moving_average"]["estimate error"] < value["kalman_rate"]["estimate error"]
    assert value["kalman_rate"]["estimate error"] < 0.6 * value["none"]["estimate error"]
    assert value["moving_average"]["PM"] < value["none"]["PM"] - 5.0
    assert value["none"]["rate error"] < value["kalman_rate"]["rate error"] < value["moving_average"]["rate error"]


@pytest.mark.parametrize("name", ["kalman_ar", "sage_husa", "wavelet", "alpha_beta_gamma"])
@pytest.mark.long
def test_every_estimator_runs_in_the_loop(name):
    values = {"estimator.phi[1]": 0.95, "estimator.phi[2]": 0.0, "estimator.phi[3]": 0.0} if name == "kalman_ar" else {}
    _, _, found = reduced({"estimator": f"estimator_{name}"}, **values)
    assert math.isfinite(found["platform error"].estimate)
    if name in ("sage_husa", "alpha_beta_gamma"):  # wavelet and AR filter may spoil the loop: that is what one learns
        assert found["platform error"].estimate < 10.0


@pytest.mark.long
def test_servo_with_a_current_loop_swaps_and_isolates_better(quiet):
    """The current loop holds the torque against the back EMF, which is what the base drags by."""
    _, result, found = reduced({"stabilizer": "servo_three_loop"}, **QUIET)
    _, _, plain = quiet
    assert found["platform error"].estimate < 0.3 * plain["platform error"].estimate
    assert rows(result, "margins.agreement")[0]["gain / dB"] < 0.05
    assert not any("carried over" in s for s in result.summary)  # by other ways than those of a plain motor


@pytest.mark.long
def test_halving_the_step_moves_the_margin_by_its_delay():
    """The exchange delays by about a step: 360 f_c h = 1.8 degrees at 10 Hz and 0.5 ms, half of it at half the step."""
    with only(NAME, "loop", "drift") as session:
        pm = []
        for h in (5e-4, 2.5e-4, 1.25e-4):
            result = load_system(NAME).reduce(session.run({**QUIET, **SHORT}, step=h))
            pm.append(next(c.estimate for c in result.coefficients if c.name == "PM"))
    first, second = pm[1] - pm[0], pm[2] - pm[1]
    assert 0.0 < first < 3.6 and second == pytest.approx(first / 2.0, rel=0.2)


@pytest.mark.long
def test_ride_by_a_recorded_profile(tmp_path, quiet):
    """Pitch of 1 degree at 1 Hz as a recording leaves what the exciter's sine of that size leaves, but for its ends."""
    t = np.arange(0.0, 20.0, 0.05)
    path = tmp_path / "pitch.csv"
    rows = (f"{x:.3f},{math.sin(2 * math.pi * x):.6f}" for x in t)
    path.write_text("\n".join(["time [s],pitch [deg]", *rows]) + "\n")
    _, _, recorded = reduced(**{**QUIET, "profile": str(path), "hold": 18.0})
    _, _, plain = quiet
    assert recorded["platform error"].estimate == pytest.approx(plain["platform error"].estimate, rel=0.1)
    assert "drift" not in recorded


@pytest.mark.long
def test_no_crossover_out_of_noise():
    """Thirty times the noise at 15 Hz: 58.5 Hz was stated where the linear model has 15.4; now no value, and why."""
    noisy = {"crossover": 15.0, "reading_noise": 3e-3}
    with only(NAME, "loop", "drift") as session:
        records = [session.run({**SHORT, **noisy}, seed=seed) for seed in (1, 2)]
    for record in records:
        result = load_system(NAME).reduce(record)
        f_c = result["f_c"]
        assert f_c.closed == pytest.approx(15.4, abs=0.1)
        assert f_c.no_value or abs(f_c.estimate - f_c.closed) < 2.0 * f_c.u
        (bode,) = (r for r in result.responses if r.kind == "loop")
        assert not all(bode.counts) and len(bode.counts) == 8
        assert any("too noisy at" in w and "do not count" in w for w in result.warnings)


@pytest.mark.long
def test_dry_friction_leaves_no_crossover_and_the_result_says_why():
    _, result, found = reduced(**QUIET, **{"platform.friction": 0.5, "platform.stiction": 0.8})
    for name in ("f_c", "PM"):
        assert "friction" in found[name].no_value and "describing function" in found[name].no_value
        assert math.isnan(found[name].estimate)
    assert result.verdict != "void"  # the other measures stand


@pytest.mark.long
def test_measured_and_computed_margins_that_differ_are_named_with_the_cause():
    """Little friction: the loop slips and loses phase that the linear model, stuck in the contact, still has."""
    _, result, found = reduced(**QUIET, **{"platform.friction": 0.05})
    (said,) = (w for w in result.warnings if "was measured to cross" in w)
    assert abs(found["PM"].estimate - found["PM"].closed) > 5.0
    assert "friction" in said and f"{found['PM'].closed:.3g}°" in said


@pytest.mark.long
def test_margins_read_at_a_limit_do_not_pass():
    """A sine of 1.2 V clipped at 0.3 V comes back with a smaller gain: the crossover falls although no gain changed."""
    small = {"base": 0.0, "load_step": 0.05, "command": 1e-6, "hold": 10.0, "stabilizer.v_max": 0.3}
    record = run(load_system(NAME), values=small)
    limits = {"f_c": (5.0, None), "PM": (10.0, None), "load/peak": (0.0, None)}
    result = load_system(NAME).reduce(record, limits)
    found = {c.name: c for c in result.coefficients}
    assert found["f_c"].estimate < 0.95 * found["f_c"].closed
    assert {n: found[n].verdict for n in limits} == {"f_c": "inconclusive", "PM": "inconclusive", "load/peak": "pass"}
    assert any("A limit was active in stabilizer, in: " in w and "loop 10 Hz" in w for w in result.warnings)
    assert any("Use smaller test signals" in w for w in result.warnings)


def test_a_voltage_that_was_clipped_at_the_limit_of_the_motor_is_at_it():
    """What the stabilizer clips at the largest voltage of the motor reaches it as that voltage, not above it."""
    record = run(load_system(NAME), values={**QUIET, **SHORT, "load_step": "30N.m", "platform.v_max": 27.0})
    at = np.abs(record.channels["stabilizer.v"]) >= 27.0
    assert at.any() and (record.channels["platform.saturated"][1:][at[:-1] & at[1:]] > 0.5).all()


def test_an_estimator_need_not_state_its_latency(quiet):
    """Without the channel everything is as before but the row of the latency."""
    record, _, found = quiet
    kept = record.channels
    record.channels = {n: x for n, x in kept.items() if n != "estimator.latency"}
    try:
        without = {c.name: str(c.estimate) for c in load_system(NAME).reduce(record).coefficients}  # nan is nan
    finally:
        record.channels = kept
    assert without == {n: str(c.estimate) for n, c in found.items() if n != "latency"} and "latency" in found
