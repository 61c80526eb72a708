"""Data sheets: every one is read, its figures become parameters by hand, drift_record returns its random walk."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from commanding import Command

import gyrobench as gb
from gyrobench.bench import Bench, UsageError, standard_folder
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from gyrobench.units import EARTH_RATE
from gyrobench.workflow.instruments import find_instrument, parameters, read_instrument, settings, with_instruments
from systems.north_finder.after import RandomErrors

ALL = sorted(Bench(standard_folder()).instruments())
TABLES = [n for n in ALL if find_instrument(n).kind == "turntable"]
SHEETS = [n for n in ALL if find_instrument(n).kind in ("fibre", "laser", "vibrating")]
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
FORCE = """
[accelerometers.velocity_random_walk]
value = "0.06 m/s/sqrt(h)"
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
def test_the_white_noise_of_a_sheet_is_that_of_its_part(name: str) -> None:
    sheet = find_instrument(name)
    assert parameters(sheet)[load_part(sheet.part).white_noise] == sheet.density


@pytest.mark.parametrize("name", ["adis16405", "gg1320", "kvh1750"])  # one of each part
@pytest.mark.long
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


@pytest.mark.long
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


def test_an_output_rate_is_the_period_where_samples_are_taken() -> None:
    """819.2 Hz: 1.2207 ms, in the test that takes each sample once; 8 kHz are hardly slower than steps of 0.1 ms."""
    for name, system, period in (
        ("adis16405", "gyro_bandwidth", 1.0 / 819.2), ("adis16405", "drift_record", None),
        ("mpu9250", "gyro_bandwidth", None), ("crg20", "gyro_bandwidth", None),
    ):  # fmt: skip
        _, values = with_instruments(name, {}, load_system(system))
        assert values.get("gyro.period") == period, (name, system)


def test_a_sheet_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("components", "systems", "reports", "instruments"):
        (tmp_path / room).mkdir()
    (tmp_path / "instruments" / "mine.toml").write_text(MINE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    title, values = with_instruments("mine", {})
    assert title == "Me Mine (own sheet, 2020), simulated"
    assert values == {"gyro.white": pytest.approx(0.01 * DEG / math.sqrt(2.0))}


@pytest.mark.long
def test_from_python() -> None:
    test = gb.load("drift_record", {"duration": "600s"}, instrument="adis16405")
    run = test.run(seed=1)
    assert run.record.run.parts["gyro"].name == "GyroMems"
    assert run.result.instrument.startswith("Analog Devices ADIS16405")
    shaken = gb.load("gyro_bandwidth", {"points": 8, "dwell": "0.2s"}, instrument="crg20").run()
    assert shaken.result.instrument.startswith("Silicon Sensing CRG20")
    turned = gb.load("imu_positions", {"positions": 6, "dwell": "10s", "turns": 0}).run()
    assert turned.result.instrument == "Imu 1.0.0, simulated"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (MINE.replace("0.01 deg/s/sqrt(Hz)", "0.01 deg/s"), "does not convert"),
        (MINE.replace("0.01 deg", "-0.01 deg"), "above 0"),
        (MINE.replace("noise_density", "noise"), "figures.noise: unknown"),
        (MINE.replace('"typical"', '"about"'), "reading"),
        (MINE.replace('maker = "Me"\n', ""), "maker"),
        (MINE.replace('part = "gyro_mems"\n', ""), "part: missing"),
        (MINE.replace('"vibrating"', '"turntable"').replace("noise_density", "wobble"), "a turntable names none"),
        (MINE + FORCE.replace("walk", "wander"), "accelerometers.velocity_random_wander: unknown"),
        (MINE + FORCE.replace("m/s/sqrt(h)", "m/s"), r"accelerometers.velocity_random_walk.*does not convert"),
        (MINE.replace("vibrating", "turntable").replace("noise_density", "wobble") + FORCE, "turntable has none"),
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
        with_instruments("adis16405", {"gyro": "floated_gyro"})
    file = tmp_path / "mine.toml"
    file.write_text(MINE.replace("gyro_mems", "floated_gyro"), encoding="utf-8")
    with pytest.raises(UsageError, match="takes no data sheets"):
        parameters(read_instrument(file))


def test_a_unit_of_three_gyros_by_hand() -> None:
    """BMI088: 0.014 deg/s/sqrt(Hz) one-sided, 1 deg/s, 0.015 deg/s/K, 1 %, 0.1 deg/s/g; STIM300: 1 mrad, 0.5 deg/h."""
    _, found = with_instruments("bmi088", {}, load_system("imu_positions"))
    assert found["imu.y_gyro"] == pytest.approx(0.014 * DEG / math.sqrt(2.0))
    assert found["imu.gyro_bias"] == pytest.approx([DEG] * 3)
    assert found["imu.gyro_bias_T"] == pytest.approx([0.015 * DEG] * 3)
    assert np.array(found["imu.gyro_scale"]) == pytest.approx(0.01 * np.eye(3))
    assert np.array(found["imu.g_sensitivity"]) == pytest.approx(0.1 * DEG * np.eye(3))  # rad/s of each g
    _, found = with_instruments("stim300", {}, load_system("sculling_test"))
    assert found["imu.gyro_scale"][0] == pytest.approx([0.0, 1e-3, 1e-3]) and found["bandwidth"] == 262.0
    # the largest Allan deviation of a Gauss-Markov process of this rms is the instability
    times = np.geomspace(10.0, 3000.0, 400)
    rms = RandomErrors(0.0, markov=found["imu.x_gyro_bias"], markov_tau=300.0)
    largest = max(math.sqrt(0.5 * rms.change(t, t)) for t in times)
    assert largest == pytest.approx(0.5 * DEG / 3600.0, rel=1e-3)
    _, found = with_instruments("adis16488", {}, load_system("attitude_estimator"))
    assert found["imu.noise_z_gyro"] == pytest.approx(0.3 * DEG / 60.0) and found["imu.noise_z_bias"] > 0.0


def test_the_accelerometers_of_a_unit_by_hand() -> None:
    """mpu9250: 300 ug/sqrt(Hz) one-sided, 2 g, 0.5 % of it, 2 %, 1.5 mg/K, 0.026 %/K, 260 Hz; 60 mg, 3 % are limits.
    STIM300: 0.06 m/s/sqrt(h), a least Allan deviation of 0.05 mg; HG1700: 0.065 ft/s/sqrt(h), 1 mg; HG9900: 25 ug.
    """
    g, system = 9.80665, load_system("drift_record")
    _, found = with_instruments("mpu9250", {"accelerometers": "accelerometer_mems"}, system)
    assert {n.partition(".")[0] for n in found} == {"accelerometers"}  # they stand in the place of the gyro
    assert found["accelerometers.white"] == pytest.approx(300e-6 * g / math.sqrt(2.0))
    assert found["accelerometers.range_max"] == pytest.approx(2.0 * g)
    assert found["accelerometers.cubic"] == pytest.approx(0.005 / 0.4 / (2.0 * g) ** 2)
    assert found["accelerometers.axes"][1] == [0.0, 1.0, 0.02] and found["accelerometers.bandwidth"] == 260.0
    assert not {"accelerometers.turn_on", "accelerometers.scale"} & set(found)
    assert found["accelerometers.x_flicker"] == found["accelerometers.x_walk"] == 0.0  # the sheet is the whole
    _, unit = with_instruments("mpu9250", {}, load_system("imu_positions"))
    assert unit["imu.acc_bias_T"] == pytest.approx([1.5e-3 * g] * 3)
    assert unit["imu.acc_scale_T"] == pytest.approx([260e-6] * 3)
    assert unit["imu.acc_scale"][2] == [0.02, 0.02, 0.0] and unit["imu.y_acc"] == found["accelerometers.white"]
    _, unit = with_instruments("stim300", {}, load_system("imu_positions"))
    assert unit["imu.z_acc"] == pytest.approx(0.06 / 60.0)
    assert unit["imu.x_acc_bias"] == pytest.approx(0.05e-3 * g / 0.6174)
    _, unit = with_instruments("hg1700", {}, load_system("imu_positions"))
    assert unit["imu.x_acc"] == pytest.approx(0.065 * 0.3048 / 60.0)
    assert unit["imu.acc_bias"][0] == pytest.approx(1e-3 * g)
    _, unit = with_instruments("hg9900", {}, load_system("imu_positions"))  # no noise on the sheet: that of the part
    assert "imu.x_acc" not in unit and np.array(unit["imu.acc_scale"]) == pytest.approx(1e-4 * np.eye(3))
    # with accelerometers of their own in a unit both are set; a sheet without any says so
    _, both = with_instruments("mpu9250", {"accelerometers": "accelerometer_mems"}, load_system("imu_positions"))
    assert {n.partition(".")[0] for n in both} == {"accelerometers", "imu"}
    with pytest.raises(UsageError, match="CRG20 states nothing of accelerometers"):
        with_instruments("crg20", {"accelerometers": "accelerometer_mems"}, load_system("drift_record"))


def test_a_rate_gyro_states_accelerometers_or_why_not() -> None:
    for name, file in Bench(standard_folder()).instruments().items():
        sheet = find_instrument(name)
        if sheet.kind in ("fibre", "laser", "vibrating") and not sheet.accelerometers:
            assert "\n# accelerometers: " in file.read_text(encoding="utf-8"), name


@pytest.mark.long
def test_accelerometers_of_a_sheet_drift_as_it_says(command: Command, tmp_path: Path) -> None:
    """STIM300, a minute: 0.06 m/s/sqrt(h) is in the interval, which is narrower than a fifth of it."""
    out = ["--set", "duration=60s", "--set", "window=0.1s", "--seed", "4", "--out", str(tmp_path / "r")]
    parts = ["--part", "accelerometers=accelerometer_mems", "--instrument", "stim300"]
    code, _, err = command("run", "drift_record", *parts, *out)
    assert code == 0, err
    found = json.loads((tmp_path / "r" / "result.json").read_text())["coefficients"]
    low, high = next(c for c in found if c["name"] == "N")["interval"]
    assert low < 0.06 < high < low + 0.012


def test_the_drift_of_a_platform() -> None:
    """ln200: 1 deg/h; STIM300: a limit of 250 deg/h; KVH 1750: no bias, but 0.05 deg/h, 0.012 deg/sqrt(h)."""
    dph = DEG / 3600.0
    for sheet, bias in (("ln200", 1.0), ("stim300", 250.0 / math.sqrt(3.0)), ("kvh1750", 0.05)):
        _, found = with_instruments(sheet, {}, load_system("platform_alignment"))
        assert found["gyro_drift"] == pytest.approx(bias * dph)
    test = load_system("platform_alignment").with_values(found)
    assert vars(test.sensors) | {"white": 0.0} == vars(test.sensors) | {"white": 0.0, "bias": 0.05 * dph}
    assert test.sensors.white == pytest.approx(0.012 * DEG / 60.0)


def test_a_system_without_gyros_names_the_tests_of_a_sheet() -> None:
    with pytest.raises(UsageError, match=r"gyro_bandwidth.*three gyros of a unit it goes into imu_positions"):
        with_instruments("crg20", {}, load_system("table_rate_test"))
    with pytest.raises(UsageError, match="floated gyro: imu_positions has no slot"):
        with_instruments("draper", {}, load_system("imu_positions"))


TABLE = """\
title = "Mine"
maker = "Me"
kind = "turntable"
source = "own sheet"
date = "2020"

[figures.height]
value = "1 m"
reading = "typical"
"""


def test_a_table_by_hand() -> None:
    """Fecker 352: 0.0001 deg, 10 deg/s, 5 lbf.ft, 1.5 lbf.ft/arcsec = 20738 g.cm/arcsec; limits of 0.5, 1, 0.5 arcsec.

    The inertia is that which keeps 13209 g.cm/arcsec at 2.56 kg.m2; the capture ends within torque / stiffness.
    """
    arcsec = DEG / 3600.0
    title, found = with_instruments("fecker352", {}, load_system("servo_polar"))
    assert title == "Fecker 352 (Hu 1981, tables 5-1 to 5-3, 1963 to 1964), simulated"
    stiffness = 20738.0 * 9.80665e-5 / arcsec
    assert found == {
        "table.quantum": pytest.approx(0.36 * arcsec),
        "table.rate_max": pytest.approx(10.0 * DEG),
        "table.torque_max": pytest.approx(5.0 * 1.3558179, rel=1e-7),
        "table.stiffness": pytest.approx(stiffness, rel=1e-4),
        "table.J": pytest.approx(2.56 * 20738.0 / 13209.0, rel=1e-3),
        "table.capture_angle": pytest.approx(5.0 * 1.3558179 / stiffness, rel=1e-4),
        "u_wobble": pytest.approx(0.5 * arcsec / math.sqrt(3.0)),
        "u_axis": pytest.approx(1.0 * arcsec / math.sqrt(3.0)),
        "u_angle1": pytest.approx(0.5 * arcsec / math.sqrt(3.0)),
    }
    assert with_instruments("fecker352", {}, load_system("table_servo_loop"))[1]["J"] == found["table.J"]


@pytest.mark.parametrize("name", TABLES)
def test_the_servo_with_the_stiffness_of_a_sheet_starts(name: str) -> None:
    """table_servo takes the parameters: a loop that were unstable, or captured nothing, is refused at the start."""
    values = with_instruments(name, {}, load_system("servo_polar"))[1]
    table = load_part("table_servo", standard_folder())()
    for key, value in values.items():
        slot, _, parameter = key.partition(".")
        if slot == "table":
            setattr(table, parameter, value)
    table.initialize()
    assert table.gain > 0.0


def test_the_gyro_of_the_table_of_sensitivities() -> None:
    """Table 5-5 follows from its coefficients: 0.1e-6 ERU/ug along I and S, 50e-6 ERU/g2 along I (ET19)."""
    found = with_instruments("draper", {})[1]
    assert found["gyro.D_I"] * 1e-6 == pytest.approx(0.1e-6 * EARTH_RATE)
    assert found["gyro.D_S"] == found["gyro.D_I"] and found["gyro.D_IS"] == pytest.approx(1e-3 * EARTH_RATE)
    assert found["gyro.D_II"] == found["gyro.D_SS"] == pytest.approx(50e-6 * EARTH_RATE)
    assert found["gyro.D_F"] == found["gyro.D_O"] == found["gyro.white"] == found["gyro.walk"] == 0.0
    assert found["gyro.markov"] == pytest.approx(1.5e-7 * DEG / 3600.0)
    assert found["gyro.D_T"] == pytest.approx(0.4e-3 * 1.8 * EARTH_RATE)  # per K, printed per degree Fahrenheit
    assert found["gyro.D_B"] == pytest.approx([40e-6 * EARTH_RATE / 1e-4] * 3)


def test_gyro_and_table_in_one_run() -> None:
    """A fast tumble returns the unbalances of the gyro's sheet; the report names both."""
    values = {"rate": "5deg/s", "dwell": 60.0, "windows": 24}
    test = gb.load("tumble_single_axis", values, instrument=["draper", "fecker352"])
    result = test.run(seed=1).result
    assert result.instrument.count("; Fecker 352 (") == 1 and result.instrument.startswith("Charles Stark Draper")
    found = {c.name: c for c in result.coefficients}
    assert found["D_S"].truth == pytest.approx(0.1 * EARTH_RATE / DEG * 3600.0)
    assert abs(found["D_S"].estimate - found["D_S"].truth) < 4.0 * found["D_S"].u < 0.1
    ids = {line.id.partition("[")[0] for line in result.budget}
    assert any(i.startswith("table.wobble") for i in ids) and any(i.startswith("table.axis.pole") for i in ids)


def test_tables_that_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(TABLE, encoding="utf-8")
    with pytest.raises(UsageError, match="no figure of it sets anything in servo_polar"):
        with_instruments(str(file), {}, load_system("servo_polar"))
    with pytest.raises(UsageError, match="attitude_estimator has no slot for one"):
        with_instruments("mit_e", {}, load_system("attitude_estimator"))
    with pytest.raises(UsageError, match="mit_e is a turntable too; name one"):
        with_instruments(["mit_e", "mit_a"], {}, load_system("servo_polar"))
    with pytest.raises(UsageError, match="not for a suite"):
        with_instruments("mit_e", {})
