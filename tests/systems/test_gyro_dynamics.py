"""Dynamics of a floated gyro: closed forms of third order come back, from runs and files; steps without a model."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from scipy import signal

from gyrobench.engine.session import Session
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "gyro_dynamics"
PACKAGE = type(load_system(NAME)).__module__
MODEL: Any = importlib.import_module(".model", PACKAGE)
STEPS: Any = importlib.import_module(".steps", PACKAGE)
SHORT: dict[str, Any] = {"points": 12, "dwell": 0.1, "periods": 10, "lowest": 4.0, "settle": 0.2, "steps": 3}
QUIET: dict[str, Any] = {f"gyro.{n}": 0.0 for n in ("white", "markov", "pickoff")}
NO_G = {f"gyro.D_{n}": 0.0 for n in ("I", "O", "S", "II", "SS", "IO", "OS", "IS")}
# H, J, C, K_I, K_O unlike the defaults: tau_0 = J/C = 0.8 ms, H2/(K_I C) = 0.24 ms, f_0 = sqrt(K_I K_O)/(2 pi H)
DRAWN = {"H": 0.12, "J": 1.2e-4, "C": 0.15, "K_I": 400.0, "K_O": 1500.0}


def reduced(values: dict[str, Any], part: str = "compliant_gyro") -> Result:
    options = {n: v for n, v in values.items() if "." not in n}
    with Session(NAME, {"gyro": part}) as session:
        record = session.run(values, seed=1)
    result: Result = load_system(NAME).with_values(options).reduce(record)
    return result


def found(result: Result) -> dict[str, Any]:
    return {c.name: c for c in result.coefficients}


@pytest.fixture(scope="module")
def about_input() -> dict[str, Any]:
    return found(reduced({**SHORT, **QUIET, **NO_G, **{f"gyro.{n}": v for n, v in DRAWN.items()}}))


def test_third_order_comes_back(about_input: dict[str, Any]) -> None:
    """By hand: g = H/C = 0.8, tau = 0.8 + 0.24 ms, f_0 = sqrt(400 1500)/(2 pi 0.12) Hz; -3 dB by the polynomial."""
    c = about_input
    f_0 = math.sqrt(400.0 * 1500.0) / (2.0 * math.pi * 0.12)
    expected = {"g": 0.8, "tau": 1.04, "tau_0": 0.8, "f_0": f_0, "K_I": 400.0, "K_O": 1500.0, "tau_step": 1.04}
    for name, value in expected.items():
        assert c[name].estimate == pytest.approx(value, rel=2e-5), name
        assert c[name].truth == pytest.approx(value, rel=1e-12), name
    a2 = 0.12**2 / (400.0 * 1500.0)
    f = np.linspace(100.0, 250.0, 150_001)
    gain = np.abs(signal.freqs([1.0], [a2 * 0.8e-3, a2, 1.04e-3, 1.0], 2.0 * np.pi * f)[1])
    assert c["f_3dB"].estimate == pytest.approx(f[np.argmax(gain < math.sqrt(0.5))], rel=2e-5)


def test_about_the_output_axis() -> None:
    """-(a2 tau_0 s3 + tau s)/D of the default gyro: tau = 1.5 ms, J/C = 1 ms, f_0 = sqrt(400 2000)/(2 pi 0.2) Hz."""
    c = found(reduced({**SHORT, **QUIET, **NO_G, "axis": "output"}))
    f_0 = math.sqrt(400.0 * 2000.0) / (0.4 * math.pi)
    assert c["g"].estimate == pytest.approx(1.0, rel=1e-5) and "tau_step" not in c
    assert c["tau"].estimate == pytest.approx(1.5, rel=1e-4)
    assert c["tau_0"].estimate == pytest.approx(1.0, rel=5e-3)
    assert c["f_0"].estimate == pytest.approx(f_0, rel=5e-3)


@pytest.fixture(scope="module")
def wrong() -> Result:
    """A stiff gyro; a reading 1 % too large and 2 us late."""
    errors = {"table.read_gain": 0.01, "table.read_lag": 2e-6, "u_gain": 0.01, "u_lag": 2e-6}
    return reduced({**SHORT, **NO_G, **errors}, "floated_gyro")


def test_stiff_bearings_and_set_up_errors(wrong: Result) -> None:
    c = found(wrong)
    assert c["tau_step"].estimate == pytest.approx(1.0 - 0.002, abs=4.0 * c["tau_step"].u_a)
    assert c["g"].estimate == pytest.approx(1.0 / 1.01, rel=1e-3)
    rows = {r[0]: r for r in next(t for t in wrong.tables if t.id == "budget.predicted").rows}
    assert rows["g"][3] == pytest.approx(c["g"].estimate - 1.0, rel=0.1)
    assert rows["tau"][3] == pytest.approx(c["tau"].estimate - 1.0, rel=0.1)
    assert abs(c["g"].z) < 1.2 and abs(c["tau"].z) < 1.3
    assert {b.id for b in wrong.budget} == {"table.reading.gain", "table.reading.lag"}


# ------------------------------------------------------------------------------------------------ curve and area alone
def drawn(rng: np.random.Generator) -> tuple[float, float, float, float, list[float]]:
    tau_0, more = rng.uniform(0.5e-3, 2e-3), rng.uniform(0.1e-3, 1e-3)
    a2 = (2.0 * math.pi * rng.uniform(400.0, 900.0)) ** -2
    return rng.uniform(0.5, 2.0), tau_0, more, a2, [a2 * tau_0, a2, tau_0 + more, 1.0]


@pytest.mark.long
def test_random_responses_come_back() -> None:
    """15 gyros, noise of 0.1 %: sum of z2 of g, tau and f_3dB, 45 with standard deviation sqrt(90), 4.5 of them."""
    rng = np.random.default_rng(3)
    f = np.geomspace(1.0, 300.0, 20)
    squares = []
    for _ in range(15):
        g, tau_0, more, a2, D = drawn(rng)
        value = signal.freqs([g], D, 2.0 * np.pi * f)[1]
        value *= np.exp(1e-3 * (rng.normal(size=20) + 1j * rng.normal(size=20)))
        got = MODEL.figures(MODEL.AngleResponse(f, value, np.full(20, 1e-3), False), 0.2)
        true = MODEL.read_off(np.array([math.log(g), math.log(tau_0 + more), a2, a2 * tau_0]), 300.0, 0.2, False)
        squares += [((got.value[k] - true[k]) / got.u[k]) ** 2 for k in (0, 1, 4)]
    assert np.sum(squares) == pytest.approx(45.0, abs=4.5 * math.sqrt(90.0))


@pytest.mark.parametrize("highest", [300.0, 1000.0])
@pytest.mark.long
def test_curves_with_a_resonance_and_a_zero_are_found(highest: float) -> None:
    """About the output axis, noise of 0.1 %: chi2 of 46 degrees of freedom, within 5 standard deviations of 9.6."""
    rng = np.random.default_rng(9)
    f = np.geomspace(1.0, highest, 25)
    for _ in range(6):
        g, tau_0, more, a2, D = drawn(rng)
        value = signal.freqs([-g * a2 * tau_0, 0.0, -g * (tau_0 + more), 0.0], D, 2.0 * np.pi * f)[1]
        value *= np.exp(1e-3 * (rng.normal(size=25) + 1j * rng.normal(size=25)))
        got = MODEL.figures(MODEL.AngleResponse(f, value, np.full(25, 1e-3), True), 0.0)
        assert abs(got.fit.chi2 - 46.0) < 48.0 and got.fit.elastic
        assert abs(got.value[1] - tau_0 - more) < 4.5 * got.u[1]


def test_the_area_is_the_time_constant_whatever_the_turn() -> None:
    """A float of third order by an integrator of scipy, two laws of turning, drift of the float: tau to 1e-6."""
    rng = np.random.default_rng(8)
    for law in (lambda x: x, lambda x: x * x * (3.0 - 2.0 * x)):
        g, tau_0, more, _, D = drawn(rng)
        t = np.arange(0.0, 0.4, 2e-5)
        theta = 3e-4 * law(np.clip((t - 0.15) / 0.02, 0.0, 1.0))
        b = signal.lsim(([g], D), theta, t)[1] + 1e-6 + 2e-6 * t
        gain, tau = STEPS.TableTurn(t, theta, b, 0.15, 0.17).gain_and_lag()
        assert (gain, tau) == pytest.approx((g, tau_0 + more), rel=2e-6)


# ------------------------------------------------------------------------------------------------ files
def measured(
    tmp_path: Path, head: str, rows: np.ndarray, comments: str = "type_b = none;arrangement = checked"
) -> Result:
    file = tmp_path / "r.csv"
    text = [f"# {c}" for c in ("K_sg = 10V/rad", "H = 0.12N.m.s", *comments.split(";"))]
    file.write_text("\n".join([*text, head, *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n", "utf-8")
    system = load_system(NAME).with_values({})
    result: Result = system.reduce(system.read_measured(file, {}))
    return result


def sines(output: bool = False) -> np.ndarray:
    """Rows of the gyro DRAWN with scatter of 0.02 %, table 1 arcmin."""
    rng = np.random.default_rng(5)
    a2, tau = 0.12**2 / (400.0 * 1500.0), 1.04e-3
    f = np.geomspace(1.0, 300.0, 20)
    top = [-a2 * 0.8e-3, 0.0, -tau, 0.0] if output else [0.8]
    h = signal.freqs(top, [a2 * 0.8e-3, a2, tau, 1.0], 2.0 * np.pi * f)[1]
    h = h * np.exp(2e-4 * (rng.normal(size=20) + 1j * rng.normal(size=20)))
    volts = 10.0 * math.radians(1.0 / 60.0) * np.abs(h)
    return np.column_stack([f, np.ones(20), volts, np.degrees(np.angle(h))])


SINES, SAMPLES = "frequency [Hz],table [arcmin],pickoff [V],phase [deg]", "time [s],table [rad],pickoff [V]"


def test_a_file_of_sines(tmp_path: Path) -> None:
    c = found(measured(tmp_path, SINES, sines()))
    for name, value in {"g": 0.8, "tau": 1.04, "tau_0": 0.8, "K_I": 400.0, "K_O": 1500.0}.items():
        assert abs(c[name].estimate - value) < 3.5 * c[name].u, name
    assert c["tau"].u < 1e-3
    c = found(measured(tmp_path, SINES, sines(output=True), "type_b = none;axis = output"))
    assert abs(c["tau"].estimate - 1.04) < 3.5 * c["tau"].u and "f_3dB" not in c


def test_scatter_that_is_none(tmp_path: Path) -> None:
    """Without u the scatter takes its place: a filter of the pickoff, 1 ms, moves tau by many u; no word was said."""
    rows = sines()
    low_pass = 1.0 / (1.0 + 2j * np.pi * rows[:, 0] * 1e-3)
    rows[:, 2] *= np.abs(low_pass) ** 2
    rows[:, 3] += 2.0 * np.degrees(np.angle(low_pass))
    assert "response.misfit" in {r.id for r in measured(tmp_path, SINES, rows).reasons if r.severity == "doubt"}
    assert not measured(tmp_path, SINES, sines()).reasons


def test_a_file_of_steps(tmp_path: Path) -> None:
    """Four turns to and fro, samples every 0.2 ms, noise of 0.2 mV of 2.4."""
    rng = np.random.default_rng(6)
    t = np.arange(0.0, 2.0, 2e-4)
    theta = 3e-4 * sum(s * np.clip((t - t0) / 0.03, 0.0, 1.0) for s, t0 in ((1, 0.3), (-1, 0.7), (1, 1.1), (-1, 1.5)))
    b = signal.lsim(([0.8], [1.04e-3, 1.0]), theta, t)[1] + 2e-7 * rng.normal(size=t.size)
    result = measured(tmp_path, SAMPLES, np.column_stack([t, theta, 10.0 * b]))
    c = found(result)
    assert abs(c["tau_step"].estimate - 1.04) < 4.0 * c["tau_step"].u < 0.1
    assert abs(c["g_step"].estimate - 0.8) < 4.0 * c["g_step"].u < 1e-3


def test_nothing_stated_nothing_passes(tmp_path: Path) -> None:
    """The gain of the reading moves g, its lag tau."""
    result = measured(tmp_path, SINES, sines(), "note = x")
    assert {"type_b.unstated", "arrangement.unstated"} <= {r.id for r in result.reasons}
    gain, lag = (r for r in result.reasons if r.id == "type_b.unstated" and r.names)
    assert "g" in gain.names and "tau" in lag.names and {gain.text, lag.text} <= set(result.summary)


@pytest.mark.parametrize("said", ["note = x", "u_gain = 1e-3;u_lag = 1e-6s"])
def test_what_is_stated_and_left_out_in_chinese(command: Command, tmp_path: Path, said: str) -> None:
    """A report of which a sentence or a source has no translation is not written."""
    measured(tmp_path, SINES, sines(), said)
    words = ("reduce", NAME, "--data", tmp_path / "r.csv", "--language", "zh", "--out", tmp_path / "out")
    code, _, err = command(*words, pages=True, figures=False)
    assert code == 0, err


@pytest.mark.parametrize(
    ("kind", "said"),
    [("rate", "rate of the table"), ("axis", "output axis"), ("sense", "reversed"), ("sign", "opposite sign"),
     ("", "")],
)  # fmt: skip
def test_mistakes_are_named(tmp_path: Path, kind: str, said: str) -> None:
    rows = sines(output=kind == "axis")
    if kind == "rate":
        rows[:, 1] *= 2.0 * math.pi * rows[:, 0]
        rows[:, 3] -= 90.0
    elif kind == "sense":
        rows[:, 3] += 180.0
    elif kind == "sign":
        rows[:, 3] *= -1.0
    try:
        reasons = [r.text for r in measured(tmp_path, SINES, rows).reasons if r.id.startswith("response.")]
    except ReductionError as error:  # no curve fits: the likely mistake is in the message
        reasons = [str(error)]
    assert said in reasons[0] if said else not reasons


def test_a_frequency_that_is_none(tmp_path: Path) -> None:
    rows = sines()
    rows[:, 0] *= 1e-300
    with pytest.raises(ReductionError, match="is their unit right"):
        measured(tmp_path, SINES, rows)


@pytest.mark.parametrize(
    ("values", "said"),
    [({"lowest": 400.0}, "must be below highest"), ({"axis": "spin"}, "input or output"), ({"steps": 2}, "at least 3"),
     ({"rise": 1e-4}, "a longer one")],
)  # fmt: skip
def test_refused(values: dict[str, Any], said: str) -> None:
    assert said in " ".join(load_system(NAME).with_values(values).check())


def test_an_angle_beyond_the_pickoff_is_refused() -> None:
    parts = {"gyro.H": 0.2, "gyro.C": 0.2, "gyro.K_sg": 10.0, "gyro.u_max": 0.1}
    assert "half of the pickoff" in " ".join(load_system(NAME).with_values({"angle": 0.02}).check_parameters(parts))
