"""Vertical and level servo tests, dynamic co-simulation: recovery, combinations, limits, measured data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from servoing import DPH, QUIET, errors, expected_rate, gyro, held, latitude

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "servo_vertical_level"
SHORT: dict[str, Any] = {"dwell": 60.0, "settle": 2.0, "cycles": 1}
ARCSEC = math.pi / 648000.0


@pytest.mark.parametrize("seed", range(4))
def test_random_gyros_at_random_latitudes(session: Session, seed: int) -> None:
    """Every window reads the equation with J/H alpha_O (5e-7 deg/h) in it.  The coefficients are off by that and by
    what D_IO, D_OS, D_IS leave by the sine of the angle, at most 0.2 degrees here.
    """
    rng = np.random.default_rng(seed)
    values = {**SHORT, **QUIET, **gyro(rng), "latitude": latitude(rng)}
    record = session.run(values)
    windows, _ = held(record)
    assert np.max(np.abs(windows.rate - expected_rate(record))) < 2e-9 * DPH
    result = load_system(NAME).reduce(record)
    worst = float(np.max(np.abs(windows.angle_end[windows.axes[:, 0, 2] ** 2 < 0.5])))
    cross = sum(abs(values[f"gyro.{n}"]) for n in ("D_IO", "D_OS", "D_IS")) / DPH
    for name, error in errors(result, values).items():
        assert abs(error) < 2.0 * cross * worst + 2e-6, name
    exact = load_system(NAME).reduce(session.run({**values, "gyro.D_OS": 0.0, "gyro.D_IO": 0.0, "gyro.D_IS": 0.0}))
    for name, error in errors(exact, values).items():
        assert abs(error) < 2e-6, name  # two rates, each 5e-7 off, over two
    assert [c.name for c in exact.coefficients] == ["D_F", "D_I", "D_S", "D_O", "D_II", "D_SS"]


def test_vertical_alone_to_a_millionth(session: Session) -> None:
    """Class 1 sees no angle: D_F + g2 D_II and D_I, off by J/H alpha_O alone, as worked out in servoing."""
    rng = np.random.default_rng(9)
    values = {**SHORT, **QUIET, **gyro(rng), "latitude": latitude(rng), "attitudes": "vertical"}
    record = session.run(values)
    result = load_system(NAME).reduce(record)
    windows, _ = held(record)
    phi = values["latitude"]
    along = -windows.axes[:, 2] @ frames.earth_rate_local(phi) * 1e-3  # -(J/H) omega_E,z at angles of arcminutes
    left = -(windows.rate * along) / DPH
    half = (left[0] + left[-1]) / 2.0, (left[0] - left[-1]) / 2.0
    g = frames.normal_gravity(phi) / frames.G0
    assert result.coefficients[0].name == "D_F + γ² D_II"
    for c, off in zip(result.coefficients, (half[0], half[1] / g), strict=True):
        assert c.estimate - c.truth == pytest.approx(off, abs=5e-9) and abs(off) < 1e-6
        assert c.closed == pytest.approx(c.estimate, abs=1e-8)


def test_three_term_route_says_what_it_holds(session: Session) -> None:
    """D_F + g2 D_II, D_I, D_S - g D_II + g D_SS: in the names of Hu 1981 R + g2 K_zx, U_z, U_x + g (K_zx + K_xz)."""
    result = load_system(NAME).reduce(session.run({**SHORT, **QUIET, "attitudes": "three", "gyro.D_O": 0.0}))
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    truth = {"D_F + γ² D_II": -0.3 - 0.05 * g * g, "D_I": -0.9, "D_S − γ D_II + γ D_SS": -0.7 + (0.05 + 0.04) * g}
    assert [c.name for c in result.coefficients] == list(truth)
    for c in result.coefficients:
        assert c.truth == pytest.approx(truth[c.name], rel=1e-9)
        assert c.estimate == pytest.approx(c.truth, abs=1e-5) and c.closed == pytest.approx(c.truth, abs=1e-5)
    book = next(t for t in result.tables if t.title == "Notation of Hu 1981").rows
    assert [row[0] for row in book] == ["R + γ² K_zx", "U_z", "U_x + γ K_zx + γ K_xz"]
    assert book[0][1] == pytest.approx(0.3 + 0.05 * g * g, abs=1e-5)
    assert any("tell only combinations" in w for w in result.warnings)


def test_all_eighteen_attitudes(session: Session) -> None:
    """Every azimuth gives the same coefficients; the Earth turns the table both ways through level."""
    record = session.run({**SHORT, **QUIET, "attitudes": "all", "dwell": 100.0, "windows": 5})
    windows, _ = held(record)
    assert (
        np.max(np.abs(windows.rate - expected_rate(record))) < 1e-8 * DPH
    )  # uneven turn, 1e-3 of the rate in a window
    north = [r.phase for r in record.run.plan if r.label == "x north, y up"]
    mine = np.isin(record.windows["phase"], north)
    first, last = record.windows["angle_start"][mine][0], record.windows["angle_end"][mine][-1]
    assert first > 0.0 > last and abs(first + last) < 0.1 * abs(first)
    result = load_system(NAME).reduce(record)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(c.truth, abs=1e-4), c.name
    table = next(t for t in result.tables if t.title == "Drift in each attitude")
    assert len(table.rows) == 18


@pytest.mark.long
def test_noise_and_composite(session: Session) -> None:
    """Truth within four u; ten windows a dwell give composite statistics of every phase."""
    values = {"dwell": 300.0, "windows": 10, "table.quantum": 0.18 * ARCSEC, "gyro.markov_tau": 30.0}
    result = load_system(NAME).reduce(session.run(values, seed=5))
    for c in result.coefficients:
        assert c.z is not None and abs(c.z) < 4.0 and c.u > 1e-4, c.name
    table = next(t for t in result.tables if t.title == "Systematic and random drift rate")
    assert len(table.rows) == 12 and all(row[1] == 10 and row[2] == 30.0 for row in table.rows)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"attitudes": "x north, y up", "dwell": 700.0}, "x north, y up: the Earth turns the table by 2.* allows 68"),
        ({"attitudes": "x down; x sideways"}, "attitude x sideways: there are x down; x up"),
        ({"attitudes": "polar S"}, "attitude polar S"),
        ({"attitudes": ";"}, "attitude none"),
        ({"attitudes": "all", "cycles": 2}, "72 phases, two for each attitude: the stand knows 49"),
        ({"table.index_rate": 0.1}, "index more slowly"),
        ({"gyro.mount[1,1]": 0.5}, "gyro.mount: rows are not orthonormal"),
    ],
)
def test_refused_before_anything_runs(session: Session, values: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=text):
        session.run(values)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        # 30 + 0.3 deg/h (D_O = 0.1: y up is Y = -1, 29.9) for 610 s: 5.07 deg; 2 deg / 29.9 deg/h = 241 s
        ({"gyro.D_F": "30deg/h"}, "x east, y up: the Earth and the drift turn the table by 5.07° .* allows 241 s"),
        # 2 * 1.2 * 301 deg/h / (50 rad/s) = 14.4 arcsec
        ({"gyro.D_F": "300deg/h", "dwell": 5.0}, "would not capture the gyro: a drift of 301 °/h .* keep it 14.4″"),
    ],
)
def test_drift_that_ends_the_plan_is_foreseen(session: Session, values: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=text):
        session.run({**SHORT, "dwell": 600.0, "settle": 10.0, **values})


@pytest.mark.long
def test_ordinary_gyro_of_ten_degrees_an_hour(session: Session) -> None:
    """The loop closes above capture_slow; dwells start on the other side of level by what the drift turns the table,
    10 deg/h 305 s = 0.85 deg.  D_OS comes in by the sine of that, at most 0.02 0.015 = 3e-4 deg/h at the ends, and is
    taken for slow noise.
    """
    values = {**QUIET, "cycles": 1, "gyro.D_F": "10deg/h"}
    record = session.run(values)
    windows, _ = held(record)
    level = windows.axes[:, 0, 2] ** 2 < 0.5
    ends = np.concatenate([windows.angle_start, windows.angle_end])[np.tile(level, 2)]
    assert abs(np.max(ends) + np.min(ends)) < math.radians(0.02) and 0.8 < math.degrees(np.max(ends)) < 0.91
    for c in load_system(NAME).reduce(record).coefficients:
        assert abs(c.estimate - c.truth) < 6e-4, c.name
    exact = session.run({**values, "gyro.D_OS": 0.0, "gyro.D_IO": 0.0, "gyro.D_IS": 0.0})
    for c in load_system(NAME).reduce(exact).coefficients:
        assert abs(c.estimate - c.truth) < 2e-6, c.name


def test_beyond_a_degree_is_refused(session: Session) -> None:
    record = session.run({**SHORT, **QUIET})
    phase = next(r.phase for r in record.run.plan if r.label == "x east, z up")
    mine = record.windows["phase"] == phase
    windows = {k: v.copy() for k, v in record.windows.items()}
    for c in ("angle_start", "angle_end"):
        windows[c][mine] += math.radians(1.2)
    with pytest.raises(ReductionError, match=r"\(x east, z up\) reaches 1.2.* 1° is the limit"):
        load_system(NAME).reduce(type(record)(windows, {}, record.run))


def test_told_of_another_gyro(session: Session) -> None:
    """Parameters of the gyro that the user sets are told to the table's loop."""
    record = session.run({**SHORT, **QUIET, "attitudes": "vertical", "gyro.H": 0.25, "gyro.K_sg": 8.0})
    assert record.run.parameters["table.H_g"] == 0.25 and record.run.parameters["table.K_g"] == 8.0
    assert np.max(np.abs(held(record)[0].rate - expected_rate(record))) < 2e-9 * DPH


def test_laboratory_file(tmp_path: Any, session: Session) -> None:
    """The template, filled with a three-term record in degrees and minutes, gives the same coefficients."""
    record = session.run({**SHORT, "attitudes": "three"}, seed=2)
    system = load_system(NAME)
    lines = system.measured_data.template.splitlines()
    header = lines.pop().replace("angle_end [deg]", "angle_end [arcmin]")
    windows, rows = held(record)
    number = (record.windows["phase"][rows] // 2).tolist()
    body = [
        f"{p},{a!r},{b!r},{math.degrees(c)!r},{math.degrees(d) * 60.0!r}"
        for p, a, b, c, d in zip(
            number, windows.t_start.tolist(), windows.t_end.tolist(), windows.angle_start.tolist(),
            windows.angle_end.tolist(), strict=True,
        )
    ]  # fmt: skip
    file = tmp_path / "three.csv"
    text = "\n".join([*lines, header, *body, ""])
    file.write_text(text.replace("9.8067m/s2", f"{frames.normal_gravity(math.radians(45.75))!r}m/s2"), encoding="utf-8")
    again = system.reduce(system.read_measured(file, {}))
    for a, b in zip(again.coefficients, load_system(NAME).reduce(record).coefficients, strict=True):
        assert a.estimate == pytest.approx(b.estimate, rel=1e-9) and a.name == b.name and a.truth is None
    file.write_text(text.replace("# latitude = 45.75deg\n", ""), encoding="utf-8")
    with pytest.raises(Exception, match="'latitude' is not given"):
        load_system(NAME).read_measured(file, {})
