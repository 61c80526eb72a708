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

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.system.system import load_system
from systems.north_finder import plans
from systems.north_finder.reduction import from_record

Command = Callable[..., tuple[int, str, str]]
NAME = "north_finder"
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
        values["heading"] = float(rng.uniform(0.7, 2.4) if method == "two" else rng.uniform(-math.pi, math.pi))
        if method == "strapdown":
            values["gyro.bias"] = [0.0, 0.0]
        if method.startswith("strapdown"):
            values |= {"pitch": float(rng.uniform(-1, 1)), "roll": float(rng.uniform(-1, 1))}
        record = run(sessions, method, **QUIET, **values)
        assert abs(off(record)) < 1e-7 and record.channels["finder.status"][-1] == 1.0
        found = from_record(record)
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
        found = from_record(record)["ψ"]
        held += found.interval[0] <= found.truth <= found.interval[1]
    assert abs(float(np.mean(z))) < 3.5 / math.sqrt(12) and float(np.std(z)) < 1.7
    assert held >= 9


def test_a_tilted_head_is_wrong_by_the_tangent_of_the_latitude(sessions: Callable[[str], Session]) -> None:
    """3 mrad about north: 3e-3 tan(45.75 deg) = 3.08e-3 rad; the method tilt and strapdown are right."""
    values = {"heading": 0.0, "roll": 3e-3, **QUIET}
    assert abs(off(run(sessions, "four", **values))) == pytest.approx(3e-3 * math.tan(math.radians(45.75)), rel=1e-2)
    assert abs(off(run(sessions, "tilt", **values))) < 0.02 * ARCMIN
    assert abs(off(run(sessions, "strapdown two", **values))) < 1e-7


def test_drift_of_the_bias(sessions: Callable[[str], Session]) -> None:
    """Forwards and backwards a linear drift cancels; forwards the heading is off, and the nuisance model says trend."""
    drift = {"gyro.ramp": [0.0, 20.0 * DPH / 3600.0], **QUIET}
    once, back = (off(run(sessions, "four", back=b, time=60.0, **drift)) for b in (False, True))
    assert abs(once) > 5 * ARCMIN and abs(back) < 0.01 * abs(once)


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
        (["method=gyrocompass"], "must be one of two, four"),
        (["method=auto"], "wanted=1arcmin"),
        (["time=5s"], "moves and settling take"),
        (["base=train"], "must be one of rest"),
        (["method=two", "back=true"], "two positions only"),
    ],
)
def test_run_is_refused(command: Command, tmp_path: Path, values: list[str], words: str) -> None:
    given = [x for v in values for x in ("--set", v)]
    code, _, err = command("run", NAME, *given, "--out", tmp_path / "run")
    assert code == 2 and words in " ".join(err.split()) and "Traceback" not in err


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
