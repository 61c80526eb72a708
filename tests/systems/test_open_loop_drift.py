"""The open-loop test: recovery, the shift that is left predicted, range of the pickoff, refusals, laboratory files."""

from __future__ import annotations

import importlib
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from reducing import reduced_run as reduced

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import DataError
from gyrobench.record.record import Record
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "open_loop_drift"
DPH = math.pi / 648000.0
ARCSEC = math.pi / 648000.0
W = frames.EARTH_RATE
SHORT: dict[str, Any] = {"pairs": 5, "wait": 6.0, "dwell": 0.1}  # 66 s


QUIET = {n: 0.0 for n in load_system(NAME).noises}
R: Any = importlib.import_module(".reduction", type(load_system(NAME)).__module__)


@pytest.mark.parametrize("seed", range(5))
def test_random_gyros_and_attitudes(session: Session, seed: int) -> None:
    """The rate of a move is held over each step, so the float misses at most some a h^2 = 1e-9 rad of the whole track:
    1e-9 rad/66 s = 3e-6 deg/h.  The hand follows to 10 % of the drift: (omega_d' T/2) 0.2 deg/h < 3e-6 deg/h, T = 7 s.
    """
    rng = np.random.default_rng(seed)
    C, phi = frames.rotation(rng.normal(size=3), rng.uniform(0.0, 3.0)), rng.uniform(-1.4, 1.4)
    D = {n: float(rng.uniform(-1.0, 1.0) * DPH) for n in drift.terms(9)}
    values = {**SHORT, **QUIET, **{f"gyro.{n}": v for n, v in D.items()}, "latitude": phi, "gravity": 9.80665}
    expected = float(drift.drift(-C[:, 2], D))
    values |= {"attitude": json.dumps(C.tolist()), "follow": 0.9 * expected}
    (c,) = reduced(session, values).coefficients
    # 15 deg/h for 66 s turn the case by up to 1000 arcsec = 5e-3 rad: the drift at the mean attitude is another one
    assert c.truth == pytest.approx(expected / DPH, abs=0.03)
    assert c.estimate == pytest.approx(c.truth, abs=1e-5)
    assert c.closed == pytest.approx(c.estimate, abs=1e-3)


def test_drift_at_the_mean_attitude_by_hand(session: Session) -> None:
    """Input axis up, output east, gyro with D_O alone: turned by theta about up nothing changes; input axis north,
    output up: Y = -cos theta, the second order of 300 arcsec is 1e-6.
    """
    only = {f"gyro.{n}": 0.0 for n in drift.terms(9)} | {"gyro.D_O": 0.5 * DPH, "gravity": 9.80665}
    (c,) = reduced(session, {**SHORT, **QUIET, **only, "attitude": "U E"}).coefficients
    assert c.truth == pytest.approx(0.0, abs=1e-9) and c.estimate == pytest.approx(0.0, abs=1e-5)
    (c,) = reduced(session, {**SHORT, **QUIET, **only, "attitude": "N U", "follow": -0.5 * DPH}).coefficients
    assert c.truth == pytest.approx(-0.5, abs=3e-6) and c.estimate == pytest.approx(-0.5, abs=1e-5)


def test_what_is_left_is_predicted(session: Session) -> None:
    """Input axis east, output up, spin south, hand still: turned by theta, (Y, Z) = (-cos, sin) theta, so omega_d' =
    D_S - D_OS = -0.68 deg/h.  With steps every T = 61 s + move the shift is (omega_d' T/2)(omega_d - follow); omega_d
    = D_F - D_O + 0 = -0.4 deg/h.  A hand that follows leaves none.
    """
    values = {**SHORT, **QUIET, "wait": 60.0, "gravity": 9.80665}
    (c,) = reduced(session, values).coefficients
    T = 61.0
    assert c.estimate - c.truth == pytest.approx(-0.68 * DPH * T / 2.0 * -0.4, rel=0.1)
    (c,) = reduced(session, {**values, "follow": -0.4 * DPH}).coefficients
    assert c.estimate == pytest.approx(c.truth, abs=1e-6)


def test_spin_axis_coupling_is_allowed_for(session: Session) -> None:
    """Input axis up, output east: W cos phi = 10.5 deg/h along the spin axis.  A hand that lags runs the float off by
    some 0.5 deg/h 33 s = 17 arcsec, worth 9e-4 deg/h, which a wrong H/C (0.5 for 1) leaves half in.
    """
    values = {**SHORT, **QUIET, "attitude": "U E"}
    right, wrong = (reduced(session, {**values, **f}).coefficients[0] for f in ({}, {"float_gain": 0.5}))
    assert right.estimate == pytest.approx(right.truth, abs=1e-5)
    assert abs(wrong.estimate - wrong.truth) > 2e-4
    lines = {b.source: b.contribution for b in reduced(session, {**values, "u_float_gain": 0.5}).budget}
    assert lines["float gain H/C"] == pytest.approx(abs(wrong.estimate - right.estimate), rel=0.05)


@pytest.mark.long
def test_with_noise(session: Session) -> None:
    """An hour with the standard noise, four seeds: z of rms about 1, the gain within 1 %, the range in the summary."""
    results = [reduced(session, {"dwell": 1.0}, seed) for seed in range(4)]
    z = [r.coefficients[0].z for r in results]
    assert 0.2 < float(np.sqrt(np.mean(np.square(z)))) < 2.0, z
    for r in results:
        rows = {row[0]: row[1] for t in r.tables if t.title == "From angle to drift" for row in t.rows}
        assert rows["gain of the pickoff G"] == pytest.approx(10.0, rel=0.01)  # K_sg H/C
        assert rows["case angle at saturation"] == pytest.approx(0.01 / ARCSEC, rel=1e-9)  # u_max C/(K_sg H)
        assert "Range of the pickoff used" in r.summary[1] and "2063″ to saturation" in r.summary[1]


def test_budget_by_hand(session: Session) -> None:
    """Input axis up: latitude by W cos phi; the angle over the time between first and last reading."""
    eps, phi = 1e-4, math.radians(40.0)
    values = {**SHORT, **QUIET, "attitude": "U E", "latitude": phi, "u_latitude": eps, "u_angle": ARCSEC}
    result = reduced(session, values)
    lines = {b.source: b.contribution for b in result.budget}
    span = next(r[1] for r in result.tables[-1].rows if r[0] == "time between them")
    assert lines["latitude"] == pytest.approx(W * math.cos(phi) / DPH * eps, rel=1e-3)
    assert lines["angle between first and last reading"] == pytest.approx(1.0 / span, rel=1e-2)  # 1 arcsec/s = 1 deg/h


def test_signs_of_attitude_and_latitude(session: Session) -> None:
    """Input axis up, output axis east, a gyro without g terms.  Turned about its output axis the input axis gains -N: W
    cos phi eps less of the Earth rate, taken for drift.  A latitude stated too large: W cos phi eps too much of it.
    """
    eps, phi = 1e-4, math.radians(40.0)
    values = {**SHORT, **QUIET, **{f"gyro.{n}": 0.0 for n in drift.terms(9)}, "attitude": "U E", "latitude": phi}
    values |= {"u_latitude": eps, "u_attitude": eps}
    record = session.run(values)
    plain = load_system(NAME).reduce(record)
    stated = load_system(NAME).reduce(
        Record(record.windows, {}, record.run.replace(options={**record.run.options, "latitude": phi + eps}))
    )
    turned = reduced(session, {**values, "gyro.mount": frames.rotation([0.0, 1.0, 0.0], eps).T.tolist()})
    size = W * math.cos(phi) / DPH * eps
    for other, source in ((stated, "latitude"), (turned, "gyro turned about its output axis")):
        line = next(b for b in plain.budget if b.source == source)
        assert line.sensitivity * eps == pytest.approx(size, rel=1e-3)
        assert other.coefficients[0].estimate - plain.coefficients[0].estimate == pytest.approx(size, rel=2e-2)


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"bracket": "35arcmin"}, "the pickoff saturates at 34.38'"), ({"bracket": 0.0}, "bracket = 0"),
        ({"attitude": "E E"}, "must be at right angles"), ({"gravity": 8.0}, "gravity 8 m/s²"),
        ({"dwell": 0.004}, "more than four steps"), ({"gyro.mount": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "determinant"),
    ],
)  # fmt: skip
def test_refused_before_running(session: Session, values: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=re.escape(said)):
        session.run({**SHORT, **values})


def test_out_of_range(session: Session) -> None:
    """A drift of 100 deg/h runs the float 34 arcmin off in 20 s: flagged."""
    record = session.run({**SHORT, **QUIET, "gyro.D_F": 100.0 * DPH})
    with pytest.raises(ValueError, match="flagged windows"):
        load_system(NAME).reduce(record)


def test_turning_sky_warns(session: Session) -> None:
    result = reduced(session, {**SHORT, **QUIET, "wait": 60.0, "attitude": "P E"})
    assert any("as it followed the sky" in w for w in result.warnings)
    assert not any("sky" in w for w in reduced(session, {**SHORT, **QUIET}).warnings)


def readings(**changes: Any) -> dict[str, np.ndarray]:
    t = 10.0 * np.arange(11)
    angle = np.where(np.arange(11) % 2, -1e-4, 1e-4)
    u = 10.0 * (angle + 2e-7 * t)
    return {"t_start": t, "t_end": t + 1.0, "angle_start": angle, "angle_end": angle, "mean": u, **changes}


def test_refused_records() -> None:
    setup = R.OpenLoopSetup(latitude=0.0, gravity=9.8)
    assert R.Reduction.reduce(readings(), setup).coefficients[0].estimate == pytest.approx(-2e-7 / DPH, abs=1e-6)
    for w, said in (
        (readings(mean=-readings()["mean"]), "must be positive"),
        (readings(angle_start=np.zeros(11), angle_end=np.zeros(11)), "never stood over and under the null"),
        ({k: v[:8] for k, v in readings().items()}, "8 readings: at least 9"),
        (readings(mean=np.full(11, np.inf)), "non-finite"),
    ):
        with pytest.raises(ReductionError, match=said):
            R.Reduction.reduce(w, setup)


# ------------------------------------------------------------------------------------------ laboratory files
@pytest.mark.long
def test_laboratory_file(session: Session, tmp_path: Path, command: Command) -> None:
    record = session.run({**SHORT, "latitude": 0.5}, seed=3)
    expected = load_system(NAME).reduce(record).coefficients[0]
    code, template, err = command("reduce", NAME, "--template")
    assert code == 0, err
    w = {n: v.tolist() for n, v in record.windows.items()}
    rows = [
        f"{a!r},{b!r},{math.degrees(x)!r},{u * 1e3!r}"
        for a, b, x, u in zip(w["t_start"], w["t_end"], w["angle_start"], w["mean"], strict=True)
    ]
    text = template.replace("latitude = 45.75deg", "latitude = 0.5rad") + "\n".join(rows) + "\n"
    (tmp_path / "lab.csv").write_text(text, encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert result["coefficients"][0]["truth"] is None and result["simulated"] is False
    assert result["coefficients"][0]["estimate"] == pytest.approx(expected.estimate, abs=2e-3)  # time of moves unknown
    (tmp_path / "bad.csv").write_text(text.replace("# attitude = E U -N\n", ""), encoding="utf-8")
    with pytest.raises(DataError, match="'attitude' is not given"):
        load_system(NAME).read_measured(tmp_path / "bad.csv", {})


def test_hand_that_nulls(tmp_path: Path) -> None:
    """No column u: the angle alone counts; input axis up at the pole, the whole Earth's rate."""
    rows = "\n".join(f"{10 * n},{10 * n + 1},{(0.4 - 15.041068732) / 360 * n!r}" for n in range(11))
    text = f"# latitude = 90deg\n# attitude = U E\nt_start [s],t_end [s],angle [arcmin]\n{rows}\n"
    (tmp_path / "hand.csv").write_text(text, encoding="utf-8")
    result = load_system(NAME).reduce(load_system(NAME).read_measured(tmp_path / "hand.csv", {}))
    # n steps of (rate / 360) arcmin in 10 s: rate / 360 * 60 arcsec / 10 s = rate / 60 arcsec/s
    assert result.coefficients[0].estimate == pytest.approx((0.4 - 15.041068732) / 60.0 + 15.041068732, abs=1e-6)
