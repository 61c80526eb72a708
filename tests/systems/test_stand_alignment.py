"""Alignment of a stand: the place of Polaris against ERFA, recovery, intervals, effects of the set-up, hand-over."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tumbling

import gyrobench as gb
from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "stand_alignment"
PACKAGE = type(load_system(NAME)).__module__
polaris: Any = importlib.import_module(".polaris", PACKAGE)
R: Any = importlib.import_module(".reduction", PACKAGE)
ARCSEC, DEG = math.pi / 648000.0, math.pi / 180.0
FITTED = ("about east", "about p × east", "collimation", "trunnion", "circle zero", "inclinometer zero")
LAT, LONG = 45.75 * DEG, 126.63 * DEG


# ------------------------------------------------------------------------------------------------ the star
@pytest.mark.parametrize(
    ("date", "ra", "declination", "azimuth", "altitude"),
    [
        ("2020-06-15T22:00", 43.953278, 89.3447047, 0.642313, 46.229914),
        ("2026-11-28T12:00", 47.272112, 89.3791230, 0.492365, 46.268258),
        ("2031-01-10T05:30", 48.952381, 89.3955931, 0.866174, 45.743895),
    ],
)
def test_place_of_polaris(date: str, ra: float, declination: float, azimuth: float, altitude: float) -> None:
    """Apparent place, and azimuth and altitude without air at 45.75 deg, 126.63 deg, by ERFA 2.0.1 (atci13, atco13)
    from the same catalogue place: the star's azimuth to 0.03 arcsec."""
    jd = polaris.julian(date)
    found = polaris.apparent(jd)
    assert (found[0] / DEG - ra) * 3600.0 * math.cos(declination * DEG) == pytest.approx(0.0, abs=0.03)
    assert (found[1] / DEG - declination) * 3600.0 == pytest.approx(0.0, abs=0.03)
    H, de = polaris.hour_angle(jd, LONG)
    A, h = polaris.azimuth(np.array([H]), de, LAT)
    assert (A[0] / DEG - azimuth) * 3600.0 == pytest.approx(0.0, abs=0.03)
    assert (h[0] / DEG - altitude) * 3600.0 == pytest.approx(0.0, abs=0.05)


def test_refraction_and_dates() -> None:
    """Meeus 1998, example 16: 0.5541 deg above the horizon is raised by 24.6 arcmin (eq. 16.4, 10 degC, 1010 hPa)."""
    assert polaris.refraction(np.array([0.5541 * DEG]), 101000.0, 283.0)[0] / DEG * 60.0 == pytest.approx(
        24.618, abs=0.01
    )
    assert polaris.julian("2000-01-01T12:00") == 2451545.0
    assert polaris.julian("2000-01-01T20:00+08:00") == 2451545.0


def test_the_axis_is_turned_off_the_pole() -> None:
    """Elevation phi + e and azimuth a/cos phi are the pole turned by e about east and a about p x east."""
    phi, e, a = 0.8, 3e-5, -4e-5
    east, pole = np.array([1.0, 0.0, 0.0]), frames.pole(phi)
    turned = pole + np.cross(e * east + a * np.cross(pole, east), pole)
    azimuth, elevation = a / math.cos(phi), phi + e
    seen = np.array(
        [math.cos(elevation) * math.sin(azimuth), math.cos(elevation) * math.cos(azimuth), math.sin(elevation)]
    )
    assert seen == pytest.approx(turned, abs=5e-9)


# ------------------------------------------------------------------------------------------------ recovery
def drawn(rng: np.random.Generator) -> dict[str, Any]:
    def size(x: float) -> float:
        return float(rng.uniform(-x, x) * ARCSEC)

    year, month, day, hour = (int(rng.integers(*limits)) for limits in ((20, 35), (1, 13), (1, 28), (0, 24)))
    return {
        "latitude": math.radians(rng.uniform(12.0, 70.0)), "longitude": float(rng.uniform(-3.0, 3.0)),
        "start": f"20{year}-{month:02d}-{day:02d}T{hour:02d}:00",
        "theodolite.azimuth": size(60.0), "theodolite.elevation": size(30.0), "theodolite.collimation": size(20.0),
        "theodolite.trunnion": size(20.0), "theodolite.circle_zero": float(rng.uniform(-1.0, 1.0)),
        "theodolite.lean": [size(10.0), size(10.0)], "theodolite.level_zero": size(20.0),
        "theodolite.inclinometer_zero": size(60.0),
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_without_noise_the_axis_comes_back(session: Session, seed: int) -> None:
    """What is left are products of collimation, trunnion and lean, and the star's curve within a sight."""
    values = {**drawn(np.random.default_rng(seed)), **dict.fromkeys(session.system.noises, 0.0)}
    found = session.system.with_values(values).reduce(session.run(values, seed=1))
    for name in FITTED:
        c = found[name]
        assert c.truth is not None
        assert c.estimate == pytest.approx(c.truth, abs=0.01 if c.unit == "″" else 0.01 / 3600.0), name


def test_with_noise(session: Session) -> None:
    found = session.system.reduce(session.run({"theodolite.azimuth": 2e-4, "theodolite.elevation": -5e-5}, seed=3))
    assert all(c.z is not None and abs(c.z) < 3.5 for c in found.coefficients)
    assert 0.03 < found["about p × east"].u < 0.2 and 0.03 < found["about east"].u < 0.2


@pytest.mark.long
def test_intervals_cover() -> None:
    """400 records of the equations alone (no part): lean exactly as a rotation, star from the hour angle."""
    rng, held, runs = np.random.default_rng(8), 0, 400
    code = np.tile([2.0, 1.0, -1.0, -2.0, 3.0, -3.0], 4)
    t = 80.0 * np.arange(code.size) + 60.0
    jd = polaris.julian("2026-11-28T12:00")
    setup = R.AlignmentSetup(latitude=LAT, longitude=LONG, jd=jd)
    H0, de = polaris.hour_angle(jd, LONG)
    A, h = polaris.azimuth(H0 + frames.EARTH_RATE * (t + 10.0), de, LAT)
    h = h + polaris.refraction(h)
    for _ in range(runs):
        e, a, c, i, o, z, zl, le, ln = rng.normal(size=9) * 20.0 * ARCSEC
        star, mirror, f = np.abs(code) == 1, np.abs(code) == 2, np.sign(code)
        A_s, h_s = np.where(star, A, a / math.cos(LAT)), np.where(star, h, 0.0)
        v = ln * np.cos(A_s) + le * np.sin(A_s)
        y = A_s - v * np.tan(h_s) - o + f * (c / np.cos(h_s) + i * np.tan(h_s))
        y = np.where(star | mirror, y, LAT + e + f * z) + rng.normal(size=code.size) * 0.3 * ARCSEC
        windows = {"phase": np.arange(1, code.size + 1), "t_start": t, "t_end": t + 20.0, "angle_start": code,
                   "angle_end": code, "mean": y, "level": f * v + zl}  # fmt: skip
        found = R.Reduction.reduce(windows, setup)
        true = (e / ARCSEC, a / ARCSEC, c / ARCSEC, i / ARCSEC, o / DEG, z / ARCSEC)
        held += sum(found[n].interval[0] <= x <= found[n].interval[1] for n, x in zip(FITTED, true, strict=True))
    assert held / (6 * runs) == pytest.approx(0.95, abs=0.02)


# ------------------------------------------------------------------------------------------------ set-up
def shifted(record: Record, **options: Any) -> dict[str, float]:
    """Estimates of a record that is reduced with other beliefs."""
    run = record.run.replace(options={**record.run.options, **options})
    found = load_system(NAME).reduce(Record(record.windows, record.channels, run))
    return {c.name: c.estimate for c in found.coefficients}


def test_effects_of_the_set_up(session: Session) -> None:
    """What the budget says one unit does is what a wrong belief of that size does: clock, latitude, mirror, circle."""
    values = {**dict.fromkeys(session.system.noises, 0.0), "theodolite.lean": [5e-5, -3e-5], "u_time": 1.0,
              "u_latitude": "1arcsec", "u_mirror": "1arcsec", "u_inclinometer": "1arcsec", "u_circle": "1arcsec",
              "theodolite.pointing": 1e-9}  # fmt: skip
    record = session.run(values, seed=1)
    budget = session.system.with_values(values).reduce(record).budget
    per = dict.fromkeys(((s, n) for s in ("clock", "latitude") for n in FITTED), 0.0)
    per |= {(b.source, b.coefficient): b.sensitivity for b in budget}
    plain, names = shifted(record), FITTED[:4]
    fast = shifted(record, start="2026-11-28T12:00:10")  # a clock 10 s fast
    south = shifted(record, latitude=LAT + 10.0 * ARCSEC)
    for name in names:
        assert fast[name] - plain[name] == pytest.approx(10.0 * per["clock", name], rel=0.02, abs=2e-3), name
        assert south[name] - plain[name] == pytest.approx(10.0 * ARCSEC * per["latitude", name], rel=0.02, abs=2e-3)
    assert per["latitude", "about east"] * ARCSEC == pytest.approx(-1.0)
    assert per["mirror against the axis", "about p × east"] * ARCSEC == pytest.approx(math.cos(LAT))
    assert per["inclinometer", "about east"] * ARCSEC == pytest.approx(1.0)
    wrong = session.run({**values, "theodolite.eccentricity": 10.0 * ARCSEC}, seed=1)
    other = {c.name: c.estimate for c in session.system.reduce(wrong).coefficients}
    # the circle errs by sin R at mirror and star alike, 0.3 rad from its zero: they are 0.5 deg apart
    assert other["about p × east"] - plain["about p × east"] == pytest.approx(0.0, abs=0.1)


def test_a_theodolite_out_of_adjustment_is_named(session: Session) -> None:
    """Collimation of 3 arcmin: its square is 0.16 arcsec, more than u."""
    found = session.system.reduce(session.run({"theodolite.collimation": 180.0 * ARCSEC}, seed=1))
    (reason,) = [r for r in found.reasons if r.id == "theodolite.large_errors"]
    assert "collimation 180″" in reason.text and "0.16″" in reason.text
    assert not [r for r in session.system.reduce(session.run({}, seed=1)).reasons if r.id == "theodolite.large_errors"]


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"latitude": "5deg"}, "Polaris stands too low"),
        ({"latitude": "-40deg"}, "Polaris stands too low"),
        ({"start": "28.11.2026"}, "write it as 2026-11-28T12:00"),
    ],
)
def test_refusals(values: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=text):
        load_system(NAME).with_values(values).refuse()


def test_records_that_are_not_of_this_test() -> None:
    code = np.array([2.0, 1.0, -1.0, -2.0, 3.0, -3.0] * 2)
    t = 80.0 * np.arange(code.size)
    windows = {"phase": np.arange(1, 13), "t_start": t, "t_end": t + 20.0, "angle_start": code, "angle_end": code,
               "mean": 0.0 * t, "level": 0.0 * t}  # fmt: skip
    setup = R.AlignmentSetup(latitude=LAT, longitude=LONG, jd=2461000.0)
    for change, text in (
        ({"angle_start": np.where(code == -1.0, 1.0, code)}, "star: 4 sights left, 0 right"),
        ({"angle_start": np.where(code == 3.0, 5.0, code)}, "target 5: 1 star, 2 mirror, 3 axis"),
        ({"angle_start": np.where(code == 3.0, 4.0, code)}, "the azimuth is from one of both"),
        ({"level": None}, "column level is missing"),
    ):
        rows = {n: v for n, v in {**windows, **change}.items() if v is not None}
        with pytest.raises(ReductionError, match=text):
            R.Reduction.reduce(rows, setup)


# ------------------------------------------------------------------------------------------------ measured data
HEAD = "# latitude = 45.75deg\n# longitude = 126.63deg\n# start = 2026-11-28T12:00\n# pressure = 1013hPa\n"


def test_a_file_of_a_simulated_record_gives_the_same(session: Session, tmp_path: Path) -> None:
    """Written as a laboratory writes it, in degrees and arc seconds; and what a file must say."""
    record = session.run({"theodolite.azimuth": 1e-4, "theodolite.level_zero": 2e-5}, seed=5)
    w = record.windows
    rows = zip(
        w["phase"], w["t_start"], w["t_end"], w["angle_start"], w["mean"] / DEG, w["level"] / ARCSEC, strict=True
    )
    lines = [f"{p:.0f},{a:.17g},{b:.17g},{k:.0f},{y:.17g},{v:.17g}" for p, a, b, k, y, v in rows]
    table = "\n".join(["phase,t_start [s],t_end [s],target,mean [deg],level [arcsec]", *lines]) + "\n"
    file = tmp_path / "sights.csv"
    file.write_text(HEAD + table, "utf-8")
    lab = load_system(NAME)
    found, simulated = lab.reduce(lab.read_measured(file, {})), session.system.reduce(record)
    for name in FITTED:
        assert found[name].estimate == pytest.approx(simulated[name].estimate, abs=1e-6)
        assert found[name].truth is None
    file.write_text(HEAD.replace("# longitude = 126.63deg\n", "") + table, "utf-8")
    with pytest.raises(gb.GyrobenchError, match="longitude"):
        load_system(NAME).read_measured(file, {})


# ------------------------------------------------------------------------------------------------ hand-over
@pytest.mark.long
def test_the_axis_is_handed_over_to_the_tests(session: Session, tmp_path: Path) -> None:
    """As corrections by the names of the sources, with their u; a stand at the pole of 20 arcsec to the east."""
    out = tmp_path / "run"
    values = {"theodolite.azimuth": "20arcsec", "theodolite.elevation": "-5arcsec"}
    gb.load(NAME, values).run(seed=2, out=out)
    for system, axis in (("tumble_single_axis", "table axis"), ("tumble_two_channel", "table axis"),
                         ("tumble_two_axis", "outer axis")):  # fmt: skip
        text = gb.load(system, from_run=[out]).values["corrections"]
        east, across = (part.split(" = ")[1] for part in text.split("; "))
        names = [part.split(" = ")[0] for part in text.split("; ")]
        assert names == [f"{axis} off the pole, about {n}" for n in ("east", "p × east")]
        assert float(east.split("(")[0]) == pytest.approx(-5.0, abs=0.5)
        assert float(across.split("(")[0]) == pytest.approx(20.0 * math.cos(LAT), abs=0.5)
        assert east.endswith(" arcsec") and 0.0 < float(east.split("(")[1].split(")")[0]) < 0.5


@pytest.mark.long
def test_a_tumble_on_a_stand_off_the_pole_is_mended(session: Session) -> None:
    """The stand of the alignment is that of the tumble: table.tilt about east and about p x east; signs end to end."""
    azimuth, elevation = 60.0 * ARCSEC, -40.0 * ARCSEC
    aligned = session.system.reduce(
        session.run({"theodolite.azimuth": azimuth, "theodolite.elevation": elevation, "theodolite.pointing": 1e-9,
                     "theodolite.bubble": 0.0}, seed=1)
    )  # fmt: skip
    system = load_system("tumble_single_axis")
    given = dict(system.takes["stand_alignment"](aligned))
    plan = {
        **tumbling.SHORT,
        **tumbling.quiet(tumbling.load()),
        "gyro.white": 3e-9,
        "nuisances": "none",
        "latitude": LAT,
    }
    off = {"table.tilt[1]": elevation, "table.tilt[2]": azimuth * math.cos(LAT)}
    with Session("tumble_single_axis") as tumble:
        plain, wrong = (tumble.run({**plan, **more}, seed=1) for more in ({}, off))
    right = wrong.run.replace(options={**wrong.run.options, **given})
    found = [system.reduce(r) for r in (plain, wrong, Record(wrong.windows, wrong.channels, right))]
    shift, left = ([r[n].estimate - found[0][n].estimate for n in tumbling.NAMES] for r in found[1:])
    assert np.abs(shift).max() > 2e-3 and np.abs(left).max() < 0.03 * np.abs(shift).max()
