"""imu_compensator undoes an imu with the same values, exactly.  [IMU-POSITIONS]"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

G0 = 9.80665


def compensated(rate: Any, f_read: Any, **values: Any) -> tuple[Any, Any]:
    path = values.pop("temperature", [0.0, 0.0])
    part = load_part("imu_compensator")(**values)
    part.rate, part.f_read = (np.asarray(v).tolist() for v in (rate, f_read))
    part.temperature = path[0]
    part.initialize()
    part.temperature = path[1]
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


def test_temperature_is_undone_as_imu_makes_it() -> None:
    """25 to 25.02 K in 10 ms: T' = 2 K/s, z = 2 * 0.02/4 = 0.01; the readings by numpy."""
    rng = np.random.default_rng(4)
    shapes = {"bias_T": 1e-4, "bias_T2": 1e-6, "bias_T3": 1e-8, "hysteresis": 1e-3, "ramp": 1e-4, "scale_T": 1e-4,
              "scale_T2": 1e-6}  # fmt: skip
    own = {k: {n: rng.normal(size=3) * s for n, s in shapes.items()} for k in ("gyro", "acc")}
    omega, f = rng.normal(size=(2, 3))
    T, z, slope = 25.02, 0.01, 2.0
    read = {}
    for k, v in (("gyro", omega), ("acc", f)):
        o = own[k]
        bias = o["bias_T"] * T + o["bias_T2"] * T**2 + o["bias_T3"] * T**3 + o["hysteresis"] * z + o["ramp"] * slope
        read[k] = v * (1.0 + o["scale_T"] * T + o["scale_T2"] * T**2) + bias
    values = {f"{k}_{n}": v.tolist() for k, o in own.items() for n, v in o.items()} | {"hysteresis_width": 4.0}
    found = compensated(read["gyro"], read["acc"], temperature=[25.0, T], **values)
    assert found[0] == pytest.approx(omega, abs=1e-12) and found[1] == pytest.approx(f, abs=1e-12)
    part = load_part("imu")(**values, **{f"{a}_{n}": 0.0 for a in "xyz" for n in ("gyro", "acc")},
                            gyro_bias=[0.0] * 3, acc_bias=[0.0] * 3, gyro_scale=[[0.0] * 3] * 3,
                            acc_scale=[[0.0] * 3] * 3, g_sensitivity=[[0.0] * 3] * 3)  # fmt: skip
    part.omega, part.f, part.temperature = omega.tolist(), f.tolist(), 25.0
    part.initialize()
    part.temperature = T
    part.do_step(0.0, 0.01)
    assert part.rate == pytest.approx(read["gyro"], abs=1e-12) and part.f_read == pytest.approx(read["acc"], abs=1e-12)


def test_without_values_the_readings_pass() -> None:
    found = compensated([0.1, -0.2, 0.3], [1.0, 2.0, -3.0])
    assert found[0] == pytest.approx([0.1, -0.2, 0.3], abs=0.0) and found[1] == pytest.approx([1.0, 2.0, -3.0], abs=0.0)


@pytest.mark.parametrize("name", ["gyro_scale", "acc_scale"])
def test_a_matrix_without_inverse_is_refused(name: str) -> None:
    flat = [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]  # the first axis reads nothing
    with pytest.raises(ComponentError, match=f"{name}: 1 \\+ S has no inverse"):
        load_part("imu_compensator")(**{name: flat}).initialize()
