"""Quick form of an inertial measurement unit: its equations, its noises."""

from __future__ import annotations

import numpy as np
import pytest
from native_parts import make
from scipy.spatial.transform import Rotation

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

G0 = 9.80665
SILENT = {f"{a}_{n}": 0.0 for a in "xyz" for n in ("gyro", "acc")}


def test_equations() -> None:
    rng = np.random.default_rng(1)
    Sg, Sa, G = rng.normal(size=(3, 3, 3)) * 0.01
    bg, ba, omega, f = rng.normal(size=(4, 3))
    M = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix().T
    part = load_part("imu")(
        **SILENT, gyro_bias=bg.tolist(), gyro_scale=Sg.tolist(), g_sensitivity=G.tolist(), acc_bias=ba.tolist(),
        acc_scale=Sa.tolist(), mount=M.tolist(),
    )  # fmt: skip
    part.omega, part.f = omega.tolist(), f.tolist()
    part.initialize()
    part.do_step(0.0, 0.01)
    w, a = M @ omega, M @ f
    assert part.rate == pytest.approx(w + Sg @ w + bg + G @ a / G0, abs=1e-14)
    assert part.f_read == pytest.approx(a + Sa @ a + ba, abs=1e-13)


def test_noises_of_an_axis_are_its_own() -> None:
    """White noise scaled by the step; a Gauss-Markov bias whose neighbours at 0.01 s of 10 s are nearly alike."""
    one = make("imu", "native")
    one.set({f"{a}_{n}": 0.0 for a in "xyz" for n in ("gyro", "acc")})
    one.set({"x_gyro": 1e-4, "z_acc": 2e-3, "y_gyro_bias": 1e-5, "gyro_bias_tau": 10.0})
    one.initialize(0.0)
    rows = []
    for k in range(4000):
        one.step(0.01 * k, 0.01)
        rows.append(one.get(["rate[1]", "rate[2]", "rate[3]", "f_read[1]", "f_read[3]"]))
    one.free()
    got = np.array(rows)
    assert np.std(got[:, 0]) == pytest.approx(1e-3, rel=0.05)  # 1e-4 / sqrt(0.01)
    assert np.std(got[:, 4]) == pytest.approx(2e-2, rel=0.05)
    assert np.ptp(got[:, 2]) == 0.0 and np.ptp(got[:, 3]) == 0.0
    # steps of sqrt(2 h/tau) rms = sqrt(0.002) 1e-5
    assert np.std(np.diff(got[:, 1])) == pytest.approx(1e-5 * np.sqrt(0.002), rel=0.05)


def test_mount_must_be_a_rotation() -> None:
    with pytest.raises(ComponentError, match="mount is not a rotation matrix"):
        load_part("imu")(mount=[[1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]]).initialize()
