"""An axis of an inertial measurement unit up, then down: a logger's file of two positions.  [IMU-UPDOWN]"""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import Unit

from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
log: Any = importlib.import_module(".log", room)
tables: Any = importlib.import_module(".tables", room)
DPH = math.pi / 648000.0


def write(path: Path, time: Any, gyro: Any, acc: Any) -> Path:
    heads = [f"g{x} [rad/s]" for x in "xyz"] + [f"a{x} [m/s2]" for x in "xyz"]
    body = "\n".join(",".join(f"{v:.12g}" for v in row) for row in np.column_stack([time, gyro, acc]).tolist())
    site = "# attitudes = up_down\n# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n"  # 0.7 rad
    path.write_text(f"{site}time [s],{','.join(heads)}\n{body}\n", encoding="utf-8")
    return path


def record(path: Path, **values: str) -> Any:
    return log.read_log(load_system("imu_positions"), path, values)


def up_down(rng: np.random.Generator, unit: Unit, axis: int = 2, angle: float = 0.0) -> Any:
    """An axis up, then down, 60 s each at 20 Hz, some degrees off the vertical."""
    n, sign = 1200, np.repeat([1.0, -1.0], 1200)
    time = np.concatenate([np.arange(n), np.arange(n) + n + 100]) / 20.0
    direction = np.eye(3)[axis] * math.cos(angle) + np.eye(3)[(axis + 1) % 3] * math.sin(angle)
    earth = 7.2921159e-5 * math.sin(0.7)
    gyro = np.outer(sign, unit.G @ direction + (np.eye(3) + unit.Sg) @ direction * earth) + unit.bg
    acc = np.outer(sign * 9.805, (np.eye(3) + unit.Sa) @ direction) + unit.ba
    return time, gyro + 1e-6 * rng.normal(size=gyro.shape), acc + 1e-4 * rng.normal(size=acc.shape)


def test_up_and_down(tmp_path: Path) -> None:
    """Bias is half of the sum, hg and the scale factor half of the difference, by hand; noise of the means 3e-8 rad/s,
    3e-6 m/s2, intervals of ten times that at most."""
    rng = np.random.default_rng(11)
    unit = Unit.drawn(rng)
    series = up_down(rng, unit)
    path = write(tmp_path / "log.csv", *series)
    system = load_system("imu_positions")
    assert system.measured_data is not None
    reduction: Any = importlib.import_module(".reduction", room)
    result = reduction.Reduction.from_record(system.measured_data.read(system, path, {}))
    found = {c.name: c for c in result.coefficients}
    assert set(found) == {"bg_z", "hg_z", "ba_z", "Sa_zz"}
    up, down = (np.array([s[rows].mean(axis=0)[2] for s in series[1:]]) for rows in (slice(0, 1200), slice(1200, 2400)))
    assert found["bg_z"].estimate * DPH == pytest.approx((up[0] + down[0]) / 2.0, abs=1e-7)
    assert found["hg_z"].estimate * DPH == pytest.approx((up[0] - down[0]) / 2.0, abs=1e-7)
    assert found["Sa_zz"].estimate * 1e-6 == pytest.approx((up[1] - down[1]) / 2.0 / 9.805 - 1.0, abs=1e-6)
    truth = {"bg_z": unit.bg[2], "hg_z": unit.G[2, 2] + (1 + unit.Sg[2, 2]) * 7.2921159e-5 * math.sin(0.7),
             "ba_z": unit.ba[2], "Sa_zz": unit.Sa[2, 2]}  # fmt: skip
    for n, value in truth.items():
        assert (
            abs(found[n].estimate * tables.SCALES[found[n].unit] - value)
            < 5.0 * found[n].u * tables.SCALES[found[n].unit]
        )
    assert not any(r.id == "plausibility.earth_rate" for r in result.reasons)


def test_up_and_down_that_leans(tmp_path: Path) -> None:
    """0.02 rad off the vertical, no noise to speak of: hg may be off by half of what both positions may be, and each
    by 15.041 cos 0.7 x 0.02/sqrt 2 = 0.1627 deg/h: 0.1627/sqrt 2 = 0.115 deg/h.  A lean that is stated is taken."""
    unit = Unit.drawn(np.random.default_rng(13))
    unit.ba, unit.Sa = unit.ba * 0.0, unit.Sa * 0.0
    path = write(tmp_path / "log.csv", *up_down(np.random.default_rng(13), unit, angle=0.02))
    updown: Any = importlib.import_module(".updown", room)
    for stated, u in (({}, 0.115), ({"u_mount": "1e-3rad"}, 15.041 * math.cos(0.7) * 1e-3 / math.sqrt(2.0))):
        result = updown.UpDownReduction.of_record(record(path, **stated))
        half = next(c for c in result.coefficients if c.name == "hg_z")
        lines = [b.contribution for b in result.budget if b.coefficient == "hg_z" and "vertical" in b.source]
        assert math.hypot(*lines) == pytest.approx(u, rel=0.02) and half.u > 0.99 * u


def test_up_and_down_without_an_upright_axis(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    updown: Any = importlib.import_module(".updown", room)
    path = write(tmp_path / "log.csv", *up_down(rng, Unit.drawn(rng), angle=0.7))
    read = record(path)
    with pytest.raises(ReductionError, match="no axis stands up and down"):
        updown.UpDownReduction.of_record(read)


def test_a_misalignment_times_a_lean_is_in_u_of_the_bias(tmp_path: Path) -> None:
    """An input axis 5 deg off z towards x, a case that leans by 1 deg to the same side up and down: the bias reads
    9.805 (cos 4 - cos 6)/2 = 9.805 sin 5 sin 1 too much, 1521 ug.  The accelerometer x, at right angles to z, reads the
    sines of -4 and 6 deg: half of the difference 5, of the sum 1 deg, whose product over sqrt 3 is u, 878 ug.  No lean:
    nothing but noise, 0.3 ug."""
    updown: Any = importlib.import_module(".updown", room)
    rng = np.random.default_rng(17)
    for lean, u in ((1.0, 878.0), (0.0, 0.3)):
        m, t = math.radians(5.0), math.radians(lean)
        triad = np.array([[math.cos(m), 0.0, -math.sin(m)], [0.0, 1.0, 0.0], [math.sin(m), 0.0, math.cos(m)]])
        up = np.repeat([[math.sin(t), 0.0, math.cos(t)], [math.sin(t), 0.0, -math.cos(t)]], 1200, axis=0)
        time = np.concatenate([np.arange(1200), np.arange(1200) + 1300]) / 20.0
        acc = 9.805 * up @ triad.T + 1e-4 * rng.normal(size=up.shape)
        path = write(tmp_path / "log.csv", time, 1e-6 * rng.normal(size=up.shape), acc)
        bias = next(c for c in updown.UpDownReduction.of_record(record(path)).coefficients if c.name == "ba_z")
        true = 9.805 / 9.80665e-6 * math.sin(m) * math.sin(t)
        assert bias.estimate == pytest.approx(true, abs=2.0) and bias.u == pytest.approx(u, rel=0.02, abs=0.5)


def reduced(path: Path, series: Any) -> Any:
    system = load_system("imu_positions")
    assert system.measured_data is not None
    reduction: Any = importlib.import_module(".reduction", room)
    return reduction.Reduction.from_record(system.measured_data.read(system, write(path, *series), {}))


def test_a_bias_that_fades_after_the_turn_asks_a_verdict_to_hold_with_it(tmp_path: Path) -> None:
    """2e-6 rad/s (two noises of a sample) that fade with 20 s of the 60: hg is off by half of their mean, 2e-6 (20/60)
    (1 - exp(-3))/2 = 3.2e-7 rad/s, to half of their size, 1e-6, as noise that walks weighs the ends of both positions.
    Of one turn the report says that a jump then is in no residual.
    """
    unit = Unit.drawn(np.random.default_rng(11))
    time, gyro, acc = up_down(np.random.default_rng(12), unit)
    fading = 2e-6 * np.where(time >= time[1200], np.exp(-(time - time[1200]) / 20.0), 0.0)
    result = reduced(tmp_path / "log.csv", (time, gyro + fading[:, None], acc))
    hg, true = next(c for c in result.coefficients if c.name == "hg_z"), gyro[:1200, 2].mean() - gyro[1200:, 2].mean()
    assert -1.05e-6 < hg.estimate * DPH - true / 2.0 < -3e-7
    assert true / 2.0 / DPH > hg.interval[1]
    low, high = next(r for r in result.reasons if r.id == "turned.fades" and "hg_z" in r.intervals).intervals["hg_z"]
    assert low < true / 2.0 / DPH < high and high - low < 8.0 * (hg.interval[1] - hg.interval[0])
    assert any(r.id == "turned.once" for r in result.reasons)


def test_words_that_the_noise_does_not_average_out_are_said(tmp_path: Path) -> None:
    """Words of three noises of the gyros: means up to 3/pi exp(-2 pi2/9) = 0.11 of the noise off."""
    time, gyro, acc = up_down(np.random.default_rng(12), Unit.drawn(np.random.default_rng(11)))
    for word, said in ((1e-6, 0), (3e-6, 3)):
        run = record(write(tmp_path / f"{said}.csv", time, word * np.rint(gyro / word), acc)).run
        assert sum("more than their noise averages out" in text for text in run.doubts) == len(run.doubts) == said
