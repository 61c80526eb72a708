"""A measured error of the set-up entered as a correction: the coefficients are those of a set-up without it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from reducing import turned
from servoing import QUIET
from tumbling import DPH, NAMES, SHORT, load, quiet

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "tumble_single_axis"

ARCSEC = math.pi / 648000.0
GYRO = {"D_F": -0.3, "D_I": -0.9, "D_O": 0.1, "D_S": -0.7, "D_II": -0.05, "D_SS": 0.04}  # deg/h/g^n


def corrected(record: Record, corrections: str = "") -> Result:
    """The result of a run in which these are stated."""
    run = record.run.replace(options={**record.run.options, "corrections": corrections})
    return load_system(run.system).reduce(Record(record.windows, record.channels, run))


def check(plain: Result, wrong: Result, right: Result, part: float, least: float) -> None:
    """Shifted by ``least`` (printed units) at least by the error, and by ``part`` of that at most when it is known."""
    names = [c.name for c in plain.coefficients]
    off, left = (np.array([r[n].estimate - plain[n].estimate for n in names]) for r in (wrong, right))
    assert np.max(np.abs(off)) > least, off
    assert np.max(np.abs(left)) < part * np.max(np.abs(off)), (left, off)


TUMBLE = [
    ({"table.tilt[1]": 20.0 * ARCSEC}, "table axis off the pole, about east", 20.0),
    ({"table.tilt[2]": 20.0 * ARCSEC}, "table axis off the pole, about p × east", 20.0),
    ({"gyro.mount": turned(2, 20.0 * ARCSEC)}, "input axis towards output axis", 20.0),
    ({"gyro.mount": turned(1, -60.0 * ARCSEC)}, "input axis towards spin axis", 60.0),
    ({"gyro.mount": turned(0, 60.0 * ARCSEC)}, "gyro turned about its input axis", 60.0),
    ({"table.encoder_amplitude[1]": 60.0 * ARCSEC}, "angle error, once a turn (sine)", 60.0),
    (
        {"table.encoder_amplitude[2]": 60.0 * ARCSEC, "table.encoder_phase[2]": math.pi / 2},
        "angle error, twice a turn (cosine)",
        60.0,
    ),
]


TUMBLED = {**SHORT, **quiet(load()), **{f"gyro.{n}": GYRO.get(n, 0.0) * DPH for n in NAMES}}
TUMBLED |= {"gyro.white": 3e-9, "nuisances": "none"}


@pytest.fixture(scope="module")
def plain(session: Session) -> Result:
    return corrected(session.run(TUMBLED, seed=1))


@pytest.mark.parametrize(("error", "source", "size"), TUMBLE)
@pytest.mark.long
def test_tumble(session: Session, plain: Result, error: dict[str, Any], source: str, size: float) -> None:
    """Even an input axis tilted by 20 arcsec, which without the correction is taken for slow noise in part."""
    record = session.run({**TUMBLED, **error}, seed=1)
    wrong, right = corrected(record), corrected(record, f"{source} = {size}(1) arcsec")
    check(plain, wrong, right, 0.05 if "angle" in source else 0.02, 2e-5)  # an encoder moves the windows too
    (table,) = [t for t in right.tables if t.title == "Corrections"]
    assert table.rows[0][:2] == [source, pytest.approx(size * ARCSEC)]


def test_the_correction_brings_its_own_uncertainty(session: Session) -> None:
    """u_axis = 10 arcsec without it, 2 arcsec with it, about east alone: W u/(gamma cos phi) in D_I; signs of lines."""
    gyro = {f"gyro.{n}": 0.0 for n in NAMES}
    values = {**SHORT, **quiet(load()), **gyro, "gyro.white": 3e-9, "u_axis": 10.0 * ARCSEC}
    source = "table axis off the pole, about east"
    record = session.run(values, seed=1)
    plain, known = (corrected(record, text) for text in ("", f"{source} = 0(2) arcsec"))
    gamma = frames.normal_gravity(math.radians(45.75)) / frames.G0
    per = frames.EARTH_RATE / DPH / (gamma * math.cos(math.radians(45.75)))
    for result, size in ((plain, 10.0), (known, 2.0)):
        (line,) = [b for b in result.budget if b.source == source and b.coefficient == "D_I"]
        assert line.contribution == pytest.approx(per * size * ARCSEC, rel=1e-3)
        assert line.sensitivity == pytest.approx(-per, rel=1e-3)  # D_I falls, see test_axis_off_the_pole_about_east
        c = result["D_I"]
        assert c.u_a is not None and c.u == pytest.approx(math.hypot(c.u_a, line.contribution), rel=1e-3)


@pytest.fixture(scope="module")
def level() -> Iterator[Session]:
    with Session("servo_vertical_level") as prepared:
        yield prepared


@pytest.mark.parametrize(
    ("axis", "source"), [(2, "input axis towards output axis"), (1, "input axis towards spin axis")]
)
@pytest.mark.long
def test_servo_table(level: Session, axis: int, source: str) -> None:
    """The gyro turned about its spin axis brings the input axis towards the output axis; about minus the output axis,
    towards the spin axis.
    """
    sign = 1.0 if axis == 2 else -1.0
    values = {**QUIET, **{f"gyro.{n}": 0.0 for n in NAMES}, "dwell": 60.0, "settle": 2.0, "cycles": 1, "tracking": 0.0}
    wrong = {**values, "gyro.mount": turned(axis, sign * 60.0 * ARCSEC)}
    plain, off = (level.run(v, seed=1) for v in (values, wrong))
    check(corrected(plain), corrected(off), corrected(off, f"{source} = 60(1) arcsec"), 0.02, 1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("table axis = 1(1) arcsec", "no source 'table axis'; meant is perhaps 'table axis off the pole, about east'"),
        ("torquer scale factor = 1e-4", "is not of the form 'SOURCE = VALUE(U) UNIT"),
        ("torquer scale factor = 1e-4(1e-5) arcsec", "torquer scale factor: "),
        ("torquer scale factor = 1e-4(-1e-5)", "must not be negative"),
        ("torquer scale factor = 1e-4(1e-5); torquer scale factor = 1e-4(1e-5)", "a source stands twice"),
    ],
)
def test_refused(session: Session, text: str, words: str) -> None:
    values = {**SHORT, **quiet(load()), "gyro.white": 3e-9}
    record = session.run(values, seed=1)
    with pytest.raises(ReductionError, match=re.escape(words)):
        corrected(record, text)


def test_a_source_that_no_test_has_is_refused_before_the_run() -> None:
    """By name, by the name of a part, by id; all of a test pass, of which some belong to another one."""
    stated = {"table axis off the polle, about east": "table axis off the pole, about east",
              "angle error, once a turn (sin)": "angle error, once a turn (sine)",
              "torquer.scale": "torquer scale factor"}  # fmt: skip
    for source, meant in stated.items():
        with pytest.raises(
            InvalidConfigurationError, match=re.escape(f"no source '{source}'; meant is perhaps '{meant}'")
        ):
            load_system(NAME).with_values({"corrections": f"{source} = 1(1) arcsec"}).refuse()
    known = [*(source for _, source, _ in TUMBLE), "angle.once.sine", "torquer.scale_factor", "latitude"]
    load_system(NAME).with_values({"corrections": "; ".join(f"{source} = 1(1)" for source in known)}).refuse()
