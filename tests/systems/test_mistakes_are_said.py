"""Files of a laboratory, written from the equations, with a mistake that once left without a word."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.result import Result

CHECKED = "# arrangement = checked\n"
FREQUENCIES = (0.0, 5.0, 0.0, 20.0, 0.0, 20.0, 0.0, 5.0, 0.0)
READINGS = 8


def reduced(tmp_path: Path, system: str, text: str) -> Result:
    file = tmp_path / "lab.csv"
    file.write_text("# type_b = none\n" + text, encoding="utf-8")
    return gb.reduce(system, file).result


def said(result: Result) -> dict[str, str]:
    """Return the doubts and warnings but that slow noise may be longer than the record."""
    serious = [r for r in result.reasons if r.severity in ("error", "warning", "doubt")]
    return {r.id: r.text for r in serious if r.id != "noise.unbounded"}


# ------------------------------------------------------------------------------------------------ north
def north(method: str) -> str:
    """Four positions, or two gyros and two accelerometers at rest on a head that leans by 10 mrad; heading 50 deg."""
    rng = np.random.default_rng(3)
    A, up, psi = 15.041067 * math.cos(0.8), 15.041067 * math.sin(0.8), math.radians(50.0)
    lines = [f"# latitude = 0.8rad\n# method = {method}\n"]
    strapdown = method == "strapdown"
    lines.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [deg/h]")
    lines[-1] += ",mean_x [deg/h],f_x [mg],f_y [mg]\n" if strapdown else "\n"
    for k in range(40):
        angle = 0.0 if strapdown else -90.0 * (k // 10)
        towards = psi - math.radians(angle)
        y, x = A * math.cos(towards), -A * math.sin(towards)
        if strapdown:  # nose up by 10 mrad, to first order
            y += 0.01 * up
        y, x = (v + 0.01 * rng.standard_normal() for v in (y, x))
        row = f"{1 if strapdown else k // 10 + 1},{10 * k},{10 * k + 10},{angle},{angle},{y!r}"
        lines.append(
            row + (f",{x!r},{rng.normal(0.0, 0.01)!r},{10.0 + rng.normal(0.0, 0.01)!r}\n" if strapdown else "\n")
        )
    return "".join(lines)


@pytest.mark.parametrize(
    ("method", "mistakes"),
    [
        ("four", ("the reading reversed", "the rotation reversed")),
        ("strapdown", ("the columns mean_x and mean exchanged", "the specific force reversed", "the other sign")),
    ],
)
def test_a_heading_rests_on_senses(tmp_path: Path, method: str, mistakes: tuple[str, ...]) -> None:
    """A head that turned the other way gives 360 deg less the heading, with the same residuals: nothing was said."""
    asked = said(reduced(tmp_path, "north_finder", north(method)))["arrangement.unstated"]
    for words in mistakes:
        assert words in asked
    once = {"positions.once"} if method == "four" else set()  # a jump of the bias between its positions
    assert set(said(reduced(tmp_path, "north_finder", CHECKED + north(method)))) == once


# ------------------------------------------------------------------------------------------------ cones, sculling
def moved(
    columns: str, reading: dict[float, tuple[float, ...]], noise: float, motion: str, copied: bool = False
) -> str:
    """Rows of eight readings at each frequency; motion: further columns of a row in motion."""
    rng = np.random.default_rng(5)
    lines, t, last = [columns + "\n"], 0.0, [""] * READINGS
    for part, f in enumerate(FREQUENCIES):
        for k in range(READINGS):
            values = ",".join(repr(v + noise * float(rng.standard_normal())) for v in reading[f])
            values = last[k] if copied and part == 5 else values
            last[k] = values
            lines.append(f"{t},{t + 2.0},{f:g},{motion if f else ','.join('0' * len(motion.split(',')))},{values}\n")
            t += 2.0
        t += 2.0
    return "".join(lines)


def cones(drift: float, copied: bool = False) -> str:
    """Cones of 0.5 deg; drift at 20 Hz, deg/h, a quarter of it at 5 Hz."""
    reading = {0.0: (1.0, -2.0, 0.5), 5.0: (1.5, -2.4, 0.5 + drift / 4.0), 20.0: (3.0, -3.6, 0.5 + drift)}
    columns = "t_start [s],t_end [s],frequency [Hz],half_angle [deg],drift_x [deg/h],drift_y [deg/h],drift_z [deg/h]"
    return moved(columns, reading, 0.1, "0.5", copied)


def test_cones_that_are_not_of_the_stated_chain(tmp_path: Path) -> None:
    """20 Hz, 0.5 deg: w (1 - cos) = 126 x 3.8e-5 rad/s = 987 deg/h; the chain is said to compute all of it."""
    head = CHECKED + "# coning = true\n# bandwidth = 0Hz\n# interval = 0.01s\n# samples = 1\n# axis = z\n"
    assert not said(reduced(tmp_path, "coning_test", head + cones(-4.0)))
    assert set(said(reduced(tmp_path, "coning_test", head + cones(-300.0)))) == {"coning.stated"}
    words = said(reduced(tmp_path, "coning_test", head + cones(-4.0, copied=True)))["record.identical_rows"]
    assert "Rows 41 to 48 hold the readings of rows 33 to 40" in words
    asked = said(reduced(tmp_path, "coning_test", head.removeprefix(CHECKED) + cones(-4.0)))["arrangement.unstated"]
    assert "the reading reversed" in asked and "the columns drift_x and drift_z exchanged" in asked


def sculling(rise: float) -> str:
    """Half a degree and 5 m/s2; acceleration at 20 Hz, micro-g, a quarter of it at 5 Hz."""
    columns = "t_start [s],t_end [s],frequency [Hz],angle [deg],vibration [m/s2],acceleration [ug]"
    return moved(columns, {0.0: (100.0,), 5.0: (100.0 + rise / 4.0,), 20.0: (100.0 + rise,)}, 2.0, "0.5,5")


def test_sculling_that_is_not_of_the_stated_chain(tmp_path: Path) -> None:
    """The vertical reads -theta a/2 - theta2 g/4 = -0.022 m/s2, 2240 micro-g: 10 % of it is no exact chain."""
    head = CHECKED + "# sculling = true\n# bandwidth = 0Hz\n# acc_bandwidth = 0Hz\n# interval = 0.01s\n# samples = 1\n"
    head += "# size = 0mm\n"
    assert not said(reduced(tmp_path, "sculling_test", head + sculling(10.0)))
    assert set(said(reduced(tmp_path, "sculling_test", head + sculling(-250.0)))) == {"sculling.stated"}
    asked = said(reduced(tmp_path, "sculling_test", head.removeprefix(CHECKED) + sculling(10.0)))
    assert "the reading reversed" in asked["arrangement.unstated"]


# ------------------------------------------------------------------------------------------------ accelerometer
@pytest.mark.parametrize(("factor", "hint"), [(1.0, ""), (1e3, "a thousandth of its unit"), (1.3, "times gravity.")])
def test_a_scale_of_no_accelerometer(tmp_path: Path, factor: float, hint: str) -> None:
    """A current in microampere under [mA] gave k1 = 1000 g/g with 6 digits."""
    rng = np.random.default_rng(2)
    rows = ["# gravity = 9.80665m/s2\n# scale = 9806.65m/s2/A\n# phase 1 = a\n# phase 2 = b\n"]
    rows.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]\n")
    for k in range(48):
        angle = 30.0 * (k % 24 % 12)
        current = factor * (1e-3 - math.sin(math.radians(angle)) + 5e-6 * rng.standard_normal())
        rows.append(f"{1 + k // 24},{40 * k},{40 * k + 30},{angle},{angle},{current!r}\n")
    found = said(reduced(tmp_path, "accelerometer_multipoint", CHECKED + "".join(rows)))
    assert hint in found.get("force.factor", "") and ("force.factor" in found) == (factor != 1.0)


# ------------------------------------------------------------------------------------------------ warm-up, gravity
def warm_up(top: float = 99.0) -> str:
    """Six turn-ons on three days: 5 deg/h, 12 exp(-t/60 s), 0.1 deg/h/K; readings up to ``top``."""
    rng = np.random.default_rng(21)
    lines = ["t_start [s],t_end [s],turn_on,day,since [s],mean [deg/h],temperature [degC]\n"]
    for k in range(6):
        T = 20.0 + 3.0 * float(rng.normal())
        own = 5.0 + 0.05 * float(rng.normal()) + 0.1 * (T - 20.0)
        for since in np.arange(5.0, 245.0, 10.0).tolist():
            curve = 72.0 * (math.exp(-(since - 5.0) / 60.0) - math.exp(-(since + 5.0) / 60.0))
            mean = min(own + curve + 0.02 * float(rng.normal()), top)
            t = 5000.0 * k + since
            lines.append(f"{t - 5.0},{t + 5.0},{k + 1},{1 + k // 2},{since},{mean!r},{T!r}\n")
    return "# limit = 0.2deg/h\n" + "".join(lines)


def test_a_warm_up_that_reached_a_range_and_a_thermometer_in_fahrenheit(tmp_path: Path) -> None:
    """Twelve of 144 readings at 12 deg/h to the last digit: b_T was ten u off, the residuals 'not normal' alone."""
    name = "turn_on_repeatability"
    assert "record.range" not in said(reduced(tmp_path, name, CHECKED + warm_up()))
    text = said(reduced(tmp_path, name, CHECKED + warm_up(12.0)))["record.range"]
    assert "readings of mean, the first in row 1, are its largest value" in text
    asked = said(reduced(tmp_path, name, warm_up()))["arrangement.unstated"]
    assert "the temperatures in °F and given as °C (b_T by" in asked
    assert "another attitude, by 1°, from turn-on 4 on (" in asked  # 0.26 deg/h between days


def test_a_g_sensitivity_rests_on_the_earth_rate_and_on_turning_over(tmp_path: Path) -> None:
    """Axis x at 45°, the gyro alone: G with the vertical Earth rate taken off twice is 10.64 °/h/g less."""
    rng, lines = np.random.default_rng(23), ["t_start [s],t_end [s],up,level [g],rate [deg/h]\n"]
    for k in range(24):
        way, s = 1.0 - 2.0 * (k // 12), float(k % 4)
        rate = 4.0 + 22.64 * way + 3.0 * (1.0 + s * s) + 0.1 * float(rng.normal())
        lines.append(f"{12 * k},{12 * k + 10},{way:g},{s},{rate!r}\n")
    text = "# latitude = 45deg\n# gravity = 9.80665\n# axis = x\n" + "".join(lines)
    asked = said(reduced(tmp_path, "vibration_rectification", text))["arrangement.unstated"]
    for words in ("the Earth rate taken off before (G by", "up and down exchanged (G by", "the rates wrong by 2 % (G"):
        assert words in asked
    assert set(said(reduced(tmp_path, "vibration_rectification", CHECKED + text))) == {"turned.once"}
