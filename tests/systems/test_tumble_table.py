"""The tumble on a table whose encoder errs and whose axis wobbles: the coefficients move, with sign, by what the
formula says, and the error budget of a run without the error has said it before.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from stated import FAINT
from tumbling import DPH, NAME, NAMES, RATE, SHORT, load, quiet, wobbling

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.result import Result
from gyrobench.system.system import System

Array = np.ndarray[Any, np.dtype[np.float64]]
PHI = math.radians(45.75)
GAMMA = frames.normal_gravity(PHI) / frames.G0
C, S = math.cos(PHI), math.sin(PHI)
D_I, D_S = 0.9, -0.7  # deg/h/g
ERROR = 1e-4  # rad
#: rad/s/sqrt(Hz): 1e-9 rad/s in a window, above what an error leaves unfitted (taken for slow noise it would change the
#: weights) and far below what it does to a coefficient, as both runs have the same noise
WHITE = 3e-9
WOBBLE = 1e-5  # rad


def tumble(session: Session, system: System, **values: Any) -> Result:
    """A gyro with D_I and D_S alone, noise off."""
    ideal = {**SHORT, **quiet(load()), **{f"gyro.{n}": 0.0 for n in NAMES}}
    ideal |= {"gyro.D_I": D_I * DPH, "gyro.D_S": D_S * DPH} | {"nuisances": "none"}
    given = {**ideal, **{k.replace("__", "."): v for k, v in values.items()}}
    return system.with_values(given).reduce(session.run(given))


def shifts(found: Result, plain: Result, what: str) -> Array:
    pairs = zip(found.coefficients, plain.coefficients, strict=True)
    return np.array([getattr(a, what) - getattr(b, what) for a, b in pairs])


def told(result: Result, source: str, row: int) -> Array:
    """What the budget says the coefficients change by."""
    return np.array(next(b for b in result.type_b if b.source == source).changes)[row] / FAINT


def check(shift: Array, expected: dict[str, float], part: float) -> None:
    """To ``part`` of the largest that is expected."""
    wanted = np.array([expected.get(n, 0.0) for n in NAMES])
    assert np.max(np.abs(shift - wanted)) < part * np.max(np.abs(wanted)), (shift, wanted)


@pytest.fixture
def plain(session: Session, fewer_weights: None) -> Result:
    return tumble(session, load(), gyro__white=WHITE, u_angle1=ERROR * FAINT, u_angle2=ERROR * FAINT)


HALF = math.pi / 2.0
ZERO = {"D_F": -D_I * GAMMA * C * ERROR}  # a dwell whose angle is read as `ERROR` is believed to have X = gamma c ERROR
IN_TURNS = D_I * ERROR / (GAMMA * C)


@pytest.mark.parametrize(
    ("order", "phase", "closed", "fitted"),
    [
        (1, HALF, {"D_SS": -IN_TURNS, "D_IS": D_S * ERROR / (GAMMA * C)},
         {**ZERO, "D_II": IN_TURNS, "D_IS": D_S * ERROR / (GAMMA * C)}),
        (2, 0.0, {"D_I": -D_I * ERROR / 2.0, "D_S": D_S * ERROR / 2.0}, {}),
        (2, HALF, {"D_OS": -D_I * ERROR / (2.0 * GAMMA * S), "D_IO": -D_S * ERROR / (2.0 * GAMMA * S)},
         {**ZERO, "D_II": IN_TURNS, "D_SS": IN_TURNS}),
    ],
)  # fmt: skip
def test_encoder_harmonic(
    session: Session, plain: Result, order: int, phase: float, closed: dict[str, float], fitted: dict[str, float]
) -> None:
    """The angle b is read where it is a = b - E sin(n b + p).  In the turns X = G sin a, Z = -+G cos a (G = gamma c,
    mounts 1 and 2) give

        D_I X = D_I G (sin b - E cos b sin(n b + p))        D_S Z = -+D_S G (cos b + E sin b sin(n b + p))

    n = 1, p = 90 deg   -D_I G E (1 + cos 2b)/2 in both mounts: D_SS by -D_I E/G;  -+D_S G E sin(2b)/2: D_IS by D_S E/G
    n = 2, p = 0        cos b sin 2b = (sin b + sin 3b)/2, sin b sin 2b = (cos b - cos 3b)/2: -E/2 of D_I, E/2 of D_S
    n = 2, p = 90 deg   -D_I G E cos(b)/2 in both mounts: D_OS by -D_I E/(2 gamma s);  D_IO by -D_S E/(2 gamma s)

    These are the closed formulas, blind to the angle of a dwell.  Least squares takes the reading E cos 0 of the dwells
    for X = G E and lowers D_F by D_I G E; the constants of the turns, 0 or -D_I G E/2, then raise D_II + D_SS.
    """
    wrong = {f"table.encoder_amplitude[{order}]": ERROR, f"table.encoder_phase[{order}]": phase}
    found = tumble(session, load(), gyro__white=WHITE, **wrong)
    check(shifts(found, plain, "closed"), closed, 0.05)
    both = {**closed, **fitted}
    if order == 1:
        both["D_SS"] = 0.0  # -D_I E/G by the second harmonic, +D_I E/G by the constants: all of it is D_II
    shift = shifts(found, plain, "estimate")
    check(shift, both, 0.05)
    source = f"angle error, {('once', 'twice')[order - 1]} a turn"
    predicted = told(plain, source, 0 if phase == 0.0 else 1)
    check(shift, dict(zip(NAMES, predicted, strict=True)), 0.05)


def test_encoder_in_phase_once_a_turn(session: Session, plain: Result) -> None:
    """n = 1, p = 0: -D_I G E sin(2b)/2 in both mounts and -+D_S G E (1 - cos 2b)/2 are no term of the formulas.  Least
    squares has D_O from the constants of the turns too, -+D_S G E/2 = -+D_O gamma s; how much weight they have beside
    the dwells the noise decides: white here.
    """
    found = tumble(session, load(), gyro__white=WHITE, **{"table.encoder_amplitude[1]": ERROR})
    assert np.max(np.abs(shifts(found, plain, "closed"))) < 0.05 * abs(D_S) * ERROR
    shift = shifts(found, plain, "estimate")
    predicted = told(plain, "angle error, once a turn", 0)
    most = D_S * ERROR * C / (2.0 * S)
    assert 0.1 < predicted[NAMES.index("D_O")] / most < 0.9
    check(shift, dict(zip(NAMES, predicted, strict=True)), 0.1)


@pytest.mark.parametrize("phase", [0.0, HALF])
@pytest.mark.long
def test_wobble(phase: float) -> None:
    """The axis goes round a cone of A twice a turn.  Its rate, 2 A a' (-sin(2a + p), cos(2a + p)), stands along the
    input axis as -2 A a' sin(a + p), with a' = -R in both mounts, and is taken for a drift of -2 A R sin(a + p): in
    phase with X it is D_I by -2 A R/(gamma c), with p = 90 degrees D_OS by -2 A R/(gamma2 s c).  What tilted gravity
    and Earth rate add is of the order W/R = 1/274, and of the drift.  The budget has it all.
    """
    system = wobbling(load())
    with Session(system) as session:
        before = tumble(session, system, u_wobble=WOBBLE * FAINT)
        found = tumble(session, system, wobble__amplitude=WOBBLE, wobble__phase=phase)
    size = -2.0 * WOBBLE * RATE / (GAMMA * C) / DPH
    expected = {"D_I": size} if phase == 0.0 else {"D_OS": size / (GAMMA * S)}
    shift = shifts(found, before, "estimate")
    check(shift, expected, 0.02)
    predicted = told(before, "wobble of the table axis, twice a turn", 0 if phase == 0.0 else 1)
    check(shift, dict(zip(NAMES, predicted, strict=True)), 2e-3)
    assert system.name == NAME
