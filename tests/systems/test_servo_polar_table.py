"""The polar servo test on a table with torque ripple, a soft servo and a wobbling axis: the coefficients move, with
sign, by what the formula says and the report's error budget has said before.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np
import pytest
from servoing import DAY50, DPH, QUIET, W50, polar_at_2_ms
from stated import FAINT
from tumbling import WOBBLE

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.system.system import Slot, System, load_system

NAME = "servo_polar"
ARCSEC = math.pi / 648000.0
PHI = math.radians(45.75)
G = frames.normal_gravity(PHI) / frames.G0
DAY: dict[str, Any] = {**DAY50, **QUIET, "route": "combination", "tracking": 0.0}
STIFFNESS = 1.5e5  # N.m/rad


@pytest.fixture(scope="module")
def polar() -> Iterator[Session]:
    with Session(NAME) as prepared:
        yield prepared


def estimates(session: Session, system: System, **values: Any) -> tuple[dict[str, float], Any]:
    given = {**DAY, **{k.replace("__", "."): v for k, v in values.items()}}
    result = system.with_values(given).reduce(session.run(given))
    return {c.name: c.estimate for c in result.coefficients}, result


@pytest.fixture(scope="module")
def smooth(polar: Session) -> Callable[[float], dict[str, float]]:
    """Estimates without ripple on a servo of a stiffness."""
    return functools.cache(lambda stiffness: estimates(polar, load_system(NAME), table__stiffness=stiffness)[0])


@pytest.mark.parametrize("softer", [1.0, 2.0])
@pytest.mark.parametrize(("phase", "name", "sign"), [(0.0, "D_S", 1.0), (math.pi / 2.0, "D_O", -1.0)])
@pytest.mark.long
def test_ripple_over_stiffness(
    polar: Session, smooth: Callable[[float], dict[str, float]], softer: float, phase: float, name: str, sign: float
) -> None:
    """A torque M sin(theta + p) turns the table by M/K_T sin(theta + p): a servo stiff as K_T answers as an encoder
    wrong by a = M/K_T, with +-a W cos(theta + p) in mounts S and N: a W/(g c) in D_S for p = 0, minus that in D_O for p
    = 90 degrees.  A servo half as stiff doubles it.  [SERVO-TF: a torque changing by dM over T is a rate dM/(K_T T)]
    """
    stiffness, torque = STIFFNESS / softer, 5.0
    a = torque / stiffness
    plain = smooth(stiffness)
    ripple = {"table.ripple": torque, "table.ripple_cycles": 1, "table.ripple_phase": phase}
    found, result = estimates(polar, load_system(NAME), table__stiffness=stiffness, u_angle1=a * FAINT, **ripple)
    shift = {n: found[n] - plain[n] for n in found}
    size = a * W50 / (G * math.cos(PHI)) / DPH
    assert shift[name] == pytest.approx(sign * size, rel=0.01)
    assert max(abs(v) for n, v in shift.items() if n != name) < 0.01 * size
    source = f"angle error, once a turn ({'sine' if phase == 0.0 else 'cosine'})"
    line = next(b for b in result.budget if b.coefficient == name and b.source == source)
    assert line.sensitivity * a == pytest.approx(sign * size, rel=0.02)


class Wobbling(type(load_system(NAME))):  # type: ignore[misc]
    """The test with the part axis_wobble between stand and table."""

    slots: ClassVar[dict[str, Slot]] = {**load_system(NAME).slots, "wobble": Slot(WOBBLE, "axis_wobble")}
    wires = load_system(NAME).wires.replace(
        "stand -> table: f=f_local omega=omega_local",
        "stand -> wobble: f=f_base omega=omega_base\n    wobble -> table: f=f_local omega=omega_local\n"
        "    table -> wobble: angle",
    )


HEAVY = {"gyro.D_I": -9.0 * DPH, "gyro.D_S": -7.0 * DPH}


@pytest.fixture(scope="module")
def wobbling() -> Iterator[tuple[Session, dict[str, float]]]:
    """A session with the wobble, in steps of 2 ms, and the estimates of a run without any."""
    plain_system = polar_at_2_ms()
    system = Wobbling()
    system.name, system.folder, system.step = plain_system.name, plain_system.folder, plain_system.step
    with Session(system) as session:
        yield session, estimates(session, system, **HEAVY)[0]


@pytest.mark.parametrize(("phase", "row"), [(0.0, 0), (math.pi / 2.0, 1)])
@pytest.mark.long
def test_wobble(wobbling: tuple[Session, dict[str, float]], phase: float, row: int) -> None:
    """The axis goes round a cone twice a turn: gravity along the gyro axes changes with it, Earth rate along the input
    axis does not, to first order.  Told by the budget with sign, to 5 % of the largest shift.  (Second order is q2 W,
    at fifty Earth rates 1e-5 deg/h: the gyro has ten times the usual unbalance to stand above it.)
    """
    size = 20.0 * ARCSEC
    session, plain = wobbling
    wobble = {"wobble.amplitude": size, "wobble.phase": phase, "u_wobble": size * FAINT}
    found, result = estimates(session, session.system, **HEAVY, **wobble)
    expected = np.array(next(b for b in result.type_b if b.source.startswith("wobble")).changes)[row] / FAINT
    shift = np.array([found[n] - plain[n] for n in found])
    assert np.max(np.abs(expected)) > 2e-4
    assert np.max(np.abs(shift - expected)) < 0.05 * np.max(np.abs(expected)), (shift, expected)
