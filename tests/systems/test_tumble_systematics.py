"""Errors of the set-up, put into the parts: what the co-simulation shows is what the formulas of the README say."""

from __future__ import annotations

import math
from typing import Any

import pytest
from tumbling import DPH, NAMES, RATE, SHORT, load, quiet

from gyrobench import frames
from gyrobench.engine.session import Session

NAME = "tumble_single_axis"

W = frames.EARTH_RATE / DPH  # 15.041 deg/h
PHI = math.radians(45.75)
GAMMA = frames.normal_gravity(PHI) / frames.G0
C, S = math.cos(PHI), math.sin(PHI)
TEN = math.radians(10.0 / 3600.0)  # 10 arcsec


def tumble(session: Session, **values: Any) -> tuple[dict[str, float], dict[str, float], Any]:
    """Estimates and closed formulas (deg/h per g^n) of a gyro without drift, noise off: errors of the set-up alone."""
    ideal = {**SHORT, **quiet(load()), **{f"gyro.{n}": 0.0 for n in NAMES}}
    given = {**ideal, **{k.replace("__", "."): v for k, v in values.items()}}
    result = load().with_values(given).reduce(session.run(given))
    closed = {c.name: c.closed for c in result.coefficients if c.closed is not None}
    return {c.name: c.estimate for c in result.coefficients}, closed, result


def expect(found: dict[str, float], **expected: float) -> None:
    for name in NAMES:
        assert found[name] == pytest.approx(expected.get(name, 0.0), rel=1e-3, abs=1e-7), name


def test_axis_off_the_pole_about_east(session: Session) -> None:
    """The pole has the part W delta along the second table axis; the input axis sees it once a turn, in phase with X:
    W delta/(gamma cos phi) in D_I, nothing else: 1.05e-3 deg/h/g for 10 arcsec.  [TUM1-SENS-AXIS]
    """
    found, closed, _ = tumble(session, **{"table.tilt": [TEN, 0.0]})
    size = W * TEN / (GAMMA * C)
    assert size == pytest.approx(1.05e-3, rel=0.01)
    expect(found, D_I=-size)
    expect(closed, D_I=-size)


def test_axis_off_the_pole_about_its_second_axis(session: Session) -> None:
    """Now W delta stands east at angle 0: cosines with one sign in both mounts are D_OS, 2 W delta/(gamma2 sin 2 phi) =
    1.46e-3.  The dwells see W delta on their input axis too, as the mounts stand on the same base: D_F by W delta, and
    D_II, D_SS by -W delta/(gamma2 cos2 phi).
    """
    found, closed, _ = tumble(session, **{"table.tilt": [0.0, TEN]})
    east = W * TEN
    expected = {"D_OS": 2 * east / (GAMMA**2 * math.sin(2 * PHI)), "D_F": east}
    expected |= dict.fromkeys(("D_II", "D_SS"), -east / (GAMMA * C) ** 2)
    expect(found, **expected)
    expect(closed, **expected)


def towards_output(eps: float) -> list[list[float]]:
    """A mount with its input axis tilted by eps towards the output axis, turned about the spin axis."""
    c, s = math.cos(eps), math.sin(eps)
    return [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]


def test_input_axis_tilted_towards_the_output_axis(session: Session) -> None:
    """The input axis sees eps (W + table rate) with opposite sign in the two mounts, and eps W sin phi in the dwells.
    The closed formulas feel the dwells only: eps W sin(phi)/gamma in D_O.  [TUM1-SENS-IA]  Least squares that knows of
    the tilt (option tilt) finds it and has no error; the tilt in arcsec is what was put in.
    """
    eps = 3e-4
    _, closed, _ = tumble(session, gyro__mount=towards_output(eps))
    expect(closed, D_O=eps * W * S / GAMMA)
    found, _, result = tumble(session, gyro__mount=towards_output(eps), tilt=True)
    expect(found)
    (tilt,) = [c for c in result.coefficients if c.name not in NAMES]
    assert tilt.unit == "″"
    assert tilt.estimate == pytest.approx(math.degrees(eps) * 3600.0, rel=1e-6)
    assert eps * RATE > 0.1 * DPH  # it is a large disturbance: eps times the table rate


@pytest.mark.long
def test_tilt_that_the_data_show_is_estimated(session: Session) -> None:
    """With noise: 62 arcsec join the model and are reported with an interval; where there is none, nine coefficients.
    Without nuisances they go into the coefficients.
    """
    for eps, seen in ((3e-4, True), (0.0, False)):
        values = {**SHORT, "gyro.mount": towards_output(eps)}
        for seed in range(3):
            record = session.run(values, seed=seed)
            result = load().with_values(values).reduce(record)
            names = [c.name for c in result.coefficients]
            assert ("ε_IO" in names) == seen and len(names) == 9 + seen
            assert all(c.truth is None or abs(c.estimate - c.truth) < 4.0 * c.u for c in result.coefficients)
            table = next(t for t in result.tables if t.title == "Nuisance model")
            assert [row[0] for row in table.rows] == ["ε_IO", "trend", "k_±", "δk", "σ_mount"]
            if seen:
                tilt = result.coefficients[-1]
                assert tilt.interval[0] < math.degrees(eps) * 3600.0 < tilt.interval[1]
                assert any("In the model: misalignment of the input axis" in s for s in result.summary)
                run = record.run.replace(options={**record.run.options, "nuisances": "none"})
                plain = load().reduce(type(record)(record.windows, {}, run))
                off = [abs(c.estimate - (c.truth or 0.0)) / result[c.name].u for c in plain.coefficients]
                assert len(off) == 9 and max(off) > 10.0


def test_scale_factor_error_scales_everything(session: Session) -> None:
    """The input rate is 0 everywhere, so y = -k i: k wrong by 1e-3 makes every coefficient wrong by 1e-3."""
    truth = {"gyro.D_F": 0.3 * DPH, "gyro.D_I": 0.9 * DPH, "gyro.D_IS": -0.2 * DPH}
    k = 17.2e3 * DPH
    found, _, _ = tumble(session, **truth, k=1.001 * k)
    expect(found, **{n[5:]: 1.001 * v / DPH for n, v in truth.items()})


def test_rate_ripple_once_a_turn(session: Session) -> None:
    """A rate W_t (1 + r sin theta) of the table gives it r W_t2 cos(theta) of acceleration about the output axis, which
    J/H turns into a rate: cosines with opposite sign in the mounts are D_IO, 2 (J/H) r W_t2/(gamma2 sin 2 phi).  It
    needs more than a hundred Earth rates and a large r to be seen.
    """
    r, j_h = 5e-3, 1e-3
    found, closed, _ = tumble(session, table__ripple=r, table__ripple_cycles=1)
    size = 2.0 * j_h * r * RATE**2 / (GAMMA**2 * math.sin(2 * PHI)) / DPH
    assert size > 5e-4
    for shown in (found, closed):
        assert shown["D_IO"] == pytest.approx(size, rel=0.01)
        assert max(abs(v) for n, v in shown.items() if n != "D_IO") < 0.01 * size


def test_rate_ripple_with_a_tilted_input_axis(session: Session) -> None:
    """An input axis tilted by eps towards the output axis sees eps W_t r sin(theta), with opposite sign in the mounts,
    as the spin axis's Z: -eps W_t r/(gamma cos phi) in D_S of the closed formulas, besides what the tilt itself does.
    """
    eps, r = 3e-4, 5e-3
    _, plain, _ = tumble(session, gyro__mount=towards_output(eps))
    _, closed, _ = tumble(session, gyro__mount=towards_output(eps), table__ripple=r, table__ripple_cycles=1)
    shift = {n: closed[n] - plain[n] for n in closed}
    size = eps * RATE * r / (GAMMA * C) / DPH
    assert shift.pop("D_S") == pytest.approx(-size, rel=0.01)
    assert shift.pop("D_IO") == pytest.approx(2.0e-3 * r * RATE**2 / (GAMMA**2 * math.sin(2 * PHI)) / DPH, rel=0.01)
    assert max(map(abs, shift.values())) < 0.01 * size
