"""The position test of a table: harmonics told from the polygon, wobble, tilt, squareness, lost motion, refusals."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.reduction.loops.scale_errors import truth
from gyrobench.system.system import load_system
from gyrobench.workflow.handover import handed_over

ARCSEC = math.pi / 648000
QUICK = {"move_rate": "8deg/s", "settle": "0.5s", "dwell": "0.3s"}
TRUE = {
    "reader.encoder_eccentricity": "0.7arcsec", "reader.encoder_eccentricity_phase": 0.4,
    "reader.encoder_tilt": "-0.4arcsec", "reader.encoder_tilt_phase": 2.0,
    "wobble.amplitude": "1.2arcsec", "wobble.phase": 1.1,
    "body.tilt[1]": "3arcsec", "body.tilt[2]": "-5arcsec",
    "reference.plate[1]": "-2arcsec", "reference.plate[2]": "4arcsec", "reference.level_zero[1]": "9arcsec",
    "reference.errors[2]": "1.5arcsec", "reference.errors[7]": "-0.8arcsec",
}  # fmt: skip


def position_run(seed: int = 1, out: Path | None = None, **values: Any) -> Any:
    test = gb.load("table_position_test", **QUICK)
    for name, value in {**TRUE, **values}.items():
        test.set(name, value)
    return test.run(seed=seed, check_step=False, out=out)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("position") / "run"


@pytest.fixture(scope="module")
def found(folder: Path) -> Any:
    return position_run(out=folder).result


@pytest.mark.long
def test_first_harmonic_is_handed_over(found: Any, folder: Path) -> None:
    """To four accelerometers on the same axis: D is the position error, where the axis is less where it was sent."""
    took = gb.load("accelerometer_four", from_run=[folder])
    for option, name in (("D1c", "E1 cos"), ("D1s", "E1 sin")):
        assert took.values[option] == pytest.approx(found[name].estimate * ARCSEC, rel=1e-12)
        assert abs(took.values[option] - found[name].truth * ARCSEC) < 4.0 * took.values["u_D1"]
    assert took.values["u_D1"] == pytest.approx(max(found["E1 cos"].u, found["E1 sin"].u) * ARCSEC, rel=1e-12)
    assert gb.load("accelerometer_four", from_run=[folder], D1c="1arcsec").values["D1c"] == pytest.approx(ARCSEC)


def test_what_is_not_handed_over(found: Any, folder: Path, tmp_path: Path) -> None:
    with pytest.raises(gb.GyrobenchError, match="fixed_position takes no values of other runs"):
        gb.load("fixed_position", from_run=[folder])
    with pytest.raises(gb.GyrobenchError, match="given by another run, too"):
        gb.load("accelerometer_four", from_run=[folder, folder])
    with pytest.raises(gb.GyrobenchError, match="no such folder"):
        gb.load("accelerometer_four", from_run=[tmp_path / "none"])
    other = load_system("accelerometer_four")
    vars(other)["takes"] = {"table_rate_test": dict}
    with pytest.raises(
        gb.GyrobenchError, match="a run of table_position_test; accelerometer_four takes values of table_r"
    ):
        handed_over(other, [folder])
    first = importlib.import_module(".head", type(load_system("accelerometer_four")).__module__).first_harmonic
    left = [replace(c, no_value="polygon") if c.name == "E1 sin" else c for c in found.coefficients]
    with pytest.raises(LookupError, match="no value of E1 sin: polygon"):
        first(replace(found, coefficients=left))


def test_harmonics_come_back_in_spite_of_the_polygon(found: Any) -> None:
    for name in ("E1 cos", "E1 sin", "E2 cos", "E2 sin", "E3 cos", "E3 sin"):
        c = found[name]
        assert abs(c.z) < 3.5 and c.u < 0.1
    # the scale reads 0.7 sin(theta + 0.4) too much, the table stands that much short
    assert found["E1 sin"].truth == pytest.approx(-0.7 * math.cos(0.4))
    assert found["E1 sin"].estimate == pytest.approx(-0.7 * math.cos(0.4), abs=0.2)
    assert (
        found["accuracy"].estimate == pytest.approx(found["accuracy"].truth, abs=0.1) and abs(found["accuracy"].z) < 4
    )


def test_faces_of_the_polygon(found: Any) -> None:
    rows = found.tables[0].rows
    assert rows[1][3] == pytest.approx(1.5 - (1.5 - 0.8) / 12)
    for _, value, u, true in rows:
        assert abs(value - true) < 4 * u
    assert sum(row[1] for row in rows) == pytest.approx(0.0, abs=1e-9)


def test_wobble_tilt_and_squareness(found: Any) -> None:
    for name, value in (
        ("tilt 1", 3.0), ("tilt 2", -5.0), ("wobble cos", 1.2 * math.cos(1.1)), ("wobble sin", 1.2 * math.sin(1.1)),
        ("squareness x", -2.0), ("squareness y", 4.0),
    ):  # fmt: skip
        assert found[name].estimate == pytest.approx(value, abs=0.1) and abs(found[name].z) < 4
    assert found["repeatability"].estimate < 0.18  # a count


@pytest.mark.long
def test_one_mount_separates_only_what_two_heads_do() -> None:
    """Reversal alone: odd orders by the heads, even ones stay with the polygon, the plate with the level's zero."""
    r = position_run(mounts="0").result
    assert abs(r["E1 sin"].z) < 4 and abs(r["E3 cos"].z) < 4
    for name in ("E2 cos", "E2 sin", "squareness x"):
        assert r[name].no_value and math.isnan(r[name].estimate)
    assert "order 2 is the same in all mounts" in r["E2 cos"].no_value


@pytest.mark.long
def test_a_mount_that_is_taken_twice_is_one_mount() -> None:
    r = position_run(mounts="0 0 60", positions=6, orders=2).result
    for name in ("E1 cos", "E1 sin", "E2 cos", "E2 sin", "squareness x", "squareness y"):
        assert abs(r[name].z) < 4.0, name


def test_true_harmonics_are_those_at_the_head() -> None:
    """0.7 sin(a + 0.4) of the scale's angle a = theta + 40 deg: 0.7 sin(0.698 + 0.4) cos theta and so on."""
    names = ("eccentricity", "tilt", "pitch", "interpolation")
    p = {f"reader.encoder_{n}": 0.0 for n in (*names, "d0", "de", "e3", "e5", *(f"{n}_phase" for n in names))}
    p |= {"reader.pole_pairs": 360, "reader.head": math.radians(40.0), "reader.encoder_pitch_order": 12}
    p |= {"reader.encoder_eccentricity": 0.7, "reader.encoder_eccentricity_phase": 0.4}
    phase = math.radians(40.0) + 0.4
    assert truth(p, "reader")[1] == pytest.approx((0.7 * math.sin(phase), 0.7 * math.cos(phase)))
    assert truth(p, "reader")[2] == (0.0, 0.0) and truth({}, "reader") == {}


@pytest.mark.long
def test_friction_loses_motion() -> None:
    """A table that is held by friction inside a count stops short on both ways."""
    r = position_run(**{"body.axis_friction": 0.3, "positions": 6, "mounts": "0 60", "orders": 2}).result
    assert 0.0 < abs(r["lost motion"].estimate) < 0.4 or r["lost motion"].u < 0.05
    assert abs(r["E1 sin"].z) < 4


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"positions": 24}, "at most 99 are possible"),
        ({"mounts": "0 45"}, "must be whole faces of 30 deg"),
        ({"mounts": "0, 90"}, "angles in deg with spaces"),
        ({"orders": 6}, "at most 5 harmonics follow from 12 positions"),
        ({"command.reference_limit": "190deg"}, "goes through a whole turn"),
    ],
)
def test_refusals(values: dict[str, Any], text: str) -> None:
    with pytest.raises(gb.GyrobenchError, match=text):
        position_run(**values)


@pytest.mark.long
def test_program_from_a_file(tmp_path: Any) -> None:
    """Every third face by a program, forced upwards and the shorter way back."""
    rows = [f"index,{a}deg,8deg/s,{way},1min" for a, way in ((60, "up"), (120, "up"), (0, "shorter"), (240, "shorter"))]
    path = tmp_path / "places.csv"
    path.write_text("kind,positions\nmode,target,rate,way,time\n" + "\n".join(rows) + "\n")
    test = gb.load("table_position_test", parts={"sequencer": "table_program"}, **QUICK)
    for name, value in {"program": str(path), "positions": 6, "mounts": "0", "orders": 1, "dwell": "10s"}.items():
        test.set(name, value)
    record = test.run(seed=1).record
    assert record.windows["phase"].tolist() == [p for p in (1, 2, 3, 4) for _ in range(5)]  # 59.5 s of windows of 10 s
    places = np.degrees(record.windows["angle_end"][4::5])
    assert places == pytest.approx([60.0, 120.0, 0.0, -120.0], abs=2e-4)  # 240 deg the shorter way is -120 deg
    path.write_text("kind,positions\ntarget,time\n50deg,1min\n")
    with pytest.raises(gb.GyrobenchError, match="index moves to whole faces of 60 deg"):
        test.run(seed=1)


def test_a_walk_that_hides_under_the_noise_is_in_u() -> None:
    """The mean of 40 readings with noise 1 that walk by 0.15 each: 2.8 u of the noise alone at the end, often taken for
    none.  Of 300 0.90 or more hold it: less than 0.95, as one certain walk is a corner of those it is averaged over.
    """
    fit = importlib.import_module(".places_fit", type(load_system("table_position_test")).__module__)
    rng, t = np.random.default_rng(8), np.arange(40.0)
    part = fit.walk(slice(0, 40), t, np.zeros(40, dtype=np.int64))
    X = np.ones((40, 1))
    V = np.eye(40) + 0.15**2 * 39.0 * part.shape
    true = math.sqrt(float(np.linalg.inv(X.T @ np.linalg.inv(V) @ X)[0, 0]))
    held, u = [], []
    for _ in range(300):
        walked = np.concatenate([[0.0], np.cumsum(0.15 * rng.standard_normal(39))])
        found = fit.averaged_over_walk(X, walked + rng.standard_normal(40), part)
        held.append(abs(found.value[0]) <= found.k[0] * found.u[0])
        u.append(found.u[0])
    assert 0.88 < np.mean(held) < 0.97
    assert math.sqrt(np.mean(np.square(u))) == pytest.approx(true, rel=0.2)
