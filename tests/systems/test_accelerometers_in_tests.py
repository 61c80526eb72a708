"""accelerometer_mems where accelerometers fit: beside the gyros of imu_positions, alone in a drift record."""

from __future__ import annotations

import importlib
from typing import Any

import pytest

import gyrobench as gb
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

tables: Any = importlib.import_module(".tables", type(load_system("imu_positions")).__module__)
G0 = 9.80665


@pytest.mark.long
def test_imu_positions_reads_accelerometers_of_their_own() -> None:
    """Noise off: bias and rows of the matrix, (1 + scale) axes - 1, are those of the part, not of the IMU."""
    axes = [[1.0, 1e-3, -2e-3], [5e-4, 1.0, 3e-4], [0.0, -1e-3, 1.0]]
    scale, bias = [1e-3, -5e-4, 2e-3], [0.02, -0.01, 0.03]
    values: dict[str, Any] = {
        "accelerometers.axes": axes, "accelerometers.scale": scale, "accelerometers.bias": bias,
        "accelerometers.white": 0.0, "positions": 6, "dwell": 2.0, "windows": 1, "settle": 1.0, "turns": 0,
        "nuisances": "none", **{f"imu.{a}_gyro": 0.0 for a in "xyz"},
    }  # fmt: skip
    found = {c.name: c for c in gb.load("imu_positions", values).run(seed=1, check_step=False).result.coefficients}
    for i, a in enumerate("xyz"):
        assert found[f"ba_{a}"].estimate * tables.SCALES["µg"] == pytest.approx(bias[i], abs=1e-7)
        for j, b in enumerate("xyz"):
            c, true = found[f"Sa_{a}{b}"], (1.0 + scale[i]) * axes[i][j] - (i == j)
            assert c.estimate * tables.SCALES[c.unit] == pytest.approx(true, abs=2e-8)
            assert c.truth is not None and c.truth * tables.SCALES[c.unit] == pytest.approx(true, abs=1e-12)


@pytest.mark.long
def test_drift_record_of_an_accelerometer() -> None:
    """1200 windows of 1 s of white noise alone: N is known to 2 %; the axis stands up and the bias is 20 mg."""
    values = {
        "accelerometers.white": 3e-4, "accelerometers.bias": [0.02 * G0, 0.0, 0.0], "accelerometers.x_flicker": 0.0,
        "accelerometers.x_walk": 0.0, "attitude": "U E", "duration": 1200.0,
    }  # fmt: skip
    result = gb.load("drift_record", values).run(seed=4, check_step=False).result
    N = next(c for c in result.coefficients if c.name == "N")
    assert N.unit == "m/s/√h" and N.truth == pytest.approx(3e-4 * 60.0)
    assert N.estimate == pytest.approx(N.truth, rel=0.08) and N.interval[0] < N.truth < N.interval[1]
    assert result.columns[0].name == "bias"
    assert result.columns[0].unit == "µg"
    mean = result.columns[0].record.mean
    assert sum(mean) / len(mean) == pytest.approx(0.02 * G0, abs=1e-4)  # m/s2; u = 3e-4/sqrt(1200 s) = 9e-6


def test_a_torquer_is_not_of_accelerometers() -> None:
    with pytest.raises(InvalidConfigurationError, match="with reading = force there is none"):
        gb.load("drift_record", {"accelerometers.white": 1e-4, "k": 3.0}).run(seed=1)
