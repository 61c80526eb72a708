"""The three-gimbal platform in its loop: lock table, roll into lock, azimuth with and without resolver, margins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from gimballed import DEG, STILL, measures, session, table

from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session
from gyrobench.record.frequency_response import unstable
from gyrobench.record.run_document import LinearModels
from gyrobench.reduction.loops import margins as m
from gyrobench.reduction.loops.loop_limits import STEP, phase_taken
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.system.flight_plan import Leg
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "platform_three_gimbal"
EXACT = {**STILL, "mounting": 0.0, "torquer": 0.0, "load": 0.0, "command": 0.0, "hold": 1.0}
REST = [LoopPhase("drift", "hold", settle=0.1, dwell=1.0)]


def by_hand(feedback: float = 40.0, lag: float = 2e-3) -> tuple[float, float]:
    """Crossover (rad/s) and phase margin (deg) of feedback / (s (lag s + 1)): w sqrt(1 + (w lag)2) = feedback."""
    w = math.sqrt((math.sqrt(1.0 + 4.0 * (feedback * lag) ** 2) - 1.0) / 2.0) / lag
    return w, 90.0 - math.degrees(math.atan(w * lag))


@pytest.fixture(scope="module")
def quick() -> Iterator[Session]:
    """The flight, and a hold after it."""
    with session(NAME, at_rest=lambda self: REST) as s:
        yield s


@pytest.fixture(scope="module")
def whole() -> Iterator[Any]:
    """The default plan with its noise, to a roll of 80 deg."""
    with Session(NAME) as s:
        yield s.run({"roll": 80 * DEG, "azimuth": 0.5}, seed=3)


# ------------------------------------------------------------------------------------ gimbal lock
@pytest.mark.parametrize("m", [0.0, 60.0, 80.0, 89.0, 89.9])
def test_lock_table(m: float) -> None:
    """A rate of the base along the normal of the ring plane, (cos m, 0, -sin m) in base axes with the roll joint at m,
    takes gimbal rates up to 1 / cos m of it: 1, 2, 5.76, 57.3, 573 (to 0.2 %)."""
    rate = 0.01 * DEG
    leg = Leg("normal", 0.05, pitch=rate * math.cos(m * DEG), yaw=-rate * math.sin(m * DEG))
    with session(NAME, [leg], at_rest=lambda self: REST) as s:
        record = s.run({**EXACT, "rate_max": 5.0, "platform.theta_0[2]": m * DEG})
        result = s.system.reduce(record)
    c = record.channels
    late = int(np.searchsorted(c["time"], 0.04))
    rates = np.abs([c[f"platform.theta_dot[{k}]"][late] for k in (1, 2, 3)])
    known = {0.0: 1.0, 60.0: 2.0, 80.0: 5.76, 89.0: 57.3, 89.9: 573.0}[m]
    assert rates.max() / rate == pytest.approx(known, rel=2e-3)
    assert table(result, "flight.legs").rows[0][4] == pytest.approx(1.0 / math.cos(m * DEG), rel=2e-3)
    assert bool(table(result, "flight.lock").rows) == (m > 85.0)
    assert measures(result)["platform error"] < 1e-6


def test_roll_to_exactly_90_then_50_of_yaw(quick: Session) -> None:
    """The platform's error is the 50 deg; the lock is told from 85 deg on, 85/36 s after the roll began."""
    result = quick.system.reduce(quick.run(EXACT))
    c = measures(result)
    assert c["platform error"] == pytest.approx(50.0, rel=1e-3)
    assert c["error at the end"] < 0.01  # dragged along on the way back, too
    (row,) = table(result, "flight.lock").rows
    what, leg, begin, end, angle, _, before, worst = row
    assert (what, leg) == ("lock", "roll 90°")
    assert begin == pytest.approx(85.0 / 36.0, abs=4e-3)
    assert end == pytest.approx(15.0 - 85.0 / 36.0, abs=4e-3)  # roll and yaw, 7.5 s, there and back
    assert angle == pytest.approx(-85.0, abs=0.15)
    assert before < 1e-6 and worst == pytest.approx(50.0, rel=1e-3)
    assert any("Gimbal lock from t = 2.36" in w and "-85.0" in w for w in result.warnings)
    assert [r.name for r in result.responses] == ["platform error", "gimbal angles"]


def test_without_allow_lock_the_platform_ends_the_run(quick: Session) -> None:
    """|cos m| < 1e-3 at 89.943 deg, after 89.943 / 36 = 2.498 s and the 2 ms before the roll."""
    with pytest.raises(RunError, match=r"gimbal lock.*-1\.5698.*t = 2\.5 s"):
        quick.run({**EXACT, "allow_lock": False})


def test_short_of_lock_and_with_the_other_mount_it_is_kept(quick: Session) -> None:
    near = quick.system.reduce(quick.run({**EXACT, "roll": 80 * DEG}))
    assert measures(near)["platform error"] < 1e-6 and not table(near, "flight.lock").rows
    legs = table(near, "flight.legs").rows
    # outer gimbal 10 tan m; the azimuth gimbal -10 (cos m + sin m tan m) = -10 / cos m, largest where the yaw begins
    assert legs[1][3] == pytest.approx(10.0 / math.cos(80 * DEG), rel=2e-3)
    other = quick.system.reduce(quick.run({**EXACT, "mount": 0}))
    assert measures(other)["platform error"] < 1e-6 and not table(other, "flight.lock").rows


# ------------------------------------------------------------------------------------ azimuth
@pytest.mark.long
def test_with_the_resolver_every_azimuth_is_stable() -> None:
    """Poles of the loop as it is stepped, every 30 degrees; the phase margin is the same everywhere."""
    with session(NAME, at_rest=lambda self: REST) as s:
        for azimuth in range(0, 361, 30):
            system = s.system.with_values({**EXACT, "azimuth": azimuth * DEG})
            linear = linear_model(s, system)
            assert not unstable(linear.closed.discrete) and not unstable(linear.closed.continuous), azimuth
            assert phase_margin(linear.loops["pitch"].discrete) == pytest.approx(by_hand()[1], abs=0.6)


def linear_model(s: Session, system: Any) -> LinearModels:
    """As Session.run takes it for run.json."""
    values = {**system.values, **system.overrides}
    linear = s.prepare({k: v for k, v in values.items() if k in system.given})[2].linear
    assert linear is not None
    return linear


@pytest.mark.parametrize("azimuth", [70.0, 180.0, 300.0])
def test_with_the_resolver_a_load_is_held_at_any_azimuth(azimuth: float) -> None:
    """M / (drag feedback) = 50 / 8000 rad, settled to 5 % after ln(20) / 40 = 0.075 s (less the lag)."""
    step = LoopPhase("load on pitch", "torque", "step", 1, 50.0, settle=0.1, dwell=0.5)
    with session(NAME, [], at_rest=lambda self: [step]) as s:
        result = s.system.reduce(s.run({**EXACT, "azimuth": azimuth * DEG}))
    c = measures(result)
    assert c["S pitch"] == pytest.approx(8000.0, rel=1e-4)
    assert c["t_5 pitch"] == pytest.approx(math.log(20.0) / 40.0, rel=0.1)


@pytest.mark.parametrize("integral", [0.0, 20.0])
@pytest.mark.long
def test_without_the_resolver_up_to_the_phase_margin(integral: float) -> None:
    """Opened loops with exp(+-j azimuth) between them: stable as far as the phase margin of one, by poles and in the
    co-simulation.  1 degree beyond it the ringing grows with about feedback sin(1 deg) = 0.7 1/s."""
    blow = LoopPhase("blow", "torque", "step", 1, 50.0, settle=0.1, dwell=0.05)
    ring = LoopPhase("ring", "hold", dwell=4.0)
    parts = {"decoupler": "decoupler_none"}
    given = {**EXACT, "integral": integral}
    with session(NAME, [], parts, at_rest=lambda self: [blow, ring]) as s:
        linear = linear_model(s, s.system.with_values(given))
        margin = phase_margin(linear.loops["pitch"].discrete)
        w, pm = by_hand()
        if integral == 0.0:
            assert margin == pytest.approx(pm - math.degrees(w * 0.5e-3 / 2.0), abs=0.6)
        else:  # (1 + integral / s) takes about atan(20 / 40); what is left lies near its phase margin
            assert margin == pytest.approx(pm - 26.0, abs=4.0)
        for azimuth, stable in [(margin - 1.0, True), (margin + 1.0, False), (-margin + 1.0, True), (180.0, False)]:
            record = s.run({**given, "azimuth": azimuth * DEG})
            assert bool(unstable(record.run.linear.closed.discrete)) != stable, azimuth
            t, y = record.channels["time"], record.channels["platform.theta[1]"]
            early, late = (np.ptp(y[(t > a) & (t < a + 0.4)]) for a in (0.5, 3.5))
            away = np.ptp(y) > 1.0  # rad: at 180 deg it runs away with its pickoffs at their limit
            assert (late < early / 2.0) if stable else (away or late > 2.0 * early), azimuth


def phase_margin(model: Any) -> float:
    from gyrobench.reduction.loops.margins import grid, margins, model_response

    f = grid(0.1, 100.0)
    found = margins(f, model_response(model, f)[:, 0, 0])
    return float(found.phase or 0.0)


# ------------------------------------------------------------------------------------ measures of the whole run
@pytest.mark.long
def test_margins_of_sweep_and_jacobians_agree(whole: Any) -> None:
    """Issue: within 1 dB and 3 degrees up to twice the crossover; by hand the crossover is 6.346 Hz, the margin 85.44
    less the delay, 360 f h / 2 = 0.57 deg at most."""
    result = load_system(NAME).reduce(whole)
    rows = table(result, "margins.agreement").rows
    assert len(rows) == 6
    for label, _, count, db, degrees in (r[:5] for r in rows):
        assert count >= 5 and db < 0.01 and degrees < (0.05 if "delays" in label else 0.6), label
    c = measures(result)
    w, pm = by_hand()
    for axis in ("pitch", "roll", "azimuth"):
        assert c[f"f_c {axis}"] == pytest.approx(w / (2.0 * math.pi), rel=1e-3)
        assert c[f"PM {axis}"] == pytest.approx(pm, abs=0.6)
        assert c[f"S {axis}"] == pytest.approx(8000.0, rel=1e-3)


def test_drift_command_and_monitor_of_the_whole_run(whole: Any) -> None:
    result = load_system(NAME).reduce(whole)
    found = {c.name: c for c in result.coefficients}
    for name in ("drift x", "drift y", "drift z", "monitor", "rate gain"):
        assert abs(found[name].z) < 4.0, name
    coupling = next(t for t in result.tables if t.kind == "cross_axis")
    for k, row in enumerate(coupling.rows, 1):  # gyros out of true by 3' about each axis: up to 0.09 % each way
        assert row[k] == pytest.approx(100.0) and all(0.0 <= x < 0.3 for j, x in enumerate(row[1:], 1) if j != k)
    assert found["platform error"].estimate < 1e-3
    assert "its gimbals did not lock" in result.summary[0]


# ------------------------------------------------------------------------------------ bad input
@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"feedback": 120.0}, r"feedback = 120 1/s: .* wants a crossover up to 1/\(20 step\) = 100 1/s"),
        ({"decoupler.mount": 0}, r"platform\.mount = 1 and decoupler\.mount = 0: .* set the option mount"),
        ({"gyro_b.mount": "[[0, 1, 0], [0, 0, 1], [1, 0, 0]]"}, "the rotors are parallel"),
    ],
)
def test_refusals(quick: Session, values: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=says):
        quick.run({**EXACT, **values})


# ------------------------------------------------------------------------------------ what limits it
def test_lag_that_limits_the_bandwidth(whole: Any) -> None:
    """atan(2 pi f 0.002) at the crossover of 6.3 Hz is 4.5 degrees: without that lag the margin is larger by it."""
    lags = {"servo": 2e-3}
    found = LoopFindings(whole)
    crossover, taken = phase_taken(found, "pitch", lags)
    assert crossover == pytest.approx(by_hand()[0] / (2.0 * math.pi), rel=0.01)
    assert taken["servo"] == pytest.approx(90.0 - by_hand()[1], rel=0.02)
    pair = found.linear.loops["pitch"]
    shorter = [m.margins(f, m.model_response(x, f)[:, 0, 0]).phase
               for x, f in ((x, m.grid(1.0, 50.0)) for x in (pair.discrete, pair.continuous))]  # fmt: skip
    assert taken[STEP] == pytest.approx(shorter[1] - shorter[0], rel=0.1)
    result = load_system(NAME).reduce(whole)
    assert any(s.startswith("Lags limit the bandwidth: at the crossover of the ") for s in result.summary)
    rates = [np.abs(whole.channels[f"platform.theta_dot[{k}]"]).max() / DEG for k in (1, 2, 3)]
    assert any(s.endswith(f"the gimbals turned by up to {max(rates):.3g}°/s.") or "reached in the flight" in s
               for s in result.summary)  # fmt: skip


def test_largest_rate_of_a_gimbal_lets_the_base_through(quick: Session) -> None:
    """The base rolls at 36 deg/s, the gimbal follows at 35.8: 0.2 deg/s over 1.1 s of 40 deg are 0.22 deg."""
    record = quick.run({**EXACT, "roll": 40 * DEG, "yaw": 0.0, "rate_max": 35.8 * DEG})
    result = quick.system.reduce(record)
    said = next(s for s in result.summary if "at its largest rate, 35.8°/s" in s)
    c = record.channels
    first = c["time"][np.argmax(np.abs(c["platform.theta_dot[2]"]) > 35.799 * DEG)]
    assert f"reached in the flight at t = {first:.4g} s (leg “roll 40°”)" in said
    assert measures(result)["platform error"] == pytest.approx(0.22, abs=0.05)
