"""Compensation of the systematic drift, tested again on the servo table: currents by hand, what is left, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.system.system import load_system
from gyrobench.system.values import InvalidValueError

NAME = "servo_vertical_level"
DPH = math.pi / 648000.0
TRUE = {"D_F": -0.41, "D_I": 0.83, "D_O": 0.12, "D_S": -0.66, "D_II": 0.05, "D_SS": -0.04}
SHORT = {"cycles": 1, "dwell": 60.0}


def text(values: dict[str, float]) -> str:
    return ", ".join(f"{n}={v}deg/h" for n, v in values.items())


def compensated(put_in: dict[str, float], **values: Any) -> tuple[Any, Any]:
    system = load_system(NAME)
    system.set("compensate", text(put_in))
    known = {f"gyro.{n}": v * DPH for n, v in TRUE.items()} | {f"gyro.{n}": 0.0 for n in ("D_IO", "D_OS", "D_IS")}
    with Session(system) as session:
        record = session.run({**SHORT, **known, **values}, seed=5)
    return record, load_system(NAME).reduce(record)


def tables(result: Any) -> tuple[dict[str, list[Any]], dict[str, list[Any]]]:
    found = {t.id: {row[0]: row[1:] for row in t.rows} for t in result.tables}
    return found["compensation.coefficients"], found["compensation.attitudes"]


def test_currents_by_hand_and_nothing_is_left() -> None:
    """k i = -omega_d: x down -(D_F + D_I g + D_II g2), x up with -D_I, z down -(D_F + D_S g + D_SS g2)."""
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    record, result = compensated(TRUE, **quiet, nuisances="none")
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    D = TRUE
    by_hand = {
        "x down": -(D["D_F"] + D["D_I"] * g + D["D_II"] * g * g),
        "x up": -(D["D_F"] - D["D_I"] * g + D["D_II"] * g * g),
        "x east, z down": -(D["D_F"] + D["D_S"] * g + D["D_SS"] * g * g),
        "x east, y up": -(D["D_F"] - D["D_O"] * g),
    }
    coefficients, attitudes = tables(result)
    for name, rate in by_hand.items():
        assert attitudes[name][1] == pytest.approx(rate, abs=1e-9), name
    for name, (_, _, left) in attitudes.items():
        assert left == pytest.approx(0.0, abs=1e-5), name
    for name, (_, put_in, again, left, *_) in coefficients.items():
        assert (put_in, again) == pytest.approx((TRUE[name], TRUE[name]), abs=1e-6) and abs(left) < 1e-6, name
    # the table itself: at rest but for the Earth, which turns an axis that is down by W sin(latitude)
    w, down = record.windows, next(r.phase for r in record.run.plan if r.label == "x down")
    rows = w["phase"] == down
    rate = (w["angle_end"] - w["angle_start"])[rows] / (w["t_end"] - w["t_start"])[rows]
    assert rate == pytest.approx(frames.EARTH_RATE * math.sin(math.radians(45.75)), abs=1e-6 * DPH)


@pytest.mark.long
def test_a_coefficient_that_does_not_repeat_is_left() -> None:
    """D_S put in as of the day before, 0.1 deg/h/g off, under noise: that one is beyond its interval."""
    _, result = compensated(TRUE | {"D_S": TRUE["D_S"] + 0.1}, dwell=300.0)
    coefficients, attitudes = tables(result)
    assert coefficients["D_S"][3] == pytest.approx(-0.1, abs=4.0 * coefficients["D_S"][4])
    assert [n for n, row in coefficients.items() if row[-1] == "yes" and abs(row[3]) > 0.05] == ["D_S"]
    assert attitudes["x east, z down"][2] == pytest.approx(-0.1, abs=0.01)
    assert any("Compensation leaves" in s for s in result.summary)


def test_coefficients_of_a_run(tmp_path: Path) -> None:
    """Those of the gyro alone; combinations are left out, and a result of combinations alone is refused."""
    found = [{"name": "D_I", "estimate": 0.25}, {"name": "D_F + γ² D_II", "estimate": 1.0}]
    (tmp_path / "result.json").write_text(json.dumps({"coefficients": found}))
    system = load_system(NAME)
    system.set("compensate", str(tmp_path))
    assert system["compensate"] == "D_I=0.25deg/h"
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    assert system.compensated("x down") == pytest.approx(0.25 * DPH * g)
    (tmp_path / "result.json").write_text(json.dumps({"coefficients": found[1:]}))
    with pytest.raises(InvalidValueError, match="no coefficient of this gyro alone"):
        load_system(NAME).set("compensate", str(tmp_path))
    (tmp_path / "result.json").unlink()
    with pytest.raises(InvalidValueError, match="with coefficients; run its report"):
        load_system(NAME).set("compensate", str(tmp_path))


@pytest.mark.parametrize(
    ("value", "said"),
    [("D_X=1deg/h", "'D_X' is not one of D_F"), ("D_F=1deg/h, D_F=2deg/h", "'D_F' stands twice"), ("D_F=3V", "D_F")],
)
def test_refused(value: str, said: str) -> None:
    system = load_system(NAME)
    system.set("compensate", value)
    assert any(said in problem for problem in system.check())


def test_of_a_channel() -> None:
    """The output axis of the y channel is -x: Dy_x put in is taken out with its own sign."""
    system = load_system(NAME)
    system.set("channel", "y")
    system.set("compensate", "Dy_0=0.4deg/h, Dy_x=-0.08deg/h/g")
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    # y up: O up, that is x down: X = -f_x/g0 = +g
    assert system.compensated("x east, y up") / DPH == pytest.approx(0.4 - 0.08 * g, rel=1e-12)
    assert np.isclose(system.compensated("x east, y down") / DPH, 0.4 + 0.08 * g)
