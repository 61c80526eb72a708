"""Nuisance model of the servo, open-loop and eight-position tests: what is put into the set-up joins and is found."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from servoing import DAY50, DPH, polar_at_2_ms
from servoing_two_axes import day
from stated import FAINT
from undiagnosed import reduce_undiagnosed

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.setup.sources import REMOUNT
from gyrobench.result import DriftTestResult, Specification

ARCSEC = math.pi / 648000.0
HOUR = 3600.0


def reduced(
    record: Record, limits: Specification | None = None, measured: bool = False, **options: Any
) -> DriftTestResult:
    run = record.run.replace(options={**record.run.options, **options}, measured=measured)
    return reduce_undiagnosed(Record(record.windows, {}, run), limits)


def with_columns(record: Record, **columns: Any) -> Record:
    return Record({**record.windows, **columns}, {}, record.run)


def holds(result: DriftTestResult, **joined: float) -> None:
    """The coefficients are true, and the effects that joined are the given ones, with their values in the intervals."""
    effects = {c.name: c for c in result.coefficients if c.truth is None}
    assert set(effects) == set(joined)
    for name, value in joined.items():
        assert effects[name].interval[0] < value < effects[name].interval[1], name
    assert all(abs(c.z or 0.0) < 4.0 for c in result.coefficients)


def worst(result: DriftTestResult, like: DriftTestResult) -> float:
    """Largest error of a coefficient in the u that ``like`` states."""
    return max(abs(c.estimate - c.truth) / like[c.name].u for c in result.coefficients if c.truth is not None)


def candidates(result: DriftTestResult) -> dict[str, str]:
    """Name -> in the model, of the (first) table."""
    return {r[0]: r[6] for t in result.tables if t.title.startswith("Nuisance model") for r in t.rows}


def passes_when_remounts_are_stated(record: Record, *at_rest: str) -> None:
    """As a measured record with a source stated and limits that every coefficient keeps: where each mount is taken once
    the record passes with u_remount alone; without it those coefficients (at_rest) pass that no constant of a mount
    moves.
    """
    wide = {c.name: (-1e3, 1e3) for c in reduced(record).coefficients}
    said = {"u_axis": FAINT}  # more would say something of the constants itself
    bare = reduced(record, wide, measured=True, **said)
    words = " ".join(w for w in bare.warnings if "each mount is taken once" in w)
    assert bare.verdict == "inconclusive"
    assert {c.name for c in bare.coefficients if c.verdict == "pass"} == set(at_rest)
    assert all(f" {c.name}" in words for c in bare.coefficients if c.verdict != "pass")
    stated = reduced(record, wide, measured=True, **said, u_remount=1e-3 * DPH)
    assert stated.verdict == "pass" and any(b.id == REMOUNT.id for b in stated.budget)


def ramped(record: Record, rate: float) -> Record:
    """The record of a servo table whose drift changes by ``rate`` (rad/s2), 0 in the middle of the time held."""
    w = record.windows
    held = np.isin(w["phase"], [r.phase for r in record.run.plan if r.mode == "servo"])
    t0, t1 = w["t_start"][held], w["t_end"][held]
    middle = np.average((t0 + t1) / 2.0, weights=t1 - t0)
    moved = {f"angle_{e}": w[f"angle_{e}"] + rate * (w[f"t_{e}"] - middle) ** 2 / 2.0 for e in ("start", "end")}
    return with_columns(record, **moved)


# ------------------------------------------------------------------------------------------ servo tests
@pytest.mark.long
def test_polar_servo() -> None:
    """A day in fifty.  A ramp of 0.5 deg/h/h in the table angle; 0.02 deg/h/K of a thermometer, which is put into the
    angle by parts: the drift of a window is 0.02 (T - mean).  In the plan without repeats mounts cannot be told.
    """
    with Session(polar_at_2_ms()) as session:
        record = session.run(DAY50, seed=3)
    clean = reduced(record)
    holds(clean)
    assert candidates(clean)["σ_mount"].startswith("not observable")
    passes_when_remounts_are_stated(record, "D_O", "D_S", "D_SS", "D_IO", "D_OS", "D_IS")
    assert candidates(clean)["ε_IS"] == "not observable: aliased with ε_IO"
    ramp = ramped(record, 0.5 * DPH / HOUR)
    holds(reduced(ramp), trend=0.5)
    assert worst(reduced(ramp, nuisances="none"), clean) > 5.0
    w = record.windows
    kelvin = 5.0 * np.cos(2.0 * math.pi * (w["t_start"] + w["t_end"]) / 2.0 / 700.0)
    held = np.isin(w["phase"], [r.phase for r in record.run.plan if r.mode == "servo"])
    turned = np.cumsum(np.where(held, 0.02 * DPH * (kelvin - kelvin[held].mean()) * (w["t_end"] - w["t_start"]), 0.0))
    warm = {
        "angle_start": w["angle_start"] + np.concatenate([[0.0], turned[:-1]]),
        "angle_end": w["angle_end"] + turned,
        "temperature": 293.0 + kelvin,
    }
    holds(reduced(with_columns(record, **warm)), temperature=0.02)


@pytest.mark.long
def test_vertical_and_level_servo() -> None:
    """The input axis 300 arcsec off, which eighteen attitudes tell from the coefficients and six do not; steps of 0.05
    deg/h from mount to mount.
    """
    values = {"dwell": 60.0, "settle": 2.0, "cycles": 1, "attitudes": "all"}
    mount = frames.rotation([0.0, 0.0, 1.0], 300.0 * ARCSEC).T.tolist()  # x' = x + 300 arcsec y
    with Session("servo_vertical_level") as session:
        record = session.run({**values, "gyro.mount": mount}, seed=2)
        six = session.run({**values, "attitudes": "six", "cycles": 3}, seed=2)
    tilted = reduced(record)
    holds(tilted, ε_IO=300.0)
    assert worst(reduced(record, nuisances="none"), tilted) > 5.0
    w = six.windows
    drawn = 0.05 * np.random.default_rng(1).normal(size=int(w["phase"].max()) + 1)
    steps = drawn[np.asarray(w["phase"]).astype(int)] * DPH
    angle = {f"angle_{e}": w[f"angle_{e}"] + steps * w[f"t_{e}"] for e in ("start", "end")}
    result = reduced(with_columns(six, **angle))
    assert candidates(result)["ε_IO"].startswith("not observable: aliased with")
    sigma = result["σ_mount"]
    held = [r.phase for r in six.run.plan if r.mode == "servo"]
    assert sigma.interval[0] < np.std(drawn[held], ddof=1) < sigma.interval[1]
    assert worst(result, result) < 4.0
    clean = reduced(six)
    holds(clean)
    assert worst(result, clean) > 5.0  # more than the noise of this record explains


@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_two_axis_servo() -> None:
    """A day in 500: Dy_0 = 0.5 deg/h ages by 1 % a second, 18 deg/h/h in the y channel; reported is its middle."""
    with Session("servo_two_axis") as session:
        values = {**day(500.0), "gyro.Dy_0": 0.5 * DPH}
        clean, record = (session.run({**values, "gyro.Dy_p0": p}, seed=1) for p in (0.0, 0.01))
    assert all(c.truth is not None for c in reduced(clean).coefficients)
    passes_when_remounts_are_stated(clean, "Dx_xz", "Dy_xz")
    ageing = reduced(record)
    assert [c.name for c in ageing.coefficients if c.truth is None] == ["trend,y"]
    trend = ageing["trend,y"]
    assert trend.interval[0] < 18.0 < trend.interval[1] < 19.0
    w = record.windows
    held = np.isin(w["phase"], [r.phase for r in record.run.plan if r.mode == "servo"])
    middle = float(np.mean((w["t_start"] + w["t_end"])[held] / 2.0))
    assert abs(ageing["Dy_0"].estimate - 0.5 * (1.0 + 0.01 * middle)) < 4.0 * ageing["Dy_0"].u
    assert all(abs(c.z or 0.0) < 4.0 for c in ageing.coefficients if c.name != "Dy_0")
    plain = reduced(record, nuisances="none")
    assert plain["Dy_0"].u > 3.0 * ageing["Dy_0"].u


# ------------------------------------------------------------------------------------------ tumbles
@pytest.mark.long
def test_two_axis_tumble() -> None:
    """25 positions of a gyro turned by 1500 arcsec about its spin axis, x' = x + 1500 arcsec y, and about its output
    axis, x' = x + 1500 arcsec z: the Earth rate across is seen by the cosine and the sine of the inner angle, and D_O
    and D_S take 0.9 of it where nothing else may.
    """
    values = {
        "positions": 25, "dwell": 4.0, "settle": 3.0, "inner_rate": 0.05, "rebalance.i_max": 1.0,
        "table.index_rate[1]": 1.0, "table.acceleration": [1.0, 1.0],
    }  # fmt: skip
    with Session("tumble_two_axis") as session:
        clean = reduced(session.run(values, seed=2))
        for axis, name, sign in (([0.0, 0.0, 1.0], "ε_IO", 1.0), ([0.0, 1.0, 0.0], "ε_IS", -1.0)):
            mount = frames.rotation(axis, sign * 1500.0 * ARCSEC).T.tolist()
            tilted = session.run({**values, "gyro.mount": mount}, seed=2)
            holds(reduced(tilted), **{name: 1500.0})
            assert worst(reduced(tilted, nuisances="none"), clean) > 3.0
    holds(clean)


def test_two_channel_tumble() -> None:
    with Session("tumble_two_channel") as session:
        values = {"rate": 0.15, "windows": 24, "dwell": 17.5, "settle": 2.0, "table.acceleration": 20.0}
        record = session.run({**values, "latitude": math.radians(45.75)}, seed=4)
    squares = ("Dx_xx", "Dx_xy", "Dx_yz", "Dx_xz", "Dy_yy", "Dy_xy", "Dy_xz", "Dy_yz")
    passes_when_remounts_are_stated(record, "Dx_x", "Dy_x", "Dy_y", *squares)


# ------------------------------------------------------------------------------------------ others
@pytest.mark.long
def test_open_loop() -> None:
    """Ageing by D_F p_F t, -0.3 deg/h 1e-3/s in 25 readings: -1.08 deg/h/h."""
    with Session("open_loop_drift") as session:
        values = {"dwell": 1.0, "pairs": 12}
        record = session.run({**values, "gyro.p_F": 1e-3}, seed=1)
        clean = reduced(session.run(values, seed=1))
    assert len(clean.coefficients) == 1
    result = reduced(record)
    trend = result["trend"]
    assert abs(trend.estimate + 1.08) < 4.0 * trend.u < 0.5, trend
    assert reduced(record, nuisances="none").coefficients[0].u > 2.0 * result.coefficients[0].u


@pytest.mark.long
def test_eight_positions() -> None:
    """The gyro turned by 300 arcsec about its spin axis: x' = x + 300 arcsec y, y' = y - 300 arcsec x."""
    values = {"dwell": 6.0, "settle": 2.0, "readings": 2, "cycles": 6}
    mount = frames.rotation([0.0, 0.0, 1.0], 300.0 * ARCSEC).T.tolist()
    with Session("eight_position") as session:
        clean = reduced(session.run(values, seed=1))
        record = session.run({**values, "gyro.mount": mount}, seed=1)
    holds(clean)
    assert set(candidates(clean)) == {"ε_xy", "trend,x", "k_±,x", "ε_yx", "trend,y", "k_±,y"}
    turned = reduced(record)
    holds(turned, ε_xy=300.0, ε_yx=-300.0)
    assert worst(reduced(record, nuisances="none"), clean) > 5.0


def test_days_of_which_some_have_a_trend() -> None:
    """Three days of a fixed position, the last two with ageing: what they have in common is combined."""
    from gyrobench.record.multi_day_record import combine

    values = {"readings": 20, "dwell": 200.0, "settle": 3.0, "gyro.white": 0.002 * DPH}
    with Session("fixed_position") as session:
        days = [session.run(values, seed=s) for s in range(3)]
    for d in days[1:]:
        d.windows["mean"] = d.windows["mean"] + 1e-5 * np.linspace(-1.0, 1.0, 20)
    assert [len(reduced(d).coefficients) for d in days] == [1, 2, 2]
    result = reduced(combine(days, ["a", "b", "c"]))
    assert [c.name for c in result.coefficients] == ["ω_d"] and result.dof == 2.0
