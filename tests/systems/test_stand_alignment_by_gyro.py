"""Alignment with a north finder in place of Polaris: recovery, what its heading does, hand-over, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.engine.session import Session
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "stand_alignment"
ARCSEC, DEG = math.pi / 648000.0, math.pi / 180.0
QUIET = {"theodolite.pointing": 0.0, "theodolite.bubble": 0.0}
PLAN = {"by": "gyro", "sets": 2, "settle": 2.0, "dwell": 2.0}


def reduced(session: Session, values: dict[str, Any], seed: int = 1) -> Any:
    record = session.run({**PLAN, **values}, seed=seed)
    return session.system.with_values(record.run.options).reduce(record)


def test_everything_comes_back(session: Session) -> None:
    """Without noise, to 0.01 arcsec, at latitudes of both hemispheres; the trunnion is not estimated without a star."""
    rng = np.random.default_rng(8)
    for latitude in (-33.0, 2.0, 60.0):
        a, e, c, z = rng.normal(size=4) * 20.0 * ARCSEC
        set_ = {"theodolite.azimuth": a, "theodolite.elevation": e, "theodolite.collimation": c,
                "theodolite.inclinometer_zero": z, "theodolite.trunnion": 30.0 * ARCSEC}  # fmt: skip
        found = reduced(session, {**QUIET, **set_, "latitude": latitude * DEG, "heading": "137deg"})
        got = {c.name: c.estimate for c in found.coefficients}
        assert "trunnion" not in got
        wanted = {
            "about east": e,
            "about p × east": a * math.cos(latitude * DEG),
            "collimation": c,
            "inclinometer zero": z,
        }
        for name, value in wanted.items():
            assert got[name] == pytest.approx(value / ARCSEC, abs=0.01), name


def test_a_wrong_heading_goes_into_the_azimuth_in_full(session: Session) -> None:
    """The head 30 arcsec to the east of what the finder said: a is off by -30 cos(latitude), as the budget says."""
    values = {**QUIET, "theodolite.head": 20.0 * DEG + 30.0 * ARCSEC, "u_heading": 30.0 * ARCSEC}
    found = reduced(session, values)
    across = next(c for c in found.coefficients if c.name == "about p × east")
    cos = math.cos(45.75 * DEG)
    assert across.estimate == pytest.approx(-30.0 * cos, abs=0.01) and across.u == pytest.approx(30.0 * cos, rel=1e-3)
    line = next(b for b in found.budget if b.id.startswith("head.heading") and b.coefficient == "about p × east")
    assert line.sensitivity * ARCSEC == pytest.approx(cos, rel=1e-3)  # arcsec per rad, too large: too far east
    assert not any(b.id.startswith(("clock", "star.place", "level.scale")) for b in found.budget)


@pytest.mark.long
def test_intervals_cover(session: Session) -> None:
    """60 runs with noise and a heading drawn with its u: 95 % intervals of e and a."""
    rng, held, n = np.random.default_rng(5), 0, 60
    for k in range(n):
        off = rng.normal() * 5.0 * ARCSEC
        values = {"theodolite.head": 20.0 * DEG + off, "u_heading": 5.0 * ARCSEC, "sets": 4}
        found = {c.name: c for c in reduced(session, values, seed=k + 1).coefficients}
        held += sum(
            found[name].interval[0] <= 0.0 <= found[name].interval[1] for name in ("about east", "about p × east")
        )
    assert held >= 2 * n - 14  # 114 expected of 120, standard deviation 2.4


@pytest.mark.long
def test_heading_of_a_north_finder_is_handed_over() -> None:
    run = gb.load("north_finder", {"time": "60s", "heading": "40deg"}).run(seed=2, check_step=False)
    psi = run.result["ψ"]
    taken = load_system(NAME).takes["north_finder"](run.result)
    assert taken["by"] == "gyro" and float(taken["heading"].removesuffix("deg")) == pytest.approx(psi.estimate)
    system = load_system(NAME).with_values(taken)
    assert system["u_heading"] == pytest.approx(psi.u * DEG) and system["heading"] == pytest.approx(40.0 * DEG, abs=0.2)
    labels = [p.label for p in system.plan().phases]
    assert "set 1: head, left" in labels and not any("star" in label for label in labels)


def test_refused() -> None:
    with pytest.raises(InvalidConfigurationError, match="by = sun: must be one of star, gyro"):
        load_system(NAME).with_values({"by": "sun"}).refuse()
    with pytest.raises(InvalidConfigurationError, match="or take by=gyro"):
        load_system(NAME).with_values({"latitude": "-30deg"}).refuse()
