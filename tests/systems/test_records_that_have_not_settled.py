"""Files of a laboratory, from the equations: readings that begin too early, a scale factor or a room that warms up."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.reduction.setup.settling import unsettled
from gyrobench.result import Reason

STATED = "# type_b = none\n# arrangement = checked\n# latitude = 45.75deg\n"
EARTH = 15.0410686  # deg/h
#: x, y of TEST-8POS in east, north, up
POSITIONS = (
    ((1, 0, 0), (0, 1, 0)),
    ((0, 1, 0), (-1, 0, 0)),
    ((-1, 0, 0), (0, -1, 0)),
    ((0, -1, 0), (1, 0, 0)),
    ((0, 0, 1), (1, 0, 0)),
    ((-1, 0, 0), (0, 0, 1)),
    ((0, 0, -1), (-1, 0, 0)),
    ((1, 0, 0), (0, 0, -1)),
)


def said(tmp_path: Path, system: str, text: str) -> dict[str, Reason]:
    file = tmp_path / "lab.csv"
    file.write_text(text, encoding="utf-8")
    return {r.id: r for r in gb.reduce(system, file).result.reasons}


def eight_positions(settles: float) -> str:
    """Three cycles, four readings in a position; the first one ``settles`` deg/h too high, the next one 1/e of it."""
    rng = np.random.default_rng(4)
    w = EARTH * np.array([0.0, math.cos(math.radians(45.75)), math.sin(math.radians(45.75))])
    lines = [STATED + "# nuisances = none\n", "cycle,position,t_start [s],t_end [s],mean_x [mA],mean_y [mA]\n"]
    t = 0
    for cycle in (1, 2, 3):
        for position, (x, y) in enumerate(POSITIONS, 1):
            g = -np.array([x[2], y[2], np.cross(x, y)[2]])
            rates = (w @ y - 0.3 + 0.9 * g[1] - 0.8 * g[2], w @ x + 0.2 - 0.7 * g[2] + 0.9 * g[0])
            for k in range(4):
                now = [float(r + settles * math.exp(-k) + 0.002 * rng.standard_normal()) / 17.2 for r in rates]
                lines.append(f"{cycle},{position},{t},{t + 6},{now[0]!r},{now[1]!r}\n")
                t += 6
            t += 10
    return "".join(lines)


@pytest.mark.long
@pytest.mark.parametrize("settles", [0.0, 0.03])
def test_positions_that_have_not_settled(tmp_path: Path, settles: float) -> None:
    """0.03 deg/h in the first of four readings: R_x was 0.012 deg/h wrong, of u = 0.0005, with ordinary residuals."""
    reason = said(tmp_path, "eight_position", eight_positions(settles)).get("record.unsettled")
    assert (reason is not None) == (settles > 0.0)
    assert reason is None or (reason.blocks == ("pass", "fail") and "the first one lies +" in reason.text)


def dwells(kind: str, seed: int, end: int = 0) -> SimpleNamespace:
    """40 dwells of five readings in white noise or a random walk; those at ``end`` off by 8, of either sense."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((40, 5))
    if kind == "walk":
        y = np.cumsum(y).reshape(40, 5)
    if kind == "end":
        y[:, end] += 8.0 * rng.choice([-1.0, 1.0], 40)
    return SimpleNamespace(
        windows={"phase": np.repeat(np.arange(40), 5), "t_start": np.arange(200.0), "mean": y.ravel()}
    )


def test_noise_that_is_not_white_has_settled() -> None:
    """0.1 % of settled records are named: of 400, five or more in 1 of 10 000."""
    named = [bool(unsettled(dwells(kind, seed), ("mean",))) for kind in ("white", "walk") for seed in range(200)]  # type: ignore[arg-type]
    assert sum(named) < 5


@pytest.mark.parametrize(("end", "words"), [(0, "the first ones scatter"), (-1, "the last ones scatter")])
def test_a_sense_that_changes_from_dwell_to_dwell(end: int, words: str) -> None:
    assert words in unsettled(dwells("end", 1, end), ("mean",))[0].text  # type: ignore[arg-type]


@pytest.mark.filterwarnings("error")
def test_readings_in_steps_have_no_warning_of_numpy() -> None:
    """The first readings are alike those between but for one word more or less, which the last ones have, too: the
    difference of the two is 0 in all dwells.
    """
    record = dwells("white", 1)
    y = np.zeros((40, 5))
    y[::3, [0, -1]] = 1.0
    record.windows["mean"] = y.ravel()
    assert unsettled(record, ["mean"]) == []  # type: ignore[arg-type]


def rates(early: float, warming: float) -> str:
    """Three cycles to 100 deg/s in steps of 25; ``early``: share of a reading before the table has its rate; scale
    factor in ppm that ``warming`` is what it changes by from the first reading to the last one.
    """
    rng = np.random.default_rng(6)
    up = [25.0, 50.0, 75.0, 100.0, 75.0, 50.0, 25.0, 0.0]
    sweep = [0.0, *([*up, *(-r for r in up)] * 3)]
    earth = EARTH / 3600.0 * math.sin(math.radians(45.75))
    lines, before = ["t_start [s],t_end [s],rate [deg/s],mean [deg/s]\n"], 0.0
    for k, rate in enumerate(sweep):
        scale = 1.0 + 1e-6 * (100.0 + warming * k / len(sweep))
        mean = scale * ((1.0 - early) * rate + early * before + earth) + 4e-4 * rng.standard_normal()
        lines.append(f"{30 * k},{30 * k + 20},{rate},{mean!r}\n")
        before = rate
    return "".join(lines)


def test_readings_that_begin_before_the_table_has_its_rate_are_asked_for(tmp_path: Path) -> None:
    """A thousandth of a reading at the rate before it is 90 deg/h of hysteresis, of equal steps in no residual."""
    asked = said(tmp_path, "rate_table_test", STATED.replace("# arrangement = checked\n", "") + rates(0.001, 0.0))
    assert "before the table had its rate (h by" in asked["arrangement.unstated"].text


@pytest.mark.long
@pytest.mark.parametrize("warming", [0.0, 60.0])
def test_a_scale_factor_that_warms_up(tmp_path: Path, warming: float) -> None:
    found = said(tmp_path, "rate_table_test", STATED + rates(0.0, warming))
    assert ("scale.time" in found) == ("residuals.contradict" in found) == (warming > 0.0)


def turning_with_the_earth() -> str:
    """TEST-SERVO-POLAR by route equal: R = 0.3, U_z = 0.9, U_x = -0.7 deg/h, a day in each mount, noise."""
    rng = np.random.default_rng(8)
    c, s = math.cos(math.radians(45.75)), math.sin(math.radians(45.75))
    lines = ["# nuisances = none\n# route = equal\n# phase 1 = polar S\n# phase 2 = polar N\n"]
    lines.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg]\n")
    for phase, sense in ((1, 1.0), (2, -1.0)):
        angle = 0.0
        for k in range(96):
            middle = math.radians(angle + sense * 900.0 / 480.0)
            rate = sense * (EARTH - 0.9 * s - 0.7 * c * math.cos(middle)) - 0.3 + 0.003 * float(rng.standard_normal())
            start, angle, t = angle, angle + rate / 4.0, 86400 * (phase - 1) + 900 * k
            lines.append(f"{phase},{t},{t + 900},{start!r},{angle!r}\n")
    return "".join(lines)


@pytest.mark.long
def test_a_drift_by_the_time_of_day_is_asked_for(tmp_path: Path) -> None:
    """A sidereal day is 4 min shorter: 0.01 deg/h by the time of day moved unbalances by 10 u, and no residual."""
    text = "# type_b = none\n# latitude = 45.75deg\n" + turning_with_the_earth()
    assert "a drift by the time of day" in said(tmp_path, "servo_polar", text)["arrangement.unstated"].text
