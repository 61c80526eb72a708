"""The vertical and level servo tests on a table with a tilted axis and on one that gives way to its own unbalance: the
coefficients move, with sign, by what the formula says, and the error budget of a run without the error has said it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from servoing import DPH, NAMES, QUIET
from stated import FAINT

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.result import Result
from gyrobench.system.system import load_system

NAME = "servo_vertical_level"
PHI = math.radians(45.75)
GAMMA = frames.normal_gravity(PHI) / frames.G0
W = frames.EARTH_RATE / DPH  # 15.041 deg/h
C, S = math.cos(PHI), math.sin(PHI)
TILT = math.radians(60.0 / 3600.0)
STIFFNESS, UNBALANCE = 5e4, 0.02  # N.m/rad, kg.m; more would hold the table out of the range of capture
AT_1G = UNBALANCE * frames.G0 / STIFFNESS  # 3.9e-6 rad
H_C = 1.0  # H/C of the gyro
NORTH = "x down; x up; x north, y up; x north, y down; x north, z up; x north, z down"


def held(session: Session, **values: Any) -> Result:
    """A gyro without drift, noise off: what is left is the table's."""
    ideal = {**QUIET, **{f"gyro.{n}": 0.0 for n in NAMES}, "dwell": 60.0, "settle": 2.0, "cycles": 1, "tracking": 0.0}
    given = {**ideal, **{k.replace("__", "."): v for k, v in values.items()}}
    return load_system(NAME).with_values(given).reduce(session.run(given))


def check(plain: Result, found: Result, expected: dict[str, float], predicted: np.ndarray[Any, Any]) -> None:
    shift = np.array([a.estimate - b.estimate for a, b in zip(found.coefficients, plain.coefficients, strict=True)])
    wanted = np.array([expected.get(c.name, 0.0) for c in plain.coefficients])
    largest = np.max(np.abs(wanted))
    assert np.max(np.abs(shift - wanted)) < 0.01 * largest, (shift, wanted)
    assert np.max(np.abs(shift - predicted)) < 0.01 * largest, (shift, predicted)


def told(result: Result, source: str) -> np.ndarray[Any, Any]:
    """Rows: independent errors of one source; columns: what each changes the coefficients by."""
    return np.array(next(b for b in result.type_b if b.source == source).changes) / FAINT


@pytest.mark.parametrize(
    ("about", "axis", "expected"),
    [("y", 1, {"D_I": -W * C, "D_O": W * C, "D_S": -W * S}), ("z", 2, {"D_O": W * S, "D_S": W * C})],
)
def test_axis_tilt(session: Session, about: str, axis: int, expected: dict[str, float]) -> None:
    """Turned by t about y the table axis is x - t z, about z it is x + t y: the drift taken from the table is wrong by
    t omega_E,z or -t omega_E,y.  With x down or up, y is east and z south or north; with x east, y up or down has z
    south or north, z up or down has y north or south:

        about y   x down, up -+W c     y up, down -+W c     z up, down +-W s
        about z   0                    y up, down -+W s     z up, down -+W c

    and D_I, D_O, D_S are half of (down less up) over gamma.  The budget has a row for each phase, set up by itself: the
    same tilt in all of them is the sum of its rows.
    """
    plain = held(session, u_axis=TILT * FAINT)
    found = held(session, **{f"table.tilt[{axis}]": TILT})
    predicted = told(plain, f"table axis about {about}").sum(axis=0)
    check(plain, found, {n: v * TILT / GAMMA for n, v in expected.items()}, predicted)


@pytest.mark.parametrize(("axis", "name", "row"), [(1, "D_O", 1), (2, "D_S", 0)])
def test_unbalance_over_stiffness(session: Session, axis: int, name: str, row: int) -> None:
    """A mass off the axis along y pulls with M = -b f_z, along z with b f_y; the table gives way by M/K_T.  Held with x
    north it turns against the Earth with -W c, so the angle drifts by b f_y/K_T or b f_z/K_T times that, with f up: -+a
    W c with y (or z) up and down, a = b g/K_T, and D_O (or D_S), half of (down less up) over gamma, takes W c b g0/K_T.

    With z up or down the mass along y pulls with a constant -+b g besides.  Where the table gives way by -+a the float
    is off null by H/C times that, and its input axis sees +-W s of the spin axis: (H/C) a W s alike in both, taken from
    D_SS.  The budget of u_unbalance does not have this part.
    """
    hard = {"attitudes": NORTH, "table.stiffness": STIFFNESS}
    plain = held(session, u_unbalance=AT_1G * FAINT, **hard)
    found = held(session, **hard, **{f"table.unbalance[{axis}]": UNBALANCE})
    float_off = {"D_SS": -H_C * AT_1G * W * S / GAMMA} if axis == 1 else {}
    predicted = told(plain, "unbalance over stiffness")[row]
    seen = np.array([float_off.get(c.name, 0.0) for c in plain.coefficients])
    check(plain, found, {name: W * C * AT_1G} | float_off, predicted + seen)
