"""A vendor's gyro in the gyro slot of the tumble test, with its own names, units and signs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

Foreign = Callable[[str], Path]
MAP = Path(__file__).parents[1] / "foreign" / "vendor_gyro.toml"
SHORT = {"rate": "200 ERU", "dwell": 20.0, "settle": 5.0, "windows": 12}
QUIET = {"rebalance.meter": 0.0, "rebalance.resolution": 0.0}
TERMS = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS")


@pytest.mark.long
def test_vendor_gyro_gives_the_same_coefficients(foreign: Foreign) -> None:
    system = load_system("tumble_single_axis")
    noise = {f"gyro.{n}": 0.0 for n in ("turn_on", "markov", "white", "pickoff")}
    with Session(system) as session:
        ours = session.run({**SHORT, **QUIET, **noise})
    p = ours.run.parameters
    same = {f"gyro.{n}": p[f"gyro.{n}"] for n in (*TERMS, "k")}  # SI; the mapping makes deg/h and deg/h/mA of it
    body = {
        "gyro.GAIN": p["gyro.H"] / p["gyro.C"],
        "gyro.T_FLOAT": p["gyro.J"] / p["gyro.C"],  # s, declared in ms
        "gyro.SENS": p["gyro.K_sg"] * 1e3,  # mV/rad
    }
    with Session(system, {"gyro": foreign("vendor_gyro")}, {"gyro": MAP}) as session:
        theirs = session.run({**SHORT, **QUIET, **same, **body})
    a, b = system.reduce(ours), system.reduce(theirs)
    assert [c.name for c in a.coefficients] == list(TERMS)
    for ours_c, theirs_c in zip(a.coefficients, b.coefficients, strict=True):
        assert ours_c.unit == theirs_c.unit
        assert abs(ours_c.estimate - theirs_c.estimate) < 1e-8, ours_c.name  # surface units, deg/h ...
        assert ours_c.truth is not None
        assert abs(ours_c.estimate - ours_c.truth) < 1e-5
