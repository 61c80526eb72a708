"""The multi-position test in co-simulation: recovery, errors of the head, refusals, measured data."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from multipoint import KS, NAME, estimates, load, polynomial, quiet, windows
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.record.record import Record

UG, ARCSEC = 1e-6, math.pi / 648000.0
FAST = {"settle": 0.6, "dwell": 0.2}  # the slowest pole, -87 1/s, leaves exp(-52) of the move


def random_values(rng: np.random.Generator) -> dict[str, Any]:
    k = {f"accelerometer.{n}": v for n, v in polynomial(rng).items()}
    return {**FAST, **quiet(load()), **k, "latitude": float(rng.uniform(-1.5, 1.5))}


# ---------------------------------------------------------------------------------------------- recovery
@pytest.mark.parametrize(("points", "mounts", "turns"), [
    (24, "both", 1), (12, "both", 2), (8, "both", 1), (8, "a", 2), (7, "b", 1), (24, "b", 2),
])  # fmt: skip
def test_random_accelerometers(session: Session, points: int, mounts: str, turns: int) -> None:
    """Noise off: every coefficient to 1e-9 of 1 g (design: 1e-12), whatever latitude, scale and tilt of the mount."""
    rng = np.random.default_rng(points + turns)
    values = {**random_values(rng), "points": points, "mounts": mounts, "turns": turns}
    values["accelerometer.scale"] = float(rng.uniform(8e3, 2e4))
    r = load().with_values(values).reduce(session.run(values))
    assert r.simulated and r.noise["model"] == "none (ideal data)"
    found = estimates(r)
    for n in KS:
        if n in found:
            assert found[n] == pytest.approx(values[f"accelerometer.{n}"], abs=1e-11), n
    assert ("k4" in found) == (mounts != "a") and ("k5" in found) == (mounts != "b")
    for c in r.coefficients:
        assert c.truth == pytest.approx(c.estimate, abs=1e-5) and c.closed == pytest.approx(c.estimate, abs=1e-5)


def test_tilted_input_axis_is_the_zero_angle(session: Session) -> None:
    """A mount turned about the axis of the head by 0.5 deg: theta_0 = 0.5 deg in mount a (the axis is -y there: a turn
    of +0.5 deg about -y lifts x), 0 in mount b, where the same turn is about the vertical at angle 0; there X is
    smaller by cos 0.5 deg, and the k1 of the fit of both lies between.
    """
    rng = np.random.default_rng(4)
    turn = Rotation.from_rotvec([0.0, -math.radians(0.5), 0.0]).as_matrix()  # active: rows of the axes follow
    values = {**random_values(rng), "points": 8, "mounts": "a", "accelerometer.mount": turn.T.tolist()}
    r = load().with_values(values).reduce(session.run(values))
    found = estimates(r)
    assert found["θ₀ a"] == pytest.approx(math.radians(0.5), abs=1e-11)
    assert r.coefficients[-1].truth == pytest.approx(1800.0, abs=1e-8)
    for n in ("k0", "k1", "k2", "k3", "k5"):
        assert found[n] == pytest.approx(values[f"accelerometer.{n}"], abs=1e-11)
    both = {**values, "mounts": "b"}
    found = estimates(load().with_values(both).reduce(session.run(both)))
    assert found["θ₀ b"] == pytest.approx(0.0, abs=1e-11)
    k1 = values["accelerometer.k1"] * math.cos(math.radians(0.5))
    assert found["k1"] == pytest.approx(k1, abs=3e-4 * 0.009)  # k5 sin 0.5 deg and the like


def test_four_positions(session: Session) -> None:
    rng = np.random.default_rng(5)
    values = {**random_values(rng), "points": 4}
    system = load().with_values(values)
    r = system.reduce(session.run(values))
    assert len(r.coefficients) == 5 and r.coefficients[1].name == "k1 + k3γ²"
    for c in r.coefficients:
        assert c.truth == pytest.approx(c.estimate, abs=1e-5)
    assert "Four positions" in system.warnings()[0]


def test_dynamic_is_the_quasi_static_record(session: Session) -> None:
    """The currents of the co-simulation are those of the polynomial, to rounding, in every position."""
    values = {**random_values(np.random.default_rng(6)), "points": 12}
    record = session.run(values)
    g = json.loads(json.dumps(load().with_values(values).reduce(record).site))["gravity / (m/s²)"]
    k = {n: values[f"accelerometer.{n}"] for n in KS}
    ideal = windows(k, {"a": 0.0, "b": 0.0}, g / 9.80665, 12)
    assert record.windows["mean"] == pytest.approx(ideal["mean"], abs=1e-15)  # A; 1 g is 1e-3


# -------------------------------------------------------------------------------------------- table effects
@pytest.mark.parametrize("what", ["sine", "cosine"])
def test_errors_of_the_head(session: Session, what: str) -> None:
    """Position errors e sin: y changes by -g k1 cos e sin = -g k1 e sin(2t)/2, so B2 = -g k1 e/2: k5 by -k1 e/g, k4 by
    +k1 e/g.  e cos: -g k1 e (1 + cos 2t)/2, so A0 = A2 = -g k1 e/2: k0 by -g k1 e, k2 by +k1 e/g.  The budget says it
    beforehand: independent errors of that rms.
    """
    e = 5.0 * ARCSEC
    t = 2.0 * math.pi * np.arange(24) / 24
    error = (e * (np.sin(t) if what == "sine" else np.cos(t))).tolist()
    good = {**FAST, **quiet(load()), "u_angle": e / math.sqrt(2.0)}
    before = load().with_values(good).reduce(session.run(good))
    values = {**good, "table.error": error}
    r = load().with_values(values).reduce(session.run(values))
    shift = {c.name: (c.estimate - c.truth) for c in r.coefficients}
    if what == "sine":
        expected = {"k5": -e / UG, "k4": e / UG, "k0": 0.0, "k2": 0.0, "k1": 0.0}
    else:
        expected = {"k0": -e / UG, "k2": e / UG, "k4": 0.0, "k5": 0.0, "k1": 0.0}
    for name, size in expected.items():
        assert shift[name] == pytest.approx(size, rel=0.01, abs=0.02), name
    budget = {b.coefficient: b.contribution for b in before.budget if b.source == "positions of the head"}
    # 4/N sum cos sin 2t of independent errors of rms e/sqrt 2: 4/N sqrt(N/4) e/sqrt 2; in one harmonic they add up
    assert budget["k5"] == pytest.approx(e / UG * math.sqrt(2.0 / 24), rel=0.01)


def test_tilt_of_the_axis_is_of_second_order(session: Session) -> None:
    """60 arcsec: k1 by -(tilt)2/2 = -4e-8 and k4, k5 times 3e-4; below 0.1 ug."""
    values = {**FAST, **quiet(load()), "points": 12, "table.tilt": [60.0 * ARCSEC, 60.0 * ARCSEC]}
    r = load().with_values(values).reduce(session.run(values))
    for c in r.coefficients[:6]:
        size = 1e6 if c.name == "k1" else 1.0
        assert abs(c.estimate - c.truth) * size < 0.1, c.name


# ------------------------------------------------------------------------------------------------- noise
def test_noise_of_the_parts(session: Session) -> None:
    """All noise on: within four u, u what the white density of 5 ug/sqrt(Hz) over 10 s makes of it (1.6 ug a visit)."""
    r = load().reduce(session.run({}, seed=3))
    for c in r.coefficients:
        assert abs(c.estimate - c.truth) < 4.0 * c.u, c.name
    assert r.residual_std == pytest.approx(5.0 / math.sqrt(10.0), rel=0.5)
    k0 = r.coefficients[0]
    assert k0.u == pytest.approx(math.sqrt(3 / 48) * 1.58, rel=0.5)
    assert len(r.summary) == 3 and "k0" in r.summary[0]


def test_readings_of_a_visit_are_one_datum(session: Session) -> None:
    values = {"points": 8, "readings": 5, "dwell": 5.0, "table.repeat": 2.0 * ARCSEC}
    record = session.run(values, seed=2)
    r = load().with_values(values).reduce(record)
    assert len(record.windows["mean"]) == 80 and r.dof == 16 - 8
    assert r.repeatability["scatter of the readings within a position / µg"] == pytest.approx(5.0, rel=0.5)
    assert r.residual_std > 2.0  # 10 ug at the horizontal points


# ---------------------------------------------------------------------------------------------- refusals
RUNS: list[tuple[list[str], list[str]]] = [
    (["points=3"], ["points = 3: must be >= 4"]),
    (["points=5"], ["5 positions a turn", "at least 7 [ACC-MINPTS]", "8, 12 or 24"]),
    (["points=6"], ["6 positions a turn"]),
    (["points=25"], ["points = 25: must be <= 24"]),
    (["points=4", "mounts=a"], ["4 positions of one mount, once", "turns=2"]),
    (["points=24", "turns=3"], ["the plan has 144 phases: 1 to 99"]),
    (["mounts=c"], ["mounts = c: must be a, b or both"]),
    (["dwell=0"], ["dwell = 0: must be > 0"]),
    (["gravity=9.8mA"], ["gravity: '9.8mA'", "units that fit"]),
    (["accelerometer.mount=[[1,0,0],[0,1,0],[0,0,-1]]"], ["accelerometer.mount", "determinant is -1"]),
    (["accelerometer.mount=[[0.9998,0,0.02],[0,1,0],[-0.02,0,0.9998]]"], ["accelerometer.mount", "not orthonormal"]),
    (["mounts=a", "accelerometer.mount=[[0.8,0,0.6],[0,1,0],[-0.6,0,0.8]]"], ["mount a: θ₀ = 36.87°", "mistake"]),
    (["table.base=[[1,0,0],[0,1,0],[0,0,1]]"], ["table.base", "90° from the horizon", "horizontal axis"]),
    (["accelerometer.k1=nan"], ["'nan': a finite number"]),
    (["accelerometer.scale=0"], ["scale", "must be > 0"]),
]  # fmt: skip


@pytest.mark.parametrize(("values", "words"), RUNS, ids=[" ".join(v) for v, _ in RUNS])
def test_run_is_refused(refused: Callable[..., None], values: list[str], words: list[str]) -> None:
    refused(NAME, values, words)


# ----------------------------------------------------------------------------------------- measured data
def laboratory(record: Record, template: str) -> str:
    """The record in deg and mA behind the template's own head."""
    w = record.windows
    rows = [
        f"{w['phase'][j] // 25 + 1},{w['t_start'][j]!r},{w['t_end'][j]!r},{math.degrees(w['angle_start'][j])!r},"
        f"{math.degrees(w['angle_end'][j])!r},{w['mean'][j] * 1e3!r},0,10,0"
        for j in range(len(w["mean"]))
    ]
    return template + "\n".join(rows).replace("np.float64(", "").replace(")", "") + "\n"


@pytest.mark.long
def test_measured_data(command: Command, session: Session, tmp_path: Path) -> None:
    """The co-simulation's record as a laboratory's file gives the coefficients put in; what is missing is asked for."""
    values = {**FAST, **quiet(load()), "gravity": 9.8067, "accelerometer.k2": 1e-4}
    record = session.run(values)
    code, template, _ = command("reduce", NAME, "--template")
    assert code == 0
    text = laboratory(record, template)
    file = tmp_path / "lab.csv"
    file.write_text(text, encoding="utf-8")
    code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    found = {c["name"]: c["estimate"] for c in result["coefficients"]}
    expected = {"k0": 50.0, "k1": 1.0, "k2": 100.0, "k3": 20.0, "k4": 20.0, "k5": 20.0, "θ₀ a": 0.0, "θ₀ b": 0.0}
    assert found == pytest.approx(expected, abs=1e-6) and not result["simulated"]
    for change, words in (
        (text.replace("# scale = 9806.65m/s2/A\n", ""), ["'scale' is not given", "--set scale="]),
        (text.replace("# gravity = 9.8067m/s2\n", ""), ["'gravity' is not given"]),
        (text.replace("# phase 2 = b\n", ""), ["phase 2: its attitude is not given"]),
        (text.replace("mean [mA]", "mean [mV]"), ["column 'mean': wrong unit [mV]"]),
        (text.replace("# scale = 9806.65m/s2/A", "# scale = 9806.65m/s2"), ["scale", "units that fit"]),
    ):
        file.write_text(change, encoding="utf-8")
        code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "no")
        assert code == 2 and out == "" and "Traceback" not in err, err
        for word in words:
            assert word in err, err


@pytest.mark.long
def test_another_table(command: Command, tmp_path: Path) -> None:
    """A free table in the place of the indexing head: same coefficients."""
    more = ("--set", "points=8", "--set", "dwell=1", "--part", "table=table_rate")
    code, _, err = command("run", NAME, *more, "--out", tmp_path / "run")
    assert code == 0, err
    result = json.loads((tmp_path / "run" / "result.json").read_text("utf-8"))
    for c in result["coefficients"]:
        assert abs(c["z"]) < 5.0, c["name"]
