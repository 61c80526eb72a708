"""Data sheets: every one is read, its figures become parameters by hand, drift_record returns its random walk."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.bench import Bench, UsageError, standard_folder
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from gyrobench.workflow.instruments import find_instrument, parameters, read_instrument, settings, with_instrument

SHEETS = sorted(Bench(standard_folder()).instruments())
DEG = math.pi / 180.0
PER_ROOT_HOUR = DEG / 60.0  # 1 deg/sqrt(h), rad/sqrt(s)
MINE = """\
title = "Mine"
maker = "Me"
kind = "vibrating"
part = "gyro_mems"
source = "own sheet"
date = "2020"

[figures.noise_density]
value = "0.01 deg/s/sqrt(Hz)"
reading = "typical"
"""


def test_there_are_some() -> None:
    assert len(SHEETS) >= 20
    for name in SHEETS:
        sheet = find_instrument(name)
        assert sheet.density is not None
        assert set(parameters(sheet)) <= set(load_part(sheet.part).declarations)


BOTH = [n for n in SHEETS if {"noise_density", "angle_random_walk"} <= set(find_instrument(n).figures)]


@pytest.mark.parametrize("name", BOTH)
def test_noise_density_and_random_walk_of_a_sheet_agree(name: str) -> None:
    """The density is one-sided: n / sqrt 2 is the random walk, within the rounding of the two figures."""
    sheet = find_instrument(name)
    density, walk = sheet.si("noise_density"), sheet.si("angle_random_walk")
    assert density is not None and walk is not None
    assert density / math.sqrt(2.0) == pytest.approx(walk, rel=0.08)


def test_the_figures_of_one_by_hand() -> None:
    """ADIS16405: 2 deg/sqrt(h), 0.007 deg/s, 3 deg/s, 0.1 % of 300 deg/s, 0.05 deg, 0.05 deg/s/g, 330 Hz."""
    found = parameters(find_instrument("adis16405"))
    assert found["white"] == pytest.approx(2.0 * PER_ROOT_HOUR)
    assert found["flicker_x"] == pytest.approx(0.007 * DEG / 0.6643, rel=1e-4)  # (2 ln 2/pi)^0.5 = 0.6643
    assert found["turn_on"] == pytest.approx(3.0 * DEG)
    assert found["cubic"] == pytest.approx(0.0025 / (300.0 * DEG) ** 2)
    assert found["g"][0] == pytest.approx([0.05 * DEG / 9.80665, 0.0, 0.0])
    assert found["axes"][0] == pytest.approx([1.0, 0.05 * DEG, 0.0])
    assert found["bandwidth"] == 330.0 and "period" not in found
    # the least-squares line through a cubic over +-R: by numpy on 2001 rates
    x = np.linspace(-300.0 * DEG, 300.0 * DEG, 2001)
    y = found["cubic"] * x**3
    assert np.max(np.abs(y - np.polyval(np.polyfit(x, y, 1), x))) == pytest.approx(1e-3 * 300.0 * DEG, rel=2e-3)


def test_limits_set_nothing() -> None:
    found = parameters(find_instrument("mpu6050"))  # bias 20 deg/s and scale 3 % are limits
    assert "turn_on" not in found and "scale" not in found
    assert found["range_max"] == pytest.approx(250.0 * DEG)


@pytest.mark.parametrize("name", SHEETS)
def test_drift_record_returns_the_random_walk(name: str) -> None:
    sheet = find_instrument(name)
    system = load_system("drift_record").with_values({"duration": 120.0, "window": 0.1, "settle": 1.0})
    with Session(system, {"gyro": sheet.part}) as session:
        record = session.run(dict(settings(sheet)), seed=3)
    result = system.with_values(record.run.options).reduce(record)
    n = next(c for c in result.coefficients if c.name == "N")
    assert sheet.density is not None
    expected = sheet.density / PER_ROOT_HOUR
    assert n.truth == pytest.approx(expected, rel=1e-9)
    assert n.interval[0] <= expected <= n.interval[1] or n.estimate == pytest.approx(expected, rel=0.05)


def test_rate_table_returns_the_nonlinearity_of_a_sheet() -> None:
    """ADIS16405: 0.1 % of 300 deg/s, as the table of departures has it; ten steps, noise off.

    Up to 280 deg/s, for the turn-on bias takes its part of the range; the departure goes with the square of it.
    """
    sheet = find_instrument("adis16405")
    values = {"full_scale": 280.0 * DEG, "steps": 10, "cycles": 1, "dwell": 0.5, "settle": 0.2}
    quiet = {"gyro.white": 0.0, "gyro.flicker_x": 0.0, "gyro.flicker_y": 0.0, "gyro.resolution": 0.0}
    system = load_system("rate_table_test").with_values(values)
    with Session(system, {"gyro": sheet.part}) as session:
        result = system.reduce(session.run({**values, **settings(sheet), **quiet}, seed=2))
    rows = next(t for t in result.tables if t.id == "rate.departures").rows
    assert max(abs(row[2]) for row in rows) == pytest.approx(1000.0 * (280.0 / 300.0) ** 2, rel=0.05)  # ppm


def test_the_vibrating_table_returns_the_bandwidth_of_a_sheet() -> None:
    """MTi-1: 255 Hz; noise of its density, drift off."""
    sheet = find_instrument("mti1")
    values = {"lowest": 20.0, "highest": 450.0, "points": 12, "dwell": 0.2, "settle": 0.1}
    system = load_system("gyro_bandwidth").with_values(values)
    quiet = {"gyro.flicker_x": 0.0, "gyro.flicker_y": 0.0}
    with Session(system, {"gyro": sheet.part}) as session:
        record = session.run({**values, **settings(sheet), **quiet}, seed=2)
    result = system.reduce(record)
    bandwidth = next(c for c in result.coefficients if c.name == "f_3dB")
    assert bandwidth.estimate == pytest.approx(255.0, rel=0.05)


def test_a_sheet_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("components", "systems", "reports", "instruments"):
        (tmp_path / room).mkdir()
    (tmp_path / "instruments" / "mine.toml").write_text(MINE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    title, values = with_instrument("mine", {})
    assert title == "Me Mine (own sheet, 2020), simulated"
    assert values == {"gyro.white": pytest.approx(0.01 * DEG / math.sqrt(2.0))}


def test_from_python() -> None:
    test = gb.load("drift_record", {"duration": "600s"}, instrument="adis16405")
    run = test.run(seed=1)
    assert run.record.run.parts["gyro"].name == "GyroMems"
    assert run.result.instrument.startswith("Analog Devices ADIS16405")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (MINE.replace("0.01 deg/s/sqrt(Hz)", "0.01 deg/s"), "does not convert"),
        (MINE.replace("0.01 deg", "-0.01 deg"), "above 0"),
        (MINE.replace("noise_density", "noise"), "figures.noise: unknown"),
        (MINE.replace('"typical"', '"about"'), "reading"),
        (MINE.replace('maker = "Me"\n', ""), "maker"),
    ],
)
def test_refused(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=said):
        read_instrument(file)


def test_refused_parts(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such data sheet; did you mean"):
        find_instrument("adis1640")
    with pytest.raises(UsageError, match="name no part for it"):
        with_instrument("adis16405", {"gyro": "floated_gyro"})
    file = tmp_path / "mine.toml"
    file.write_text(MINE.replace("gyro_mems", "floated_gyro"), encoding="utf-8")
    with pytest.raises(UsageError, match="takes no data sheets"):
        parameters(read_instrument(file))
