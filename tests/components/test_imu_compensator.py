"""imu_compensator undoes an imu with the same values, exactly.  [IMU-POSITIONS]"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

G0 = 9.80665


def compensated(rate: Any, f_read: Any, **values: Any) -> tuple[Any, Any]:
    part = load_part("imu_compensator")(**values)
    part.rate, part.f_read = (np.asarray(v).tolist() for v in (rate, f_read))
    part.initialize()
    part.do_step(0.0, 0.01)
    return part.omega, part.f


@pytest.mark.parametrize("size", [0.15, 1e-5])
def test_the_inputs_of_an_imu_come_back(size: float) -> None:
    rng = np.random.default_rng(2)
    Sg, Sa = rng.uniform(-size, size, size=(2, 3, 3))
    G, (bg, ba, omega, f) = rng.normal(size=(3, 3)) * 1e-3, rng.normal(size=(4, 3))
    values = {"gyro_bias": bg.tolist(), "gyro_scale": Sg.tolist(), "g_sensitivity": G.tolist(),
              "acc_bias": ba.tolist(), "acc_scale": Sa.tolist()}  # fmt: skip
    rate, f_read = omega + Sg @ omega + bg + G @ f / G0, f + Sa @ f + ba
    found = compensated(rate, f_read, **values)
    assert found[0] == pytest.approx(omega, abs=1e-13) and found[1] == pytest.approx(f, abs=1e-13)


def test_without_values_the_readings_pass() -> None:
    found = compensated([0.1, -0.2, 0.3], [1.0, 2.0, -3.0])
    assert found[0] == pytest.approx([0.1, -0.2, 0.3], abs=0.0) and found[1] == pytest.approx([1.0, 2.0, -3.0], abs=0.0)


@pytest.mark.parametrize("name", ["gyro_scale", "acc_scale"])
def test_a_matrix_without_inverse_is_refused(name: str) -> None:
    flat = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]  # the first axis reads nothing
    with pytest.raises(ComponentError, match=f"{name}: 1 \\+ S has no inverse"):
        load_part("imu_compensator")(**{name: flat}).initialize()
