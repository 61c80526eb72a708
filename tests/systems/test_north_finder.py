"""North finding in co-simulation: random headings, latitudes and attitudes come back, errors of the method as derived.

Noise off the heading is exact to what the sampled windows leave; with noise the finder has the sigma of the closed form
and the reduction an interval that holds (counted over 1000 runs by tests/benchmarks/north_finder.py).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from north_windows import NAME

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.system.system import load_system
from systems.north_finder import plans
from systems.north_finder.reduction import Reduction

DPH = math.pi / 648000.0
ARCMIN = math.radians(1.0 / 60.0)
QUIET = {"gyro.white_x": 0.0, "gyro.white_y": 0.0, "accelerometers.white_x": 0.0, "accelerometers.white_y": 0.0,
         "accelerometers.white_z": 0.0}  # fmt: skip
SHORT = {"time": 30.0}


@pytest.fixture(scope="module")
def sessions() -> Iterator[Callable[[str], Session]]:
    """A session of each method, made once."""
    made: dict[str, Session] = {}

    def of(method: str, **first: Any) -> Session:
        if method not in made:
            system = load_system(NAME)
            system.set("method", method)
            made[method] = Session(system)
        return made[method]

    yield of
    for session in made.values():
        session.close()


def run(sessions: Callable[[str], Session], method: str, seed: int = 1, **values: Any) -> Record:
    return sessions(method).run({"method": method, **SHORT, **values}, seed=seed)


def off(record: Record, name: str = "finder.heading") -> float:
    """Error of the heading of the finder, rad."""
    return math.remainder(float(record.channels[name][-1]) - record.run.options["heading"], 2.0 * math.pi)


@pytest.mark.parametrize("method", list(plans.PARTS))
def test_random_heads_without_noise(sessions: Callable[[str], Session], method: str) -> None:
    rng = np.random.default_rng(len(method))
    for _ in range(2):
        values: dict[str, Any] = {"latitude": float(rng.uniform(-1.2, 1.2)), "gyro.bias": [2e-6, -1e-6]}
        values["heading"] = float(rng.uniform(0.7, 2.4) if method in plans.SIDED else rng.uniform(-math.pi, math.pi))
        if method == "strapdown":
            values["gyro.bias"] = [0.0, 0.0]
        if method.startswith("strapdown"):
            values |= {"pitch": float(rng.uniform(-1, 1)), "roll": float(rng.uniform(-1, 1))}
        values |= {"time": 60.0} if method == "null" else {}
        record = run(sessions, method, **QUIET, **values)
        assert abs(off(record)) < 1e-7 and record.channels["finder.status"][-1] == 1.0
        found = Reduction.from_record(record)
        # windows of a turning head: table angle and rate are sampled, trapezoids of 1 ms against exact means
        assert found["ψ"].estimate == pytest.approx(found["ψ"].truth, abs=2e-5)
        if "b" in found.names:
            assert found["b"].estimate * DPH == pytest.approx(-1e-6, abs=1e-10)


def test_sigma_and_interval_with_noise(sessions: Callable[[str], Session]) -> None:
    """Four positions: sigma = sqrt(2/T) N/A of the finder, its errors and those of the reduction within it."""
    z, held = [], 0
    for seed in range(12):
        record = run(sessions, "four", seed=seed, nuisances="none", heading=-2.0 + 0.3 * seed)
        o = record.run.options
        lost = plans.overhead("four", 12, False, o["settle"], 1e-3)
        expected = plans.reached("four", 0.3 * DPH, o["latitude"], 0.0, o["time"] - lost)
        sigma = float(record.channels["finder.sigma"][-1])
        # sigma goes with the horizontal rate as measured, whose relative error is of its size
        assert sigma == pytest.approx(expected, rel=5.0 * expected)
        z.append(off(record) / expected)
        found = Reduction.from_record(record)["ψ"]
        held += found.interval[0] <= found.truth <= found.interval[1]
    assert abs(float(np.mean(z))) < 3.5 / math.sqrt(12) and float(np.std(z)) < 1.7
    assert held >= 9


def test_a_tilted_head_is_wrong_by_the_tangent_of_the_latitude(sessions: Callable[[str], Session]) -> None:
    """3 mrad about north: 3e-3 tan(45.75 deg) = 3.08e-3 rad; the method tilt and strapdown are right."""
    values = {"heading": 0.0, "roll": 3e-3, **QUIET}
    assert abs(off(run(sessions, "four", **values))) == pytest.approx(3e-3 * math.tan(math.radians(45.75)), rel=1e-2)
    assert abs(off(run(sessions, "tilt", **values))) < 0.02 * ARCMIN
    assert abs(off(run(sessions, "strapdown two", **values))) < 1e-7


def test_printed_formulas_fail_on_records(sessions: Callable[[str], Session]) -> None:
    """GSP 5-50, 5-54, 5-55, 5-59 and 5-65c as printed (EG16, EG18 to EG21, EG24) and corrected, on windows of runs."""
    psi, latitude = math.radians(40.0), math.radians(45.75)
    values = {**QUIET, "heading": psi, "latitude": latitude, "gyro.bias": [0.0, 0.0]}
    north, up = frames.EARTH_RATE * math.cos(latitude), frames.EARTH_RATE * math.sin(latitude)

    def windows(method: str, **more: float) -> tuple[np.ndarray, ...]:
        """Return angle of the head (clockwise), rates along x and y, specific forces along x and y."""
        record = run(sessions, method, **values, **more)
        w = {name: np.asarray(column) for name, column in record.windows.items()}
        return -(w["angle_start"] + w["angle_end"]) / 2.0, w["mean_x"], w["mean"], w["f_x"], w["f_y"]

    angle, _, rate, *_ = windows("four")
    w0, w1, w2, w3 = (rate[np.abs(np.sin((angle - k * math.pi / 2) / 2)) < 0.1].mean() for k in range(4))
    assert math.atan2(w3 - w1, w0 - w2) == pytest.approx(psi, abs=1e-5)
    assert math.acos((w1 - w3) / (2 * north)) == pytest.approx(psi + math.pi / 2, abs=1e-4)  # 5-50: an arcsine

    angle, _, w, *_ = windows("continuous")
    part = np.mod(angle, 2 * math.pi) < 4.0  # of whole turns sin and cos are orthogonal, and a wrong sum is times 0
    s, c, w = np.sin(angle[part]), np.cos(angle[part]), w[part]
    ss, cc, sc, wc, ws = s @ s, c @ c, s @ c, w @ c, w @ s
    D = ss * cc - sc**2
    A, B = (ss * wc - sc * ws) / D, (sc * wc - cc * ws) / D
    assert math.atan2(B, A) == pytest.approx(psi, abs=1e-3)
    assert math.atan2(-B, A) == pytest.approx(-psi, abs=1e-3)  # the sign of B in 5-55
    assert abs((ss * wc - np.sin(w).sum() * sc) / D / A - 1.0) > 0.05  # 5-54: sum w sin
    assert abs(math.atan2((cc * ws - c.sum() * sc) / D, A) - psi) > 0.5  # 5-55: sum w cos (it gives 90 deg)

    _, x, y, f_x, f_y = (column.mean() for column in windows("strapdown", pitch=0.0873, roll=0.0873))
    g = float(frames.normal_gravity(latitude))
    theta = math.asin(f_y / g)
    gamma = -math.asin(f_x / (g * math.cos(theta)))
    assert (theta, gamma) == pytest.approx((0.0873, 0.0873), abs=1e-5)
    forward = north * math.cos(psi) * math.cos(theta)
    assert y == pytest.approx(forward + up * math.sin(theta), rel=1e-5)
    assert abs(y - (forward - up * math.sin(theta))) > 0.1 * north  # 5-59
    for vertical, right in ((up, True), (frames.EARTH_RATE, False)):  # 5-65c has the whole Earth rate
        above = -(x * math.cos(theta) - y * math.sin(gamma) * math.sin(theta) + vertical * math.sin(gamma))
        found = math.atan2(above, (y - vertical * math.sin(theta)) * math.cos(gamma))
        assert (abs(found - psi) < 1e-5) is right and (abs(found - psi) < 10 * ARCMIN) is right


def test_drift_of_the_bias(sessions: Callable[[str], Session]) -> None:
    """Forwards and backwards a linear drift cancels; forwards the heading is off, and the nuisance model says trend."""
    drift = {"gyro.ramp": [0.0, 20.0 * DPH / 3600.0], **QUIET}
    once, back = (off(run(sessions, "four", back=b, time=60.0, **drift)) for b in (False, True))
    assert abs(once) > 5 * ARCMIN and abs(back) < 0.01 * abs(once)


def test_drift_of_higher_order(sessions: Callable[[str], Session]) -> None:
    """bias + ramp t + curve t2 of 3 deg/h and 6 deg/h over 60 s is estimated with the heading.

    By hand, t = m + h x with x = -1..1 over the readings: d_1 = h (ramp + 2 curve m), d_2 = 2/3 curve h2.
    """
    ramp, curve = 3.0 * DPH / 60.0, 6.0 * DPH / 3600.0
    drift = {"gyro.ramp": [0.0, ramp], "gyro.curve": [0.0, curve], **QUIET, "time": 60.0, "windows": 64}
    for method, more in (("continuous", {}), ("several", {"positions": 6, "back": True})):
        record = run(sessions, method, drift_order=2, **more, **drift)
        assert abs(off(record)) < 0.01 * ARCMIN, method
        found = Reduction.from_record(record)
        t0, t1 = float(record.windows["t_start"][0]), float(record.windows["t_end"][-1])
        m, h = (t0 + t1) / 2.0, (t1 - t0) / 2.0
        expected = {"ψ": 40.0, "d_1": h * (ramp + 2.0 * curve * m) / DPH, "d_2": 2.0 / 3.0 * curve * h * h / DPH}
        for name, value in expected.items():
            assert found[name].estimate == pytest.approx(value, rel=1e-4), (method, name)
            assert found[name].truth == pytest.approx(value, rel=1e-9)
        assert found["b"].estimate == pytest.approx(found["b"].truth, rel=1e-4)
    linear = run(sessions, "continuous", drift_order=1, **drift)
    assert abs(off(linear)) > ARCMIN
    with pytest.raises(GyrobenchError, match="one gyro axis"):
        run(sessions, "strapdown two", drift_order=1)


def test_the_null_points_east_or_west(sessions: Callable[[str], Session]) -> None:
    """EG26: heading 8 deg, rough on its side: the head has turned by 8 - 90 deg, where both rates are the same.

    A scale factor 2 % off makes c1 = 1.02 cos 8 deg = 1.01, so the first pair turns by 90 deg, 8 too many; the second
    is off by 2 % of that, 0.16 deg, the third by 2 % of this: 0.054 deg in the mean of three.
    """
    values = {"heading": math.radians(8.0), "rough": math.radians(20.0), "time": 60.0, **QUIET}
    record = run(sessions, "null", **values)
    assert math.degrees(record.windows["angle_end"][-1]) == pytest.approx(8.0 - 90.0, abs=1e-4)
    rates = [record.windows["mean"][record.windows["phase"] == p].mean() for p in (7, 8)]
    assert rates[0] == pytest.approx(rates[1], abs=1e-9)
    wrong = run(sessions, "null", **values | {"gyro.scale": [0.0, 0.02]})
    assert abs(math.degrees(off(wrong))) == pytest.approx(0.054, abs=0.003)
    found = Reduction.from_record(wrong)["ψ"]
    assert found.estimate == pytest.approx(8.0, abs=0.06)


def test_interval_of_the_null(sessions: Callable[[str], Session]) -> None:
    """Headings near north, noise: z of the finder by sigma = N/(A sqrt(T)), T the time of three pairs of four."""
    z, held = [], 0
    for seed in range(12):
        heading = math.radians(2.0 + seed)
        record = run(sessions, "null", seed=seed, nuisances="none", heading=heading, rough=0.1, time=60.0)
        z.append(off(record) / float(record.channels["finder.sigma"][-1]))
        found = Reduction.from_record(record)["ψ"]
        held += found.interval[0] <= found.truth <= found.interval[1]
    assert abs(float(np.mean(z))) < 3.5 / math.sqrt(12) and float(np.std(z)) < 1.7
    assert held >= 9


@pytest.mark.long
def test_a_moving_base_does_not_pass_for_noise(
    sessions: Callable[[str], Session], command: Command, tmp_path: Path
) -> None:
    code, _, err = command("run", NAME, "--set", "base=ship at pier", "--set", "time=40s", "--out", tmp_path / "run")
    if code == 3:
        assert "base moves" in err or "do not determine" in err
        return
    result = json.loads((tmp_path / "run" / "result.json").read_text("utf-8"))
    psi = result["coefficients"][0]
    assert abs(psi["estimate"] - psi["truth"]) < 3.0 * psi["u"]


def test_auto_takes_the_shortest() -> None:
    """The time of the method chosen is what its closed form says, and no other method is done in 95 % of it."""
    density, latitude = 0.05 * DPH, math.radians(60.0)
    for rough, level, axes in ((1.5, True, 1), (0.1, True, 1), (1.0, False, 1), (1.0, False, 2)):
        system = load_system(NAME)
        for name, value in {"density": density, "latitude": latitude, "rough": rough, "level": level, "axes": axes,
                            "wanted": 3 * ARCMIN, "method": "auto"}.items():  # fmt: skip
            system.set(name, value)
        assert system.slots["finder"].part == plans.PARTS[system.chosen]
        reading = system.total - plans.overhead(system.chosen, 12, False, 0.5, 1e-3)
        assert plans.reached(system.chosen, density, latitude, rough, reading) == pytest.approx(3 * ARCMIN, rel=1e-9)
        for other in plans.possible(level, axes, rough):
            left = 0.95 * system.total - plans.overhead(other, 12, False, 0.5, 1e-3)
            assert left <= 0.0 or plans.reached(other, density, latitude, rough, left) > 3 * ARCMIN


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (["latitude=86deg"], "within 5° of a pole"),
        (["method=gyrocompass"], "must be one of two, null, four"),
        (["method=auto"], "wanted=1arcmin"),
        (["time=5s"], "moves and settling take"),
        (["base=train"], "must be one of rest"),
        (["method=two", "back=true"], "two positions only"),
    ],
)
def test_run_is_refused(refused: Callable[..., None], values: list[str], words: str) -> None:
    refused(NAME, values, [words])


def written(heading: float, latitude: float, method: str, bias: float = 0.2, noise: float = 0.01, seed: int = 4) -> str:
    """A laboratory's file from the equations: w = A cos(heading - angle) + bias, deg/h."""
    rng = np.random.default_rng(seed)
    A = 15.041067 * math.cos(latitude)
    lines = [f"# latitude = {math.degrees(latitude)!r}deg", f"# method = {method}", "# type_b = none"]
    lines.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [deg/h]")
    for k in range(40):
        position = k // 10
        angle = -90.0 * position
        w = A * math.cos(heading - math.radians(angle)) + bias + noise * float(rng.normal())
        t = 10.0 * k + 5.0 * position
        lines.append(f"{position + 1},{t!r},{t + 10.0!r},{angle!r},{angle!r},{w!r}")
    return "\n".join(lines) + "\n"


def test_measured_record(command: Command, tmp_path: Path) -> None:
    (tmp_path / "lab.csv").write_text(written(2.5, 0.8, "four"), encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    psi, A, b = result["coefficients"][:3]
    # positions 40 readings of 0.01 deg/h: sd of the heading sqrt(2/40) 0.01 / 10.48 rad = 0.0122 deg
    assert psi["estimate"] == pytest.approx(math.degrees(2.5), abs=4 * psi["u"]) and 0.008 < psi["u"] < 0.05
    assert A["estimate"] == pytest.approx(15.041067 * math.cos(0.8), abs=4 * A["u"])
    assert b["estimate"] == pytest.approx(0.2, abs=4 * b["u"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("method = four", "method = strapdown"), "column mean_x, f_x, f_y is missing"),
        (("method = four", "method = two"), "angles 0 and 180° are needed"),
        (("[deg/h]", "[deg/min]"), "latitude, unit or axes are wrong"),
        (("# method = four\n", ""), "'method' is not given"),
    ],
)
def test_measured_record_is_refused(command: Command, tmp_path: Path, change: tuple[str, str], words: str) -> None:
    (tmp_path / "lab.csv").write_text(written(2.5, 0.8, "four").replace(*change), encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code in (2, 3) and words in " ".join(err.split()) and "Traceback" not in err


def test_error_of_the_finder_of_a_tilted_head(sessions: Callable[[str], Session]) -> None:
    """3/8 tau2 at most, over the directions of a tilt of 0.1 rad: the part is right to first order."""
    worst = 0.0
    for k in range(8):
        values = {"pitch": 0.1 * math.cos(k * math.pi / 4), "roll": 0.1 * math.sin(k * math.pi / 4)}
        worst = max(worst, abs(off(run(sessions, "tilt", time=12.0, heading=0.3, latitude=1.0, **QUIET, **values))))
    assert 0.5 * 0.00375 < worst < 1.02 * 0.00375


def test_one_position_says_that_the_bias_is_in_the_heading(sessions: Callable[[str], Session]) -> None:
    """w_x = -A sin psi, w_y = A cos psi: biases b_x, b_y turn the heading by -(b_x cos psi + b_y sin psi)/A; 0.1 deg/h
    of 10.4956 deg/h are 0.546 deg.
    """
    heading, bias = 0.6, np.array([0.1, 0.1]) * DPH
    values = {**QUIET, "heading": heading, "latitude": math.radians(45.75), "gyro.bias": bias.tolist()}
    record = run(sessions, "strapdown", **values)
    result = Reduction.from_record(record)
    said = [w for w in result.warnings if "leaves the bias of the gyro in the heading" in w]
    assert len(said) == 1 and "0.1 °/h turn by up to 0.55°" in said[0] and "u_bias" in said[0]
    turned = -math.degrees((bias[0] * math.cos(heading) + bias[1] * math.sin(heading)) / (10.4956 * DPH))
    assert abs(turned) > 0.7
    assert result["ψ"].estimate - math.degrees(heading) == pytest.approx(turned, rel=0.01)
    predicted = next(t for t in result.tables if t.id == "budget.predicted")
    assert next(r for r in predicted.rows if r[0] == "ψ")[-3] == pytest.approx(turned, rel=0.02)
    record.run.options["u_bias"] = 0.1 * DPH
    stated = Reduction.from_record(record)
    assert not any("leaves the bias" in w for w in stated.warnings) and stated["ψ"].u == pytest.approx(0.546, rel=0.02)
    two = Reduction.from_record(run(sessions, "strapdown two", **values))
    assert not any("leaves the bias" in w for w in two.warnings)
