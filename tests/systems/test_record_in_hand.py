"""Drift records as they come from a telephone: the moments in which it was put down and taken up, values in steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gyrobench.report import write
from gyrobench.system.system import load_system


@pytest.mark.usefixtures("no_arma")
def test_a_telephone_that_is_taken_up_to_end_its_record(tmp_path: Path) -> None:
    """Noise of 0.1 deg/s a sample at 100 Hz: N = 0.1 sqrt(0.01) 60 = 0.6 deg/sqrt(h).  The last second turns by 20
    deg/s: left in, it is 2000 times the noise at 1 s, and there is no model of it and the rest."""
    n = 6000
    rate = 0.1 * np.random.default_rng(5).normal(size=n)
    rate[-100:] += 20.0 * np.sin(2.0 * np.pi * 0.01 * np.arange(100.0))
    file = tmp_path / "record.csv"
    file.write_text("rate [deg/s]\n" + "\n".join(f"{x:.6f}" for x in rate) + "\n")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(file, {"type_b": "none", "sampling": "100Hz"}))
    (said,) = [r.text for r in result.reasons if r.id == "drift_record.moved"]
    assert said.startswith("The instrument was not at rest at 58.5–60 s: ")
    assert result["N"].interval[0] < 0.6 < result["N"].interval[1]
    assert result["N"].estimate == pytest.approx(0.6, rel=0.05)


@pytest.mark.usefixtures("chinese_font")
@pytest.mark.long
def test_correlated_gyros_that_were_moved_in_chinese(tmp_path: Path) -> None:
    """Half of the variance of each is that of all: they are correlated, without a common line.  They are moved in the
    samples 1000 to 1200, four blocks of 50, and a block beside them goes on either side."""
    rng = np.random.default_rng(6)
    rates = rng.normal(size=(4000, 3)) + rng.normal(size=(4000, 1))
    rates[1000:1200] += 300.0 * np.sin(0.06 * np.arange(200.0))[:, None]
    file = tmp_path / "record.csv"
    rows = "\n".join(",".join(f"{v:.5f}" for v in row) for row in rates)
    file.write_text(f"gyro_x [deg/h],gyro_y [deg/h],gyro_z [deg/h]\n{rows}\n")
    system = load_system("drift_record")
    record = system.read_measured(file, {"type_b": "none", "sampling": "100Hz"})
    result = system.reduce(record)
    assert any(t.id == "correlations" for t in result.tables)
    write(result, tmp_path / "out", language="zh")  # a sentence without its Chinese is an error
    assert "仪器在 9.5–12.5 s 期间并非静止" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("no_arma")
@pytest.mark.parametrize(("level", "stated"), [(0.35, False), (0.5, True)])
def test_noise_far_below_the_step_of_the_values(level: float, stated: bool, tmp_path: Path) -> None:
    """Noise of 0.07 steps, 0.15 below the place where the value changes: P(z > 2.14) = 0.016, 0.968 of the samples are
    as the one before, and nothing is stated.  At that place every second one is, and the coefficients have a doubt."""
    rng = np.random.default_rng(7)
    values = np.rint(level + 0.07 * rng.normal(size=6000)).astype(int)
    file = tmp_path / "record.csv"
    file.write_text("force_x [mg]\n" + "\n".join(map(str, values)) + "\n")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(file, {"type_b": "none", "sampling": "5Hz"}))
    assert np.isfinite(result["N"].estimate) == stated
    assert ("drift_record.misfit" in {r.id for r in result.reasons}) != stated
    assert "drift_record.coarse" in {r.id for r in result.reasons if r.severity == "doubt"}
    assert stated or "96." in result["N"].no_value


@pytest.mark.usefixtures("no_arma")
def test_positions_by_hand_are_no_record_at_rest(tmp_path: Path) -> None:
    """Level for 6 s, turned by half a turn in 3 s, and so on: K of it was stated."""
    rng = np.random.default_rng(8)
    angle = np.repeat(np.arange(8) % 2, 900).astype(float)
    for k in range(1, 8):
        angle[900 * k - 300 : 900 * k] = 0.5 - 0.5 * np.cos(np.pi * (np.arange(300) / 300 + (k - 1) % 2))
    force = np.cos(np.pi * angle) + 1e-3 * rng.normal(size=angle.size)
    file = tmp_path / "record.csv"
    file.write_text("force_x [g]\n" + "\n".join(f"{v:.6f}" for v in force) + "\n")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(file, {"type_b": "none", "sampling": "100Hz"}))
    assert not any(np.isfinite(c.estimate) for c in result.coefficients)
    assert "was not at rest" in result["N"].no_value
