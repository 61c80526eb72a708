"""Gains that follow the parts in the slots, ours and foreign ones; what a loop misses is told before the run."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from commanding import Command
from gimballed import only

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.system import load_system

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
ONE, THREE, GIMBAL = "platform_single_axis", "platform_three_axis", "platform_three_gimbal"
TENFOLD = {"platform.I_r": "[8, 9, 7]", "platform.I_f": "[4, 6, 5]", "platform.I_a": "[6, 5, 7]"}


def run(name: str, values: dict[str, Any], parts: Any = None, maps: Any = None) -> tuple[Record, Result]:
    with Session(name, parts, maps) as s:
        return reduced(s, values)


def reduced(session: Session, values: dict[str, Any]) -> tuple[Record, Result]:
    record = session.run(values, seed=1)
    return record, session.system.with_values(values).reduce(record)


def estimates(result: Result) -> dict[str, float]:
    return {c.name: c.estimate for c in result.coefficients}


@pytest.fixture
def known_gyro(tmp_path: Path) -> Path:
    """The vendor's gyro with all that the design asks for: its pickoff, and H/C = 1 for what it calls GAIN."""
    file = tmp_path / "gyro.toml"
    more = 'K_sg = { name = "SENS", unit = "mV/rad" }\nH = { value = 0.2 }\nC = { value = 0.2 }\n'
    file.write_text((FOREIGN / "vendor_gyro.toml").read_text() + more)
    return file


# ------------------------------------------------------------------------------------ our parts
@pytest.fixture(scope="module")
def designed() -> Iterator[Session]:
    with only(ONE, "command", "loop", "drift") as s:
        yield s


@pytest.mark.parametrize(
    "values",
    [{"platform.J": "6kg.m2"}, {"gyro.k": "20deg/h/mA"}, {"platform.R": "4Ohm", "gyro.H": 0.3, "gyro.K_sg": 20.0}],
)
def test_single_axis(designed: Session, values: dict[str, Any]) -> None:
    """Wanted: 10 Hz and a rate gain of 1.  With gains for J = 2 kg.m2 and 17.2 deg/h/mA it was 3.9 Hz, and 1.164."""
    record, result = reduced(designed, {**values, "hold": 10.0})
    found = estimates(result)
    assert found["f_c"] == pytest.approx(10.0, rel=0.03)
    assert found["rate gain"] == pytest.approx(1.0, abs=5e-3)
    assert not any("asked for" in w for w in (*result.warnings, *record.run.notes))


def test_rebalance_set_by_hand_is_what_the_stabilizer_reckons_with(designed: Session) -> None:
    values = {"rebalance.K_p": 200.0, "hold": 10.0}  # A/V, of 754: the float follows with 27 Hz
    record, result = reduced(designed, values)
    assert estimates(result)["f_c"] == pytest.approx(10.0, rel=0.03)
    assert record.run.linear is not None and record.run.linear.wanted == {"stabilizer": 10.0}


@pytest.mark.long
def test_three_axes_with_ten_times_the_inertia() -> None:
    """It ran into its stop: the gains were for 1, 2 and 0.7 kg.m2."""
    values = {**TENFOLD, "hold": 5.0, "swing": 0.0, "load_step": 0.5}
    axes = ("pitch", "roll", "azimuth")
    with only(THREE, "load", *(f"loop {axis} {f} Hz" for axis in axes for f in (6, 9, 12, 20))) as s:
        _, result = reduced(s, values)
    found = estimates(result)
    for axis in axes:
        assert found[f"f_c {axis}"] == pytest.approx(10.0, rel=0.03)
    assert not any("asked for" in w or "lock" in w for w in result.warnings)


@pytest.mark.long
def test_rate_gain_of_three_axes_follows_the_torquers() -> None:
    values = {"gyro_x.k": "20deg/h/mA", "hold": 5.0, "sweeps": False, "swing": "1deg"}
    with only(THREE, "command step") as s:
        assert estimates(reduced(s, values)[1])["rate gain"] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.long
def test_gimbals_whose_servos_turn_faster() -> None:
    _, result = run(GIMBAL, {"platform.rate_gain": 10.0, "gyro_b.K_sg_y": 20.0, "roll": 1.0, "hold": 2.0})
    for axis in ("pitch", "roll", "azimuth"):
        assert estimates(result)[f"f_c {axis}"] == pytest.approx(40.0 / 6.2832, rel=0.01)


def test_precession_of_the_power_stabilizer_follows_a_pickoff_given_with_its_unit() -> None:
    with Session("stabilizer_power_2dof") as s:
        p = s.prepare({"gyro.K_sg_y": "20V/rad", "gyro.H": 8.0, "hold": 1.0})[2].parameters
    assert (p["stabilizer.k_u"], p["stabilizer.H_g"]) == (20.0, 8.0)
    assert p["stabilizer.k_m"] * p["stabilizer.k_u"] * p["stabilizer.k_i"] * p["stabilizer.ratio"] == 100.0


# ------------------------------------------------------------------------------------ foreign parts
@pytest.mark.long
def test_foreign_gyro(foreign: Foreign, known_gyro: Path) -> None:
    """Its torquer has 20 deg/h/mA, its own start value; no linear model tells the crossover, the run does."""
    record, result = run(ONE, {"hold": 10.0}, {"gyro": foreign("vendor_gyro")}, {"gyro": known_gyro})
    found = estimates(result)
    assert found["f_c"] == pytest.approx(10.0, rel=0.03)
    assert found["rate gain"] == pytest.approx(1.0, abs=5e-3)
    assert not any("the design takes" in n for n in record.run.notes)
    assert any("whether the loop crosses where it was asked to (stabilizer 10 Hz)" in n for n in record.run.notes)


@pytest.mark.long
def test_foreign_gyro_on_a_heavier_platform(foreign: Foreign, known_gyro: Path) -> None:
    values = {"hold": 10.0, "platform.J": 6.0, "gyro.k": "30deg/h/mA"}
    found = estimates(run(ONE, values, {"gyro": foreign("vendor_gyro")}, {"gyro": known_gyro})[1])
    assert found["f_c"] == pytest.approx(10.0, rel=0.03)
    assert found["rate gain"] == pytest.approx(1.0, abs=5e-3)


@pytest.mark.long
def test_foreign_gyro_that_says_nothing_of_its_torquer(
    foreign: Foreign, tmp_path: Path, command: Command, caplog: Any
) -> None:
    """20 deg/h/mA taken for 17.2: told before the run, and the report says what came out."""
    mapping = tmp_path / "gyro.toml"
    whole = (FOREIGN / "vendor_gyro.toml").read_text()
    mapping.write_text(whole.replace('k = { name = "SCALE", unit = "deg/h/mA" }\n', ""))
    out = tmp_path / "run"
    part = f"gyro={foreign('vendor_gyro')}"
    code, _, _ = command("run", ONE, "--part", part, "--map", f"gyro={mapping}", "--set", "hold=10", "--out", out)
    assert code == 0
    taken = "gyro has no parameter 'k': the design takes 0.083388 (SI), the value of floated_gyro"
    assert taken in caplog.text and "is not known before the run" in caplog.text
    result = json.loads((out / "result.json").read_text())
    found = {c["name"]: c["estimate"] for c in result["coefficients"]}
    assert found["rate gain"] == pytest.approx(20.0 / 17.2, rel=5e-3)
    (crossed,) = [w for w in result["warnings"] if "asked for" in w]
    assert crossed == f"The open loop, stabilizer crosses at {found['f_c']:.3g} Hz, not at the 10 Hz asked for."
    assert any(taken in n for n in json.loads((out / "run.json").read_text())["notes"])


@pytest.mark.long
def test_foreign_platform(foreign: Foreign) -> None:
    """Its servos turn with 50 deg/s for a volt, not with 1 rad/s."""
    maps = {"platform": FOREIGN / "vendor_platform.toml"}
    _, result = run(GIMBAL, {"roll": 1.0, "hold": 2.0}, {"platform": foreign("vendor_platform")}, maps)
    for axis in ("pitch", "roll", "azimuth"):
        assert estimates(result)[f"f_c {axis}"] == pytest.approx(40.0 / 6.2832, rel=0.01)
    assert not any("asked for" in w for w in result.warnings)


# ------------------------------------------------------------------------------------ what is missed
@pytest.mark.long
def test_gain_set_by_hand_is_told_with_what_comes_out(command: Command, tmp_path: Path, caplog: Any) -> None:
    """A third of the gain: 3.9 Hz instead of 10, told before the run and in the report, and so it is."""
    with Session(ONE) as s:
        gain = float(s.prepare({"hold": 10.0})[2].parameters["stabilizer.K"])
    out = tmp_path / "run"
    code, _, _ = command("run", ONE, "--set", f"stabilizer.K={gain / 3.0}", "--set", "hold=10", "--out", out)
    assert code == 0
    (told,) = [m for m in caplog.messages if "it will cross at 3.9 Hz with a phase margin of 45°" in m]
    assert told.endswith("not at the 10 Hz asked for; set or swapped: stabilizer.K, hold")
    result = json.loads((out / "result.json").read_text())
    (warning,) = [w for w in result["warnings"] if "asked for" in w]
    assert warning in told
    crossover = next(c["estimate"] for c in result["coefficients"] if c["name"] == "f_c")
    assert f"{crossover:.1f}" in warning


@pytest.mark.long
def test_another_estimator_in_the_loop_is_named() -> None:
    with Session(ONE, {"estimator": "estimator_kalman_ar"}) as s:
        notes = s.prepare({"hold": 10.0})[2].notes
    assert any("cross at 4.58 Hz" in n and n.endswith("part estimator_kalman_ar in estimator, hold") for n in notes)


# ------------------------------------------------------------------------------------ angle or rate
SDF = "stabilizer_sdf"


def test_servo_that_wants_a_rate_does_not_fit_a_loop_of_angles(command: Command, tmp_path: Path) -> None:
    """It fitted, and the loop swung up with 33 Hz."""
    code, out, err = command("run", SDF, "--part", "stabilizer=servo_three_loop", "--out", tmp_path / "run")
    assert (code, out) == (2, "") and not (tmp_path / "run").exists()
    text = "u: wrong quantity: u is for an angular rate, here the gyro signal stands for an angle"
    assert f"slot stabilizer: FMU 'ServoThreeLoop' does not fit socket Stabilizer\n  - {text}" in err


@pytest.mark.parametrize("slot", ["pitch", "azimuth"])
def test_servo_that_wants_a_rate_gives_a_platform_rate_gyros(slot: str) -> None:
    loaded = load_system(THREE)
    loaded.place(slot, "servo_three_loop")
    assert loaded["loops"] == "rate" and {loaded.slots[a].part for a in ("pitch", "roll", "azimuth")} == {
        "servo_three_loop"
    }


@pytest.mark.long
def test_the_same_servo_fits_where_the_signal_is_a_rate() -> None:
    with Session(ONE, {"stabilizer": "servo_three_loop"}) as s:
        assert s.run({"hold": 10.0}, seed=1).run.linear.loops["stabilizer"].break_at == "stabilizer.u"
