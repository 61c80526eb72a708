"""Estimators compared in the loop of the platform: each measure against a hand calculation or scipy, and the ranks."""

from __future__ import annotations

import cmath
import copy
import importlib
import importlib.util
import json
import math
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import signal

from gyrobench.bench import standard_folder
from gyrobench.engine.session import run
from gyrobench.packaging import load_part
from gyrobench.reduction.loops.loop_measures import phasor
from gyrobench.reduction.loops.margins import excitation_response
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "platform_single_axis"
OFF = {f"gyro.{n}": 0.0 for n in ("white", "markov", "pickoff")}
STILL = {f"gyro.D_{n}": 0.0 for n in ("F", "I", "O", "S", "II", "SS", "IO", "IS", "OS")}
LOUD = 3e-4  # A/sqrt(Hz)
ARCSEC = math.pi / 648000.0


def contest(part: str = "estimator_none", noise: float = 0.0, **values: Any) -> Any:
    """Record and result of the contest's plan, rides of 10 s."""
    system = load_system(NAME)
    given = {"contest": True, "hold": 10.0, "reading_noise": noise, **OFF, **STILL, **values}
    for name, value in given.items():
        system.set(name, value)
    record = run(system, {"estimator": part})
    return SimpleNamespace(record=record, result=system.reduce(record), linear=record.run.linear)


@pytest.fixture(scope="module")
def quiet() -> Any:
    return contest()


@pytest.fixture(scope="module")
def noisy() -> Any:
    return contest(noise=LOUD)


@pytest.fixture(scope="module")
def averaged() -> Any:
    return contest("estimator_moving_average", **{"estimator.N": 10})


def ride(record: Any, label: str, channel: str) -> Any:
    """Time from the start of the phase, and a channel, in the gate of a ride."""
    (row,) = [r for r in record.run.plan if r.label == label]
    c = record.channels
    inside = (c["exciter.phase"] == row.phase) & (c["exciter.gate"] > 0.5)
    return c["time"][inside] - c["time"][np.argmax(c["exciter.phase"] == row.phase)], c[channel][inside]


# ------------------------------------------------------------------------------------ the system
def test_without_the_contest_the_system_is_the_one_it_was() -> None:
    system = load_system(NAME)
    assert (
        not {"channel", "bracket", "reference"} & set(system.slots)
        and "rebalance.i_read -> estimator.z" in system.wires
    )
    system.set("contest", True)
    assert {"channel", "bracket", "reference"} <= set(
        system.slots
    ) and "rebalance.i_read -> estimator.z" not in system.wires
    assert "rebalance.i_read -> estimator.z" in load_system(NAME).wires
    system.set("profile", "pitch.csv")
    with pytest.raises(InvalidConfigurationError, match="contest and profile"):
        system.refuse()


def test_a_line_in_the_reading_can_be_had_without_the_contest() -> None:
    system = load_system(NAME)
    system.set("channel.line", 0.01)
    assert "channel" in system.slots and "bracket" not in system.slots


# ------------------------------------------------------------------------------------ effort
@pytest.mark.long
def test_motor_voltage_is_what_the_back_emf_and_friction_of_the_ride_take(quiet: Any) -> None:
    """k_t i = J w' + b (w - w_b), v = R i + L i' + k_e (w - w_b), b = 0.05, k_t = k_e = 1, R = 2, L = 4e-3, J = 2.

    With the platform at rest 1.1 w_b, 0.0853 V rms; the 4″ that it moves, in the record, take 3 % more.
    """
    s = 2j * math.pi
    w, w_b = (s * phasor(*ride(quiet.record, "ride", n), 1.0) for n in ("platform.attitude", "exciter.motion_angle[1]"))
    i = 2.0 * s * w + 0.05 * (w - w_b)
    expected = abs((2.0 + 4e-3 * s) * i + w - w_b) / math.sqrt(2.0)
    assert expected == pytest.approx(0.0853, rel=0.05)
    assert quiet.result["motor voltage"].estimate == pytest.approx(expected, rel=1e-3)
    assert quiet.result["time at a limit"].estimate == 0.0


@pytest.mark.long
def test_motor_voltage_of_noise_is_that_of_the_linear_model(noisy: Any) -> None:
    """var = 2 int |V|^2 S^2 df of a two-sided density, V from the test signal, which is added where the reading is.

    10 s of noise of some 100 Hz: 1000 independent squares, u 2.2 % of the rms.
    """
    f = np.linspace(0.05, 1000.0, 20000)
    model = noisy.linear.closed.discrete
    way = np.abs(excitation_response(model, "test", 1, "stabilizer.v", f))
    expected = math.sqrt(2.0 * float(np.trapezoid((way * LOUD) ** 2, f)))
    assert noisy.result["motor voltage"].estimate == pytest.approx(math.hypot(expected, 0.0881), rel=0.06)
    assert noisy.result["voltage ripple"].estimate == pytest.approx(expected, rel=0.08)


def test_time_at_a_limit_is_the_share_of_the_clipped_sine(quiet: Any) -> None:
    """|A sin| is at 0.1 of A = 0.1206 for 1 - 2/pi asin(0.1/A) of the time."""
    record = copy.copy(quiet.record)
    v = quiet.record.channels["stabilizer.v"]
    flag = np.where(np.abs(v) > 0.1, 1.0, 0.0)
    record.channels = {**quiet.record.channels, "stabilizer.v": np.clip(v, -0.1, 0.1), "stabilizer.saturated": flag}
    share = load_system(NAME).reduce(record)["time at a limit"].estimate
    amplitude = math.sqrt(2.0) * quiet.result["motor voltage"].estimate
    assert share == pytest.approx(100.0 * (1.0 - 2.0 / math.pi * math.asin(0.1 / amplitude)), abs=1.5)


# ------------------------------------------------------------------------------------ delay
@pytest.mark.long
def test_lag_of_an_average_is_half_its_length(averaged: Any, quiet: Any) -> None:
    """10 readings at 0.5 ms are 2.25 ms late at every frequency: 360 f_c 2.25e-3 degrees, and the margin loses them."""
    f_c, lag = averaged.result["f_c"].estimate, averaged.result["lag"].estimate
    assert lag == pytest.approx(360.0 * f_c * 2.25e-3, abs=0.02)
    assert quiet.result["lag"].estimate == pytest.approx(0.0, abs=1e-9)
    lost = quiet.result["PM"].estimate - averaged.result["PM"].estimate
    assert lost == pytest.approx(lag, abs=0.3)  # the gain of 0.993 moves the crossover by 0.05 Hz


# ------------------------------------------------------------------------------------ mode and line
def by_hand(run_: Any, f: float, bracket: bool = True) -> complex:
    """L of the README at f Hz with the bending mode; exchange turns the phase, and lifts the inner loop near 100 Hz."""
    p, s = run_.record.run.parameters, 2j * math.pi * f
    k, wr = p["gyro.k"], p["rebalance.K_p"] * p["gyro.K_sg"] * p["gyro.k"] * p["gyro.H"] / p["gyro.C"]
    g = {n: p[f"stabilizer.{n}"] for n in ("K", "tau1", "T1", "tau2", "T2", "integral")}
    G = g["K"] * (1 + g["tau1"] * s) * (1 + g["tau2"] * s) / ((1 + g["T1"] * s) * (1 + g["T2"] * s))
    G *= 1 + g["integral"] / s
    J, b, k_t, k_e, R, L = (p[f"platform.{n}"] for n in ("J", "viscous", "k_t", "k_e", "R", "L"))
    motor = k_t / ((R + L * s) * (J * s + b) + k_t * k_e)
    wn, zeta = 2.0 * math.pi * p["bracket.frequency"], p["bracket.damping"]
    mode = (2 * zeta * wn * s + wn**2) / (s**2 + 2 * zeta * wn * s + wn**2)
    # rebalance: the float wr / (s (1 + s J/C)) in a loop closed by a current that is held for a step
    h, tau = run_.record.run.step, p["gyro.J"] / p["gyro.C"]
    num, den, _ = signal.cont2discrete(([wr], [tau, 1.0, 0.0]), h)
    z = cmath.exp(s * h)
    open_ = np.polyval(num.ravel(), z) / np.polyval(den, z)
    follows = open_ / (1.0 + open_)
    return complex(follows / k * G * motor * (mode if bracket else 1.0))


def test_bending_gain_is_the_loop_of_the_readme_times_the_peak_of_the_mode(quiet: Any) -> None:
    tones = [r.frequency for r in quiet.record.run.plan if r.label.startswith("bending")]
    expected = max(abs(by_hand(quiet, f)) for f in tones)
    assert quiet.result["bending gain"].estimate == pytest.approx(expected, rel=0.05)
    assert expected > 5.0 * abs(by_hand(quiet, 120.0, bracket=False))


def test_line_voltage_is_that_of_a_signal_added_to_the_reading(quiet: Any) -> None:
    """v = -G/(1 + L) times the line, from the linear model with its delays: 87 Hz, 10 mA."""
    (way,) = excitation_response(quiet.linear.closed.discrete, "test", 1, "stabilizer.v", [87.0])
    assert quiet.result["line voltage"].estimate == pytest.approx(0.01 * abs(way), rel=1e-3)


# ------------------------------------------------------------------------------------ disturbed rides
def test_wild_readings_move_platform_and_motor_as_scipy_says(quiet: Any) -> None:
    """The ride with wild readings less the calm one is the linear model's answer to pulses of one step.

    Times are those of the phase: multiples of 0.37 s of the run, which the pulses are computed from.
    """
    model = quiet.linear.closed.discrete
    (row,) = [r for r in quiet.record.run.plan if r.label == "ride, wild readings"]
    time, phase = quiet.record.channels["time"], quiet.record.channels["exciter.phase"]
    h, begin = model.step, float(time[np.argmax(phase == row.phase)])
    steps = round((row.settle + row.dwell) / h)
    t = begin + h * np.arange(steps)
    due = np.floor(t / 0.37 + 1e-9).astype(int)
    u = np.zeros(steps)
    first = np.flatnonzero(np.diff(due)) + 1
    u[first] = np.where(due[first] % 2 == 1, 0.2, -0.2)
    wired = [j for j, n in enumerate(model.inputs) if n.partition(".")[2] == "test[1]"]
    rows = [model.outputs.index(n) for n in ("platform.attitude", "stabilizer.v")]
    A, B, C, D = (np.array(x) for x in (model.A, model.B, model.C, model.D))
    B, C, D = B[:, wired].sum(1, keepdims=True), C[rows], D[rows][:, wired].sum(1, keepdims=True)
    dlti = signal.StateSpace(A, B, C, D, dt=h)
    _, expected, _ = signal.dlsim(dlti, u)
    for column, channel in enumerate(("platform.attitude", "stabilizer.v")):
        since, disturbed = ride(quiet.record, "ride, wild readings", channel)
        _, calm = ride(quiet.record, "ride", channel)
        said = expected[np.round(since / h).astype(int), column]
        difference = disturbed - calm - np.mean(disturbed - calm - said)
        # the pulse arrives within a step, recorded is every second one: 0, 1 step early or late
        shifts = [np.roll(said, s) for s in (-1, 0, 1)]
        assert min(float(np.std((difference - x)[5:-5])) for x in shifts) < 0.1 * float(np.std(said))


def test_a_missing_reading_is_held(quiet: Any) -> None:
    """Gaps of 30 ms at the multiples of 0.73 s: without estimator the last reading stands, and the error grows."""
    c = quiet.record.channels
    (row,) = [r for r in quiet.record.run.plan if r.label == "ride, gaps"]
    inside = (c["exciter.phase"] == row.phase) & (c["exciter.gate"] > 0.5)
    into = c["time"] - 0.73 * np.floor(c["time"] / 0.73 + 1e-9)
    gone = inside & (into > 0.0015) & (into < 0.0285)
    estimate, reading = c["estimator.estimate"], c["rebalance.i_read"]
    starts = np.flatnonzero(np.diff(gone.astype(int)) == 1) + 1
    assert len(starts) in (13, 14)  # of 10 s
    for k in starts:
        held = estimate[k : k + 26]
        assert np.ptp(held) == 0.0 and np.ptp(reading[k : k + 26]) > 0.0
    assert quiet.result["error, gaps"].estimate > quiet.result["platform error"].estimate
    assert np.allclose(estimate[inside & (into > 0.0315)], reading[inside & (into > 0.0315)])


@pytest.mark.long
def test_more_noise_is_three_times_the_noise(noisy: Any, quiet: Any) -> None:
    """White: the ripple of the motor grows with the density; 2.2 % of noise in each rms."""
    _, calm = ride(noisy.record, "ride", "stabilizer.v")
    _, loud = ride(noisy.record, "ride, more noise", "stabilizer.v")
    base = 0.0881**2
    assert (np.var(loud) - base) / (np.var(calm) - base) == pytest.approx(9.0, rel=0.15)
    assert noisy.result["error, more noise"].estimate > noisy.result["platform error"].estimate
    assert quiet.result["error, more noise"].estimate == pytest.approx(
        quiet.result["platform error"].estimate, rel=1e-3
    )


@pytest.mark.long
def test_aiding_takes_the_drift_off(quiet: Any) -> None:
    """A drift of 10 deg/h turns the platform by 10 arcsec/s, 76 arcsec rms from 2 to 12 s after the phase begins; with
    the reference the estimator leaves what the base does, and the motor works no more for it.  Without a drift and an
    estimator that is aided the measure is the angle since the phase began.
    """
    c = quiet.record.channels
    (row,) = [r for r in quiet.record.run.plan if r.label == "ride, aided"]
    inside = (c["exciter.phase"] == row.phase) & (c["exciter.gate"] > 0.5)
    begin = float(c["platform.attitude"][np.argmax(c["exciter.phase"] == row.phase)])
    off = (c["platform.attitude"] - begin)[inside]
    assert quiet.result["error, aided"].estimate == pytest.approx(float(np.sqrt(np.mean(off**2))) / ARCSEC, rel=0.02)
    aided = contest("estimator_aided", **{"gyro.D_F": 10.0 * ARCSEC})  # arcsec/s is deg/h
    wander = 10.0 * math.sqrt((12.0**3 - 2.0**3) / 3.0 / 10.0)
    assert wander == pytest.approx(75.7, abs=0.1)
    assert aided.result["error, aided"].estimate < 0.1 * wander
    assert aided.result["PM"].estimate == pytest.approx(quiet.result["PM"].estimate, abs=12.0)


def test_peak_voltage_is_the_mean_over_the_periods() -> None:
    """Peaks 1, 2, 3 in three whole periods of 0.37 s from 0.37 s on; the pieces at the ends do not count."""
    module = load_system(NAME)
    measures = importlib.import_module(".measures", type(module).__module__)
    t = np.arange(200, 1700) * 1e-3
    v = np.zeros(t.size)
    for at, size in ((0.25, 9.0), (0.40, 1.0), (0.80, -2.0), (1.2, 3.0), (1.60, 9.0)):
        v[np.argmin(np.abs(t - at))] = size
    found = measures.peaks(t, v, 0.37)
    assert found.value == pytest.approx(2.0) and found.u == pytest.approx(1.0 / math.sqrt(3.0))


# ------------------------------------------------------------------------------------ candidates and ranks
@pytest.fixture(scope="module")
def script() -> ModuleType:
    file = standard_folder() / "systems" / NAME / "compare_estimators.py"
    spec = importlib.util.spec_from_file_location("compare_estimators", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("name", "lag"),
    [
        ("alpha_beta_gamma", 8.0),
        ("kalman_ar", 8.0),
        ("kalman_rate", 8.0),
        ("kalman_robust", 8.0),
        ("aided", 8.0),
        ("moving_average", 8.1),
        ("wavelet", 5.4),
        ("wavelet:running", 5.4),
        ("wavelet:bior1.5", 9.0),
        ("wavelet:db4", 12.6),
        ("wavelet:sym4", 12.6),
        ("wavelet:coif4", 41.4),
    ],
)
def test_tuned_parts_lag_as_stated(script: ModuleType, name: str, lag: float) -> None:
    """The part itself, run on a sine of 10 Hz: phase of a fit over the last ten periods.

    Averages and wavelets come in steps of readings: 4.5 and 3 readings of 0.5 ms are 8.1 and 5.4 degrees; one level of
    bior1.5, db4 or sym4, coif4 is 5, 7, 23 readings.
    """
    h, variance = 5e-4, LOUD**2 / 5e-4
    values = script.tuned(f"estimator_{name}", 10.0, 8.0, h, variance)
    cls = load_part(f"estimator_{name.partition(':')[0]}")
    part = cls(Ts=h)
    for key, value in {"R": variance, "sigma": 0.0, **values}.items():
        if key.partition("[")[0] in cls.declarations:
            part.set(key, float(value))
    part.initialize()
    n, y = 3000, []
    t = h * np.arange(1, n + 1)
    for k in range(n):
        part.z = 0.01 * math.sin(2.0 * math.pi * 10.0 * t[k])  # within the noise, so that no gate acts
        part.do_step(k * h, h)
        y.append(part.get("estimate"))
    last = slice(n - 2000, n)
    phase = 2.0 * math.pi * 10.0 * t[last]
    a, b, _ = np.linalg.lstsq(np.column_stack([np.sin(phase), np.cos(phase), np.ones(2000)]), np.array(y)[last])[0]
    assert math.degrees(cmath.phase(complex(a, b))) == pytest.approx(-lag, abs=0.05)


def test_the_crossover_is_moved_until_the_margin_is_the_one_wanted(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A loop that loses 2 degrees a hertz from 75 and has no margin beyond 16 Hz: 55 degrees at 10 Hz."""

    def margin(part: str, crossover: float, hold: str) -> Any:
        value = 75.0 - 2.0 * crossover if crossover < 16.0 else math.nan
        made = SimpleNamespace(result={"PM": SimpleNamespace(estimate=value)})
        return SimpleNamespace(run=lambda seed, check_step: made)

    monkeypatch.setattr(script, "experiment", margin)
    assert script.at_margin("any") == pytest.approx(10.0, abs=0.03)


@pytest.mark.long
def test_contest_of_two_over_two_seeds(script: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """Averaging takes most of the noise, the line and the mode from the motor; two seeds are enough to say so."""
    crossover = {"estimator_none": 16.2, "estimator_moving_average": 10.1}
    monkeypatch.setattr(script, "at_margin", crossover.get)
    names = list(crossover)
    monkeypatch.setattr(
        "sys.argv", ["x", "--out", str(tmp_path), "--seeds", "2", "--hold", "10s", "--estimators", *names]
    )
    script.main()
    doc = json.loads((tmp_path / "comparison.json").read_text())
    assert [(r["name"], r["seeds"]) for r in doc["runs"]] == [(n, [1, 2]) for n in names]
    by_name = {r["name"]: r["order"] for r in (doc["ranking"], *doc["purposes"])}
    assert len(by_name) == 8
    for name in ("motor voltage", "line voltage", "bending gain"):
        assert [e["run"] for e in by_name[name]] == [1, 0]
    assert by_name["motor voltage"][1]["place"] == 2 and by_name["motor voltage"][1]["probability"] > 0.975
    assert "For a motor that must stay cool and quiet" in (tmp_path / "comparison.html").read_text()
