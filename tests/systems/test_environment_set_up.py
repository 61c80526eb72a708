"""Errors of the set-up of table_environment: simulated, by hand, as corrections, and held where they are stated."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.result import Result

NAME = "table_environment"
DPH = ARCSEC = math.pi / 648000.0
R = 120.0 * ARCSEC  # 5.818e-4 rad
PHI = math.radians(30.0)
#: s_E = g D_S = 1.5, s_N = g D_I = -2 deg/h per rad, apart from g = 0.9986 and squares of nothing
GYRO = {"D_S": 1.5, "D_I": -2.0, "D_IO": 0.0, "D_OS": 0.0, "D_IS": 0.0, "D_SS": 0.0}
PLAN = {"dwell": 1200.0, "readings": 60, "latitude": PHI, "tilting": 20.0 * ARCSEC}
G = frames.normal_gravity(PHI) / frames.G0
W = frames.EARTH_RATE / DPH  # deg/h


def values(session: Session, more: dict[str, Any]) -> dict[str, Any]:
    gyro = {f"gyro.{n}": v * DPH for n, v in GYRO.items()}
    return {**dict.fromkeys(session.system.noises, 0.0), **PLAN, **gyro, "gyro.white": 1e-11, **more}


def reduced(session: Session, more: dict[str, Any], corrections: str = "") -> Result:
    given = values(session, {**more, "corrections": corrections, "nuisances": "none"})
    return session.system.with_values(given).reduce(session.run(given, seed=1, step=5e-3))


def turned(axis: int) -> dict[str, Any]:
    return {"gyro.mount": frames.rotation(np.eye(3)[axis], R).T.tolist()}


CASES = [
    # a tilt about east: s_E r in the constant
    (turned(0), "gyro turned about its input axis", {"ω_0": G * 1.5 * R}),
    # input axis towards north: -r W cos phi in the constant; the rate of tilting about north, which is nearly at right
    # angles to all columns, moves s_E and s_N more than -r W sin phi - r s_N and r s_E
    (turned(1), "gyro turned about its output axis", {"ω_0": -R * W * math.cos(PHI)}),
    # input axis up: -r W sin phi - s_N r in the constant; s_E by r W cos phi
    (turned(2), "gyro turned about its spin axis",
     {"ω_0": -R * W * math.sin(PHI) + 2.0 * G * R, "s_E": R * W * math.cos(PHI) * ARCSEC}),
]  # fmt: skip


@pytest.mark.parametrize(("error", "source", "by_hand"), CASES, ids=[c[1] for c in CASES])
@pytest.mark.long
def test_an_error_is_predicted_and_taken_out(
    session: Session, error: dict[str, Any], source: str, by_hand: dict[str, float]
) -> None:
    """ω_0 in deg/h, s_E and s_N in deg/h per arcsec; the rest of their squares."""
    plain, wrong = reduced(session, {}), reduced(session, error)
    right = reduced(session, error, f"{source} = 120(1) arcsec")
    (said,) = [t for t in wrong.tables if t.id == PREDICTED]
    shift = {row[0]: row[-3] for row in said.rows}
    for name, x in by_hand.items():
        assert wrong[name].estimate - plain[name].estimate == pytest.approx(x, rel=0.03), name
    for name in ("ω_0", "s_E", "s_N"):
        off, left = (r[name].estimate - plain[name].estimate for r in (wrong, right))
        least = {"ω_0": 1e-5}.get(name, 5e-10)  # squares of R times the sensitivities
        assert shift[name] == pytest.approx(off, rel=0.3, abs=least), name  # what no column holds is weighed as noise
        assert abs(left) < max(0.03 * abs(off), least), name


def test_scales_by_hand(session: Session) -> None:
    """A scale that reads 1 % too much makes its own sensitivity 1 % small and no other; k that is stated 1 % too large
    makes all of them 1 % large; 1 uA too much are -k 1 uA of the constant.
    """
    given = values(session, {"u_scales": 0.01, "u_scale_factor": 0.01, "u_current": 1e-6})
    r = session.system.with_values(given).reduce(session.run(given, seed=1, step=5e-3))
    part = {(b.source, b.coefficient): (b.sensitivity, b.contribution) for b in r.budget}
    for cause, name in (("tilt east", "s_E"), ("tilt north", "s_N"), ("temperature", "s_T"), ("difference", "s_dT"),
                        ("field", "s_B"), ("ground rate", "s_rate")):  # fmt: skip
        x = r[name].estimate
        assert part[f"scale of the {cause}", name] == pytest.approx((-x, abs(0.01 * x)), rel=1e-4)
        others = {c for s, c in part if s == f"scale of the {cause}"} - {name}
        assert all(part[f"scale of the {cause}", c][1] < 1e-3 * r[c].u for c in others)
        assert part["torquer scale factor", name] == pytest.approx((x, abs(0.01 * x)), rel=1e-4)
    assert part["offset of the current reading", "ω_0"] == pytest.approx((-17200.0, 0.0172), rel=1e-3)


@pytest.mark.long
def test_stated_mounts_are_held(session: Session) -> None:
    """Forty mounts of 60 arcsec about each axis, noise of 1e-4 deg/h in a window: stated, 0.85 or more of the
    intervals of ω_0, s_E and s_N hold; not stated, less than a quarter of those of ω_0.
    """
    record = session.run(values(session, {}), seed=1, step=5e-3)
    rng, w = np.random.default_rng(5), record.windows
    k = float(record.run.parameters["gyro.k"])
    qE, qN, middle = w["tilt_east"], w["tilt_north"], (w["t_start"] + w["t_end"]) / 2.0
    north, up = (frames.EARTH_RATE * f(PHI) for f in (math.cos, math.sin))
    sE, sN = 1.5 * G * DPH, -2.0 * G * DPH
    truth = {c.name: c.truth for c in session.system.reduce(record).coefficients}
    held = np.zeros((2, 3))
    for _ in range(40):
        a, b, c = 60.0 * ARCSEC * rng.normal(size=3)
        more = a * sE - b * (north + qE * up + np.gradient(qN, middle)) + b * (sE * qN - sN * qE)
        more = more - c * (up - qE * north) - c * sN + 1e-4 * DPH * rng.normal(size=middle.size)
        windows = {**w, "mean": w["mean"] - more / k}
        for j, size in enumerate((60.0 * ARCSEC, 0.0)):
            run = record.run.replace(options={**record.run.options, "u_mount": size})
            r = session.system.reduce(Record(windows, record.channels, run))
            held[j] += [abs(r[n].estimate - truth[n]) <= r[n].k * r[n].u for n in ("ω_0", "s_E", "s_N")]
    assert held[0].min() >= 34 and held[1, 0] < 10
