"""Errors of the two-axis table and of a wobbling axis: put into the parts, they move the coefficients, with sign, by
what the budget of a run without them says, and entered as corrections they move them no more.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import two_channels
from stated import FAINT
from test_two_axis import DPH, NAME, NAMES, SHORT, quiet
from tumbling import wobbling

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.system import System, load_system

Array = np.ndarray[Any, np.dtype[np.float64]]
ARCSEC = math.pi / 648000.0
HALF = math.pi / 2.0
GYRO = {"D_F": -0.3, "D_I": -0.9, "D_O": 0.6, "D_S": -0.7, "D_II": -0.05, "D_SS": 0.04, "D_IO": 0.1, "D_IS": 0.15}
#: rad/s/sqrt(Hz): above what an error leaves unfitted, far below what it does to a coefficient; the same in all runs
WHITE = 3e-8


def reduced(system: System, record: Record, corrections: str = "") -> Result:
    run = record.run.replace(options={**record.run.options, "corrections": corrections})
    result: Result = system.reduce(type(record)(record.windows, {}, run))
    return result


def told(result: Result, source: str, row: int) -> Array:
    """What the budget says all coefficients change by; a source of several channels stands there for each."""
    changes = [b.changes[row] for b in result.type_b if b.source.startswith(source)]
    return np.array(np.sum(changes, axis=0)) / FAINT


def check(plain: Result, wrong: Result, right: Result, predicted: Array) -> None:
    """The budget is of the weights of the plain run; what an error leaves unfitted changes them by a part."""
    names = [c.name for c in plain.coefficients]
    off, left = (np.array([r[n].estimate - plain[n].estimate for n in names]) for r in (wrong, right))
    largest = float(np.max(np.abs(off)))
    assert np.max(np.abs(off - predicted)) < 0.25 * largest, (off, predicted)
    assert np.max(np.abs(left)) < 0.02 * largest, (left, off)


# ------------------------------------------------------------------------------------------ two-axis tumble
VALUES = {**SHORT, **quiet(), **{f"gyro.{n}": GYRO.get(n, 0.0) * DPH for n in NAMES}, "gyro.white": WHITE}
SOURCES = ("axis", "square", "mount", "angle1", "angle2", "wobble")
VALUES |= {"nuisances": "none"} | {f"u_{n}": 1e-4 * FAINT for n in SOURCES}


@pytest.fixture
def plain(session: Session, fewer_weights: None) -> Result:
    return load_system(NAME).with_values(VALUES).reduce(session.run(VALUES))


def harmonic(axis: int, order: int, row: int) -> dict[str, Any]:
    at = f"[{axis + 1},{order}]"
    return {f"table.encoder_amplitude{at}": 1e-4, f"table.encoder_phase{at}": row * HALF}


def round_a_cone(axis: int, row: int) -> dict[str, Any]:
    return {f"table.wobble[{axis + 1}]": 1e-4, f"table.wobble_phase[{axis + 1}]": row * HALF}


@pytest.mark.parametrize(
    ("error", "source", "row"),
    [
        (harmonic(0, 1, 0), "outer angle error, once a turn", 0),
        (harmonic(0, 2, 1), "outer angle error, twice a turn", 1),
        (harmonic(1, 1, 1), "inner angle error, once a turn", 1),
        (harmonic(1, 2, 0), "inner angle error, twice a turn", 0),
        (round_a_cone(0, 0), "wobble of the outer axis, twice a turn", 0),
        (round_a_cone(0, 1), "wobble of the outer axis, twice a turn", 1),
        (round_a_cone(1, 0), "wobble of the inner axis, twice a turn", 0),
        (round_a_cone(1, 1), "wobble of the inner axis, twice a turn", 1),
        ({"table.squareness": 1e-4}, "table axes out of the right angle", None),
    ],
)
def test_two_axis_tumble(session: Session, plain: Result, error: dict[str, Any], source: str, row: int | None) -> None:
    record = session.run({**VALUES, **error})
    system = load_system(NAME).with_values(VALUES)
    part = (
        f" ({(('sine', 'cosine') if 'angle error' in source else ('phase 0°', 'phase 90°'))[row]})"
        if row is not None
        else ""
    )
    right = reduced(system, record, f"{source}{part} = 1e-4(1e-6) rad")
    check(plain, reduced(system, record), right, told(plain, source, row or 0))


# ------------------------------------------------------------------------------------------ two-channel tumble
@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_wobble_of_the_two_channel_tumble(row: int) -> None:
    """The axis goes round a cone of A twice a turn.  Its rate, 2 A a' (-sin(2a + p), cos(2a + p)) in axes that stand,
    is 2 A a' (-sin(a + p), cos(a + p)) along the table's own, with a = -theta, a' = -R.  The mounts have x = -x_T, y =
    -+y_T, and what the torquers make up for is taken for a drift of minus the rate: 2 A R sin(a + p) about x and -+2 A
    R cos(a + p) about y.

        p = 0        -2 A R sin theta, X = gamma c sin theta: Dx_x by -2 A R/(gamma c);  -+2 A R cos theta,
                     Y = -+gamma c cos theta: Dy_y by +2 A R/(gamma c) in the turns, and the dwells, where Y = -+1 too,
                     hold against it
        p = 90 deg   2 A R cos theta, Y Z = gamma2 s c cos theta: Dx_yz by 2 A R/(gamma2 s c);  -+2 A R sin theta,
                     X Z = -+gamma2 s c sin theta: Dy_xz by 2 A R/(gamma2 s c)

    Tilted gravity and Earth rate add what is of the order W/R = 1/206.
    """
    size = 1e-5
    base = two_channels.load()
    system = wobbling(base)
    values = {**two_channels.SHORT, **two_channels.quiet(base), **two_channels.gyro(np.random.default_rng(4))}
    values |= {"nuisances": "none", "gyro.white_x": 1e-6, "gyro.white_y": 1e-6, "u_wobble": size * FAINT}
    system = system.with_values(values)
    with Session(system) as prepared:
        plain = system.reduce(prepared.run(values))
        record = prepared.run({**values, "wobble.amplitude": size, "wobble.phase": row * HALF})
    wrong = reduced(system, record)
    phi = math.radians(45.75)
    gamma = frames.normal_gravity(phi) / frames.G0
    rate = 2.0 * size * two_channels.RATE / DPH
    first, product = rate / (gamma * math.cos(phi)), rate / (gamma**2 * math.sin(phi) * math.cos(phi))
    expected = {"Dx_x": -first} if row == 0 else {"Dx_yz": product, "Dy_xz": product}
    for c in plain.coefficients:
        shift = wrong[c.name].estimate - c.estimate
        if row == 0 and c.name == "Dy_y":
            assert 0.5 * first < shift < first
        if row == 0 and c.name.startswith("Dy"):
            continue
        assert shift == pytest.approx(expected.get(c.name, 0.0), abs=0.02 * product), c.name
    source = "wobble of the table axis, twice a turn"
    right = reduced(system, record, f"{source} (phase {(0, 90)[row]}°) = {size}(1e-7) rad")
    check(plain, wrong, right, told(plain, source, row))


@pytest.mark.long
def test_each_torquer_and_each_meter_is_corrected_by_itself() -> None:
    """The scale factor of the torquer about y stated too large by 1e-3, its meter reading 1 uA too much: both are of
    the x channel, whose Dx_0 falls by k times 1 uA (0.0172 deg/h); the y channel does not know of them.
    """
    base = two_channels.load()
    values = {**two_channels.SHORT, **two_channels.quiet(base), **two_channels.gyro(np.random.default_rng(4))}
    values |= {"nuisances": "none", "gyro.white_x": 1e-9, "gyro.white_y": 1e-9}
    with Session(base) as prepared:
        record = prepared.run(values)
    k = float(record.run.parameters["gyro.k_y"])
    plain = base.reduce(record)
    windows = {**record.windows, "mean_y": record.windows["mean_y"] + 1e-6}
    run = record.run.replace(options={**record.run.options, "k_y": 1.001 * k})
    off = reduced(base, Record(windows, {}, run))
    known = "scale factor of the torquer about y = 1e-3(1e-5); zero of the y current meter = 1(0.1) uA"
    right = reduced(base, Record(windows, {}, run), known)
    shift = {c.name: off[c.name].estimate - c.estimate for c in plain.coefficients}
    assert shift["Dx_0"] == pytest.approx(-k * 1e-6 / DPH, rel=0.1)
    for c in plain.coefficients:
        assert abs(right[c.name].estimate - c.estimate) < 3e-5, c.name
        assert c.name.startswith("Dx") or shift[c.name] == 0.0
