"""Rebalance loop test: errors drawn at random come back, three loops by swap, resolution, ripple, refusals."""

from __future__ import annotations

import importlib
import json
import math
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.packaging import build
from gyrobench.reduction.drift.small_rates import SmallRates
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.result import DriftTestResult
from gyrobench.system.system import load_system

NAME = "rebalance_loop_test"
QUICK: dict[str, Any] = {"gate": 0.2, "rest": 20, "readings": 6, "settle": 1.5}
STILL = {"gyro.pickoff": 0.0, "gyro.white": 0.0, "gyro.markov": 0.0}
I, F_Q = 3.6 / 17.2, 1e6  # noqa: E741  A, Hz
ARCSEC = math.pi / 648000.0


def run(session: Session, values: dict[str, Any], seed: int = 1, step: float = 1e-3) -> DriftTestResult:
    record = session.run({**QUICK, **values}, seed, step)
    result = load_system(NAME).reduce(record)
    assert isinstance(result, DriftTestResult)
    return result


def value(result: DriftTestResult, name: str) -> float:
    return result[name].estimate


@pytest.mark.parametrize("seed", [1, 2])
def test_errors_of_the_pulses_come_back(session: Session, seed: int) -> None:
    """Drawn currents and switching times; expected by hand with s_j = dT_j f_s, D = dI_plus + dI_minus:

    I_0 = (dI_plus - dI_minus)/2 + (2 I + D) s_1    κ = (D/2 + (2 I + D) s_2)/I    κ_2 at i = 0.95 I: 0.95 (2 + D/I) s_3
    """
    draw = np.random.default_rng(seed).normal
    plus, minus = 2e-3 * I * draw(), 2e-3 * I * draw()
    late = [3e-7 * draw(), 5e-7 * draw(), 5e-7 * draw()]
    result = run(session, {"rebalance.dI_plus": plus, "rebalance.dI_minus": minus, "rebalance.dT": late}, seed)
    s, both = [x * 1e3 for x in late], plus + minus
    expected = {
        "I_0": ((plus - minus) / 2.0 + (2.0 * I + both) * s[0]) * 1e6,
        "κ": (both / 2.0 + (2.0 * I + both) * s[1]) / I * 1e6,
        "κ_±": 0.0,
        "κ_2": 0.95 * (2.0 + both / I) * s[2] * 1e6,
        "κ_3": 0.0,
    }
    for name, truth in expected.items():
        c = result[name]
        assert c.truth == pytest.approx(truth, abs=1e-6 * abs(truth) + 1e-9), name
        assert abs(c.estimate - truth) < 4.0 * c.u, name
    assert abs(value(result, "I_0")) > 20.0 * result["I_0"].u and result["I_0"].u < 10.0  # uA: 5e-5 of full scale


def test_encoder_error_is_predicted_corrected_and_in_u(session: Session) -> None:
    """a sin(θ + f) is read too much.  All ways begin near θ = 0 and are short: there the readings turn too quickly by
    the part a cos f, for 20″ and f = 0.5 rad 9.696e-5 * 0.8776 = 85.1 ppm, and so much too large is κ.
    """
    wrong = {**STILL, "table.encoder_amplitude": [20.0 * ARCSEC, 0.0], "table.encoder_phase": [0.5, 0.0]}
    plain, off = run(session, STILL), run(session, wrong)
    shift = value(off, "κ") - value(plain, "κ")
    assert shift == pytest.approx(85.1, rel=0.02)
    predicted = next(t for t in off.tables if t.id == PREDICTED)
    row = next(r for r in predicted.rows if r[0] == "κ")
    assert shift == pytest.approx(row[-3], rel=0.01) and row[-1] == "ppm"

    sine, cosine = 20.0 * math.cos(0.5), 20.0 * math.sin(0.5)
    text = "; ".join(f"angle error, once a turn ({n}) = {x:.6f}(0.1) arcsec"
                     for n, x in (("sine", sine), ("cosine", cosine)))  # fmt: skip
    back = run(session, {**wrong, "corrections": text})
    assert value(back, "κ") == pytest.approx(value(plain, "κ"), abs=0.5 * plain["κ"].u)
    assert back["κ"].u == pytest.approx(math.hypot(plain["κ"].u, 0.1 * ARCSEC * 1e6), rel=0.02)
    stated = run(session, {**wrong, "u_angle1": 20.0 * ARCSEC})
    assert abs(stated["κ"].z or 9.0) < 2.0 and stated["κ"].u == pytest.approx(97.0, rel=0.3)


def test_tilt_of_the_table_is_a_bias(session: Session) -> None:
    """3000″ about east: the axis sees cos φ sin 3000″ of the Earth rate less, 15.041 * 0.6978 * 0.014544 = 0.15265
    deg/h, over k = 17.2 deg/h/mA 8.875 uA, and so much is in the bias; sin φ (1 - cos) is 0.7 % of it.
    """
    plain, off = run(session, STILL), run(session, {**STILL, "table.tilt": [3000.0 * ARCSEC, 0.0]})
    shift = value(off, "I_0") - value(plain, "I_0")
    assert abs(shift) == pytest.approx(8.875, rel=0.02)
    predicted = next(t for t in off.tables if t.id == PREDICTED)
    assert shift == pytest.approx(next(r for r in predicted.rows if r[0] == "I_0")[-3], rel=0.02)


def test_resolution_is_two_clocks(session: Session) -> None:
    """2 k I/(f_q T) = 2 deg/s / 1e6 / 0.2 s = 0.036 deg/h (ET17), half of it at half the current."""
    quiet = {"rates": "0.2 0.5 1", "readings": 2, "rest": 60}
    assert value(run(session, quiet), "resolution") == pytest.approx(0.036, rel=1e-9)
    half = run(session, {**quiet, "rebalance.I": I / 2.0, "range": "0.4deg/s"})
    assert value(half, "resolution") == pytest.approx(0.018, rel=1e-9)
    # full scale over noise of a reading: 0.0178 deg/h/sqrt(Hz) / sqrt(0.2 s) = 0.04 deg/h at least
    assert 1800.0 / 0.1 < value(half, "dynamic range") < 1800.0 / 0.04


def test_quantum_of_readings() -> None:
    """Whole multiples of 3.7e-7 A, few and many; readings without a quantum."""
    quantum = importlib.import_module(".reduction", type(load_system(NAME)).__module__).quantum
    rng = np.random.default_rng(0)
    for size in (3, 40, 4000):
        x = 3.7e-7 * np.concatenate([rng.integers(-size, size, 60), [size, size + 1]])
        assert quantum(x) == pytest.approx(3.7e-7, rel=1e-12)
    assert quantum(rng.normal(size=50) * 1e-4) == 0.0 and quantum(np.zeros(5)) == 0.0


def ripple(ratio: float, tau: float, full: float) -> float:
    """Standard deviation of the float angle at zero input: the float's equation over a saw, from its periodic state."""
    T, n = 1e-3, 4000
    t = (np.arange(n) + 0.5) * T / n
    r = np.where(t < T / 2.0, -1.0, 1.0) * ratio * full
    # v' = (r - v)/tau, periodic: half periods mirror each other, v(0) = V with V = A tanh(T/(4 tau))
    V = ratio * full * math.tanh(T / 4.0 / tau)
    v = np.where(t < T / 2, r + (V - r) * np.exp(-t / tau), r + (-V - r) * np.exp(-(t - T / 2) / tau))
    theta = np.cumsum(v) * T / n
    return float(np.std(theta))


def test_ripple_in_steps_of_a_fraction_of_the_saw(session: Session) -> None:
    """Steps of 20 us show the cycle of the saw, 1 ms does not; gyro without noise, H/C = 1, tau = 1 ms, 1 deg/s."""
    noise = {"gyro.pickoff": 0.0, "gyro.white": 0.0, "gyro.markov": 0.0}
    plan = {"gate": 0.05, "rest": 6, "readings": 1, "rates": "0.1 0.2 0.3", "settle": 0.5, "latitude": "0.01deg"}
    fine = run(session, {**noise, **plan}, step=2e-5)
    closed = ripple(1.0, 1e-3, math.radians(1.0)) / ARCSEC
    assert value(fine, "ripple") == pytest.approx(closed, rel=5e-3) and closed > 0.05
    assert value(run(session, {**noise, **plan}), "ripple") < 0.1 * closed


@pytest.mark.long
def test_three_loops() -> None:
    """The same asymmetry of the currents: a bias in the binary loop, a scale factor by sign in the one on demand; the
    analog loop has neither, but what its torquer does.
    """
    results = {}
    errors = {"rebalance.dI_plus": 1e-3 * I, "rebalance.dI_minus": -1e-3 * I}
    for part, values in (
        ("rebalance_pwm", errors),
        ("rebalance_pulse", errors),
        ("rebalance_analog", {"rebalance.i_max": 0.22, "gyro.k2": 2e-3, "gyro.k3": -5e-3}),
    ):
        with Session(NAME, {"rebalance": part}) as session:
            results[part] = run(session, values)
    for part, result in results.items():
        for name in ("I_0", "κ", "κ_±", "κ_2", "κ_3"):
            assert abs(result[name].estimate - result[name].truth) < 4.0 * result[name].u, (part, name)
    full = 0.95 * I
    assert results["rebalance_pwm"]["I_0"].truth == pytest.approx(1e-3 * I * 1e6)
    assert results["rebalance_pulse"]["I_0"].truth == 0.0
    assert results["rebalance_pulse"]["κ_±"].truth == pytest.approx(1000.0)
    assert results["rebalance_analog"]["κ_2"].truth == pytest.approx(2e-3 * full * 1e6)
    assert results["rebalance_analog"]["κ_3"].truth == pytest.approx(-5e-3 * full**2 * 1e6)
    # one pulse of 1/1e5 s in 0.2 s: 1 deg/s / 2e4 = 0.18 deg/h; the analog one is not quantized
    assert value(results["rebalance_pulse"], "resolution") == pytest.approx(0.18, rel=1e-9)
    assert value(results["rebalance_analog"], "resolution") == 0.0


@pytest.mark.parametrize(
    "values, message",
    [
        ({"gate": 0.2005}, "gate = 0.2005 s must be whole saws of the rebalance, 0.001 s"),
        ({"range": "1deg/s"}, "the float would run away"),
        ({"rates": "0.5 1.2 0.1"}, "1.2 is not above 0 and up to 1"),
        ({"rates": "0.5 1"}, "at least three different ones"),
        ({"rates": "fast"}, "numbers are expected"),
        ({"rebalance.K_p": 700.0, "rebalance.f_s": 500.0}, "crosses over at 92.9 Hz"),
        ({"rebalance.K_p": 1300.0, "rebalance.f_s": 5e3}, "τ K_v = 1.08; above 1 the loop needs"),
    ],
)
def test_refuses(session: Session, values: dict[str, Any], message: str) -> None:
    with pytest.raises(GyrobenchError, match=message):
        session.run({**QUICK, **values}, 1)


def test_measured_record(session: Session, command: Any, tmp_path: Any) -> None:
    """The windows of a run as a laboratory writes them, mA and degrees: the same values and no truth."""
    errors = {"rebalance.dI_plus": 2e-4, "rebalance.dT": [0.0, 2e-7, 1e-7]}
    record = session.run({**QUICK, **errors}, 3)
    ours = load_system(NAME).reduce(record)
    w, plan = record.windows, {row.phase: row for row in record.run.plan}
    lines = ["# latitude = 45.75deg", "# k = 17.2deg/h/mA", "# range = 0.95deg/s", "# gate = 0.2s", "# type_b = none"]
    lines += [f"# phase {p} = {'rest' if row.mode == 'hold' else 'turning'}" for p, row in plan.items()]
    lines.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA],std [mA],flagged")
    for k in range(w["mean"].size):
        angles = [math.degrees(w[f"angle_{e}"][k]) for e in ("start", "end")]
        row = [int(w["phase"][k]), w["t_start"][k], w["t_end"][k], *angles, w["mean"][k] * 1e3, w["std"][k] * 1e3, 0]
        lines.append(",".join(repr(x) if isinstance(x, int) else repr(float(x)) for x in row))
    file = tmp_path / "loop.csv"
    file.write_text("\n".join(lines), encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 0, err
    theirs = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    found = {c["name"]: c for c in theirs["coefficients"]}
    for name in ("I_0", "κ", "κ_2", "resolution", "noise"):
        assert found[name]["estimate"] == pytest.approx(ours[name].estimate, rel=1e-6), name
        assert found[name]["truth"] is None
    assert "ripple" not in found and "dynamic range" not in found


def test_record_without_the_optional_column(command: Any, tmp_path: Any) -> None:
    """Readings by hand, x (1 + 1e-4) + 3 uA + 5e-5 |x| = omega/k at 0, +-0.3, +-0.6, +-0.9 deg/s and at rest, with and
    without std; s = 2 uA is far below the reading at rest, 0.45 mA, so nothing changes.
    """
    k, earth = 17.2 * math.pi / 648000.0 / 1e-3, 7.2921159e-5 * math.sin(math.radians(45.75))
    rng, values = np.random.default_rng(3), {}
    rows: list[list[float]] = []
    angle = 0.0
    for phase, degrees in enumerate((0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9, 0.0), 1):
        for _ in range(12):
            current = (math.radians(degrees) + earth) / k - 3e-6
            x = current / (1.0 + 1e-4 + math.copysign(5e-5, current)) + 1e-6 * float(rng.normal())
            rows.append([phase, 1.1 * len(rows), 1.1 * len(rows) + 1.0, angle, angle + degrees, x * 1e3])
            angle += 1.1 * degrees
    names = "phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]"
    head = ["# latitude = 45.75deg", "# k = 17.2deg/h/mA", "# range = 0.95deg/s", "# gate = 1s", "# type_b = none"]
    head += [f"# phase {p} = {'rest' if p in (1, 8) else 'turning'}" for p in range(1, 9)]
    stds = {"all": ["0.002"] * len(rows), "none": []}
    for which, std in stds.items():
        lines = [",".join(map(repr, row)) for row in rows]
        lines = [f"{a},{s}" for a, s in zip(lines, std, strict=True)] if std else lines
        file = tmp_path / f"{which}.csv"
        file.write_text("\n".join([*head, names + (",std [mA]" if std else ""), *lines]), encoding="utf-8")
        code, _, err = command("reduce", NAME, "--data", file, "--out", tmp_path / which)
        assert code == 0, err
        result = json.loads((tmp_path / which / "result.json").read_text("utf-8"))
        values[which] = {c["name"]: c for c in result["coefficients"]}
        assert any(r["id"] == "samples.std_missing" for r in result["reasons"]) == (which == "none")
    for name, truth in (("I_0", 3.0), ("κ", 100.0), ("κ_±", 50.0), ("κ_2", 0.0), ("κ_3", 0.0)):
        for found in values.values():
            assert abs(found[name]["estimate"] - truth) < 4.0 * found[name]["u"], name
            assert found[name]["estimate"] == pytest.approx(values["all"][name]["estimate"], abs=0.1 * found[name]["u"])


def test_threshold_and_scale_factor_at_each_rate(session: Session) -> None:
    """A band d = 0.5 deg/h put into the small rates: sqrt(r2 - d2) passes, half of r at d/sqrt(3/4) = 0.577 deg/h.

    Both currents 1e-4 too large: the reading is 100 ppm less than what flows, K - 1 = -100 ppm at every rate.
    """
    small = {"small": "0.2 0.5 0.7 2", "readings": 10}
    record = session.run({**QUICK, **STILL, **small, "rebalance.dI_plus": 1e-4 * I, "rebalance.dI_minus": 1e-4 * I}, 2)
    system = load_system(NAME).with_values(small)
    plain = system.reduce(record)
    assert "below" in plain["threshold"].no_value  # an integrating loop answers any rate
    rows = next(t for t in plain.tables if t.id == "readings").rows
    fastest = [r for r in rows if abs(r[1]) > 3000.0]
    assert len(fastest) == 2 and all(abs(r[4] + 100.0) < 4.0 * r[5] + 2.0 for r in fastest)
    w, k, d = record.windows, 17.2 * ARCSEC / 1e-3, 0.5 * ARCSEC
    earth = 7.2921159e-5 * math.sin(math.radians(45.75))
    felt = (w["angle_end"] - w["angle_start"]) / (w["t_end"] - w["t_start"]) + earth
    slow = (np.abs(felt) < 3.0 * ARCSEC) & (np.abs(felt - earth) > 1e-9)
    passed = np.sign(felt) * np.sqrt(np.maximum(felt**2 - d**2, 0.0))
    w["mean"] = np.where(slow, w["mean"] + (passed - felt) / k, w["mean"])
    found = system.reduce(record)
    assert found["threshold"].interval == pytest.approx((0.5, 0.7))
    assert found["κ"].estimate == pytest.approx(plain["κ"].estimate, abs=plain["κ"].u)
    with pytest.raises(GyrobenchError, match="small"):
        session.run({**QUICK, "small": "200"}, 1)


def test_threshold_of_a_reading_in_steps() -> None:
    """An analog loop read in steps q = 1 deg/h, with a drift of 0.2 deg/h and hardly any noise, answers from q/2 - 0.2
    deg/h = 0.3 deg/h on, in one of the senses: half of a step there, (q/2)/r = 1.43 of the rate 0.35.
    """
    small = {"range": "0.1deg/s", "rates": "0.3 0.6 1", "small": "0.05 0.15 0.27 0.35 0.8", "gyro.D_F": 0.2 * ARCSEC}
    steps = {"rebalance.resolution": ARCSEC / (17.2e3 * ARCSEC), "rebalance.meter": 0.0}
    with Session(NAME, {"rebalance": build("rebalance_analog")}) as session:
        result = run(session, {**STILL, **small, **steps})
    assert result["threshold"].interval == pytest.approx((0.27, 0.35))
    rows = next(t for t in result.tables if t.id == "rate.small").rows
    assert [row[3] for row in rows] == ["no", "no", "no", "yes", "yes"]
    assert [row[1] for row in rows] == pytest.approx([0.0, 0.0, 0.0, 0.5 / 0.35, 1.0 / 0.8 * 0.5 + 0.5 / 0.8], abs=0.02)


def test_a_drift_between_repeats_is_no_answer() -> None:
    """Readings that agree within a phase and not from phase to phase: their scatter within would say u = 0.5 0.005
    sqrt(2/20) = 0.0008, the means of the repeats say 0.25.  Of a rate answered in one of two repeats nothing is said.
    """
    w = np.repeat([1.0, -1.0, 2.0, -2.0, -2.0, 2.0, -1.0, 1.0], 10)
    offset = np.repeat([0.2, -0.3, 0.3, -0.2, 0.3, -0.3, 0.2, -0.2], 10)
    y = w + offset + 0.005 * np.random.default_rng(2).normal(size=80)
    phase = np.repeat(np.arange(8), 10)
    seen = SmallRates.of(w, y, phase)
    assert seen.u[0] == pytest.approx(0.25, rel=0.4) and np.all(seen.margin > 3.0 * seen.u)
    stepped = np.where(np.abs(w) == 1.0, np.where(phase < 4, w, 0.0), w)
    once = SmallRates.of(w, stepped, phase)
    assert once.ratio[0] == pytest.approx(0.5) and once.bounds is not None and once.bounds[0] == 0.0
