"""Reduction of a north finding from windows made by hand: tilt, sides of the meridian, budget."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from commanding import Command
from north_windows import NAME, windows
from scipy.spatial.transform import Rotation
from stated import with_sizes

from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.result import DriftTestResult
from gyrobench.system.system import load_system
from gyrobench.units import DPH
from systems.north_finder.reduction import NorthFinderSetup, Reduction


def heading_of(method: str, w: dict[str, np.ndarray], latitude: float, **u: float) -> DriftTestResult:
    setup = NorthFinderSetup(
        method=method, latitude=latitude, gravity=9.80665, rough=1.0, nuisances=False, **with_sizes(u)
    )
    return Reduction.reduce(w, setup)


@pytest.mark.parametrize("method", ["tilt", "strapdown two"])
def test_the_reduction_is_right_at_any_tilt(method: str) -> None:
    """Pitch 0.1, roll -0.3: to first order alone the heading would be off by up to 3/8 (0.01 + 0.09) = 2.1 deg."""
    for heading in (-2.9, 0.4, 1.7):
        found = heading_of(method, windows(method, heading, 0.8, 0.1, -0.3), 0.8)
        assert math.remainder(math.radians(found["ψ"].estimate) - heading, 2.0 * math.pi) == pytest.approx(
            0.0, abs=1e-9
        )


@pytest.mark.long
def test_two_positions_near_north_are_held() -> None:
    """Cosines 0, 1, 2 and 4 standard deviations from 1, 60 records each: the interval is that of the cosine.

    At north itself the cosine is as often above 1; first order, -d cos/sin psi, held 0.2 to 0.9 of those from 2 u on.
    """
    latitude, spread, n = 0.7, 1.5e-3, 32
    rng = np.random.default_rng(8)
    for apart in (0.0, 1.0, 2.0, 4.0):
        heading, held = math.acos(1.0 - apart * spread), []
        quiet = windows("two", heading, latitude)
        for _ in range(60):
            noise = 7.2921159e-5 * math.cos(latitude) * spread * math.sqrt(n) * rng.normal(size=n)
            psi = heading_of("two", quiet | {"mean": quiet["mean"] + noise}, latitude)["ψ"]
            held.append(psi.interval[0] <= math.degrees(heading) <= psi.interval[1])
        assert np.mean(held) >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / 60), apart
    # 60 deg: U of the cosine 0.003 is 0.2 deg, and acos is nearly straight
    psi = heading_of("two", windows("two", 1.0472, latitude) | {"mean": windows("two", 1.0472, latitude)["mean"]
                     + 1e-8 * rng.normal(size=n)}, latitude)["ψ"]  # fmt: skip
    first_order = 1e-8 / math.sqrt(n) / (7.2921159e-5 * math.cos(latitude)) / math.sin(1.0472)
    assert math.radians(psi.u) == pytest.approx(first_order, rel=0.5)


@pytest.mark.parametrize(
    ("rough", "sigma_rough", "reason", "verdict"),
    [
        (90.0, 0.0, "rough.unstated", "inconclusive"),  # the wrong side: the heading is -63 deg
        (-70.0, 0.0, "rough.unstated", "inconclusive"),
        (-70.0, 5.0, "", "pass"),
        (100.0, 5.0, "rough.contradicts", "inconclusive"),  # the mirrored one, 63 deg, is 7 u from it
        (20.0, 30.0, "rough.open", "inconclusive"),  # 43 deg from the one, 83 deg from the other: 1.4 and 2.8 u
    ],
)
def test_two_positions_ask_for_the_side(
    command: Command, tmp_path: Path, rough: float, sigma_rough: float, reason: str, verdict: str
) -> None:
    """w = A cos(psi - angle) + bias at 0 and 180 deg, psi = -63 deg: A cos is that of +63 deg, whatever the noise."""
    rng, A = np.random.default_rng(4), 15.041067 * math.cos(0.8)
    lines = [f"# latitude = {math.degrees(0.8)!r}deg", "# method = two", "# type_b = none", f"# rough = {rough}deg"]
    lines.append("# arrangement = checked")
    lines += [f"# sigma_rough = {sigma_rough}deg"] * bool(sigma_rough)
    lines.append("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [deg/h]")
    for k in range(20):
        angle = -180.0 * (k // 10)
        w = A * math.cos(-1.1 - math.radians(angle)) + 0.2 + 0.01 * float(rng.normal())
        lines.append(f"{k // 10 + 1},{10.0 * k!r},{10.0 * k + 10.0!r},{angle!r},{angle!r},{w!r}")
    (tmp_path / "lab.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "limits.toml").write_text('[coefficients."ψ"]\nunit = "°"\nmin = -1e9\nmax = 1e9\n', "utf-8")
    given = ("--data", tmp_path / "lab.csv", "--spec", tmp_path / "limits.toml", "--out", tmp_path / "out")
    code, _, err = command("reduce", NAME, *given, "--strict")
    assert (tmp_path / "out").is_dir(), err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert result["verdict"] == verdict and code == (verdict != "pass"), err
    assert [r["id"] for r in result["reasons"] if r["id"].startswith("rough.")] == ([reason] if reason else [])
    if reason:
        (said,) = [r["text"] for r in result["reasons"] if r["id"] == reason]
        assert "63." in said and "−63." in said.replace("-63.", "−63.")
    other = [row for t in result["tables"] if t["id"] == "integrity" for row in t["rows"] if "other" in row[0]]
    assert other[0][1] == pytest.approx(-result["coefficients"][0]["estimate"], abs=1e-9)


@pytest.mark.parametrize(("angles", "said"), [((0, -90, -180, -270), True), ((0, -90, -180, -270, 0), False)])
def test_positions_that_are_taken_once_are_said(angles: tuple[float, ...], said: bool) -> None:
    """0.3 °/h more from the third position on: of four the model fits all of it, a half as bias and a half in cosine
    and sine each, across a heading of 45°: 1.2° of it.  With the first once more the jump is named.
    """
    latitude, a = 0.8, np.radians(np.repeat(angles, 10))
    noise = 0.01 * DPH * np.random.default_rng(2).normal(size=a.size)
    A = 7.2921159e-5 * math.cos(latitude)
    jump = DPH * 0.3 * (np.arange(a.size) >= 20)
    t = 10.0 * np.arange(a.size)
    w = {"phase": np.ones(a.size), "t_start": t, "t_end": t + 10.0, "angle_start": a, "angle_end": a,
         "mean": A * np.cos(0.25 * math.pi - a) + jump + noise}  # fmt: skip
    found = heading_of("four", w, latitude)
    assert any(r.id == "positions.once" for r in found.reasons) == said
    assert any(r.id == "level.shift" for r in found.reasons) != said
    assert abs(found["ψ"].estimate - 45.0) > 5.0 * found["ψ"].u


def test_a_run_with_rough_on_the_wrong_side_is_warned() -> None:
    for rough, warned in ((90.0, True), (-90.0, False)):
        system = load_system(NAME)
        for name, value in (("method", "two"), ("heading", "-63deg"), ("rough", f"{rough}deg")):
            system.set(name, value)
        assert any("other side of the meridian" in w for w in system.warnings()) == warned


@pytest.mark.parametrize(
    ("method", "source", "option", "size", "change"),
    [
        ("four", "head.tilt.east", "u_level", 1e-4, {"pitch": ("tilt", 0.0)}),
        ("four", "head.tilt.north", "u_level", 1e-4, {"roll": ("tilt", 1.0)}),
        ("two", "latitude", "u_latitude", 1e-5, {}),
        ("strapdown", "latitude", "u_latitude", 1e-5, {}),
        ("tilt", "latitude", "u_latitude", 1e-5, {}),
        ("strapdown two", "latitude", "u_latitude", 1e-5, {}),
        ("strapdown", "gyro.bias.x", "u_bias", 1e-8, {"mean_x": ("add", 1e-8)}),
        ("strapdown", "gyro.bias.y", "u_bias", 1e-8, {"mean": ("add", 1e-8)}),
        ("strapdown", "accelerometers.bias.x", "u_accelerometer", 1e-4, {"f_x": ("add", 1e-4)}),
        ("strapdown", "accelerometers.bias.y", "u_accelerometer", 1e-4, {"f_y": ("add", 1e-4)}),
    ],
)  # fmt: skip
def test_budget_is_what_an_error_does(
    method: str, source: str, option: str, size: float, change: dict[str, tuple[str, float]]
) -> None:
    """Each source of type B, with its sign, against the change of the heading by that error in the record."""
    heading, latitude, noise = 1.1, 0.8, 1e-10
    tilts = (0.2, -0.15) if method in ("tilt", "strapdown", "strapdown two") else (0.0, 0.0)
    w = windows(method, heading, latitude, *tilts, noise=noise)
    base = heading_of(method, w, latitude, **{option: size})
    line = next(b for b in base.budget if b.id == source and b.coefficient == "ψ")
    stated = latitude
    if source == "latitude":
        stated += size
    elif source.startswith("head.tilt"):  # right-handed about east or north, by its matrix on the axes of the head
        axis = [1.0, 0.0, 0.0] if "east" in source else [0.0, 1.0, 0.0]
        C = Rotation.from_euler("ZXY", [-heading, 0.0, 0.0]).as_matrix().T
        C = C @ Rotation.from_rotvec(size * np.array(axis)).as_matrix().T
        earth = 7.2921159e-5 * np.array([0.0, math.cos(latitude), math.sin(latitude)])
        T = [Rotation.from_euler("z", a).as_matrix().T @ C for a in w["angle_start"]]
        C = Rotation.from_euler("ZXY", [-heading, 0.0, 0.0]).as_matrix().T
        level = [Rotation.from_euler("z", a).as_matrix().T @ C for a in w["angle_start"]]
        w = w | {"mean": w["mean"] + np.array([(t - t0)[1] @ earth for t, t0 in zip(T, level, strict=True)])}
    else:
        ((column, (_, step)),) = change.items()
        w = w | {column: w[column] + step}
    shift = math.radians(heading_of(method, w, stated)["ψ"].estimate - base["ψ"].estimate)
    assert math.radians(line.sensitivity) * size == pytest.approx(shift, rel=0.02, abs=1e-9)
    assert line.contribution == pytest.approx(abs(line.sensitivity) * size, rel=1e-9)


def test_one_position_without_statement_passes_nothing() -> None:
    w = windows("strapdown", 1.1, 0.8, noise=1e-10)
    limits = {"ψ": (0.0, 90.0)}
    found = conclude(heading_of("strapdown", w, 0.8), None, limits)
    assert found.verdict == "inconclusive" and any("bias of the gyro" in text for text in found.withheld)
    for known in ({"u_bias": 1e-9}, {"unbiased": True}):
        assert conclude(heading_of("strapdown", w, 0.8, **known), None, limits).verdict == "pass"
