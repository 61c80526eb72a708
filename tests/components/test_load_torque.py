"""load_torque and stabilizer_power: sums, gains, limit, refusals."""

import math

import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

LoadTorque = load_part("load_torque", BENCH)
StabilizerPower = load_part("stabilizer_power", BENCH)


def test_torques_add_up_axis_by_axis():
    part = LoadTorque(
        constant=[0.1, 0.2, 0.3], amplitude=[0.0, 0.5, 0.0], frequency=[1.0, 5.0, 1.0], phase=[0.0, 0.3, 0]
    )
    part.torque[:] = [1.0, 2.0, 3.0]
    part.initialize()
    part.do_step(0.0, 0.01)
    wave = 0.5 * math.sin(2 * math.pi * 5.0 * 0.01 + 0.3)
    assert [part.get(f"M[{k}]") for k in (1, 2, 3)] == pytest.approx([1.1, 2.2 + wave, 3.3], rel=1e-14)


def test_random_torque_has_its_density():
    """The mean over T has variance density2 / T: over 1e4 steps of 1 ms, T = 10 s; the mean square of a step is
    density2 / h.  5 sigma of a chi-square of 1e4 is 7 %."""
    part = LoadTorque(white_y=0.02, seed=5)
    part.initialize()
    values = []
    for k in range(10000):
        part.do_step(k * 1e-3, 1e-3)
        values.append(part.get("M[2]"))
    assert sum(v * v for v in values) / 1e4 == pytest.approx(0.02**2 / 1e-3, rel=0.07)
    assert abs(sum(values) / 1e4) < 5 * 0.02 / math.sqrt(10.0)
    assert part.get("M[1]") == 0.0


def test_power_stabilizer_is_a_spring_of_stiffness_k_m():
    """K_m = ratio k_u k_i k_m = 50 * 8 * 5 * 0.03 = 60 N.m/rad; at b = 0.02 rad u = k_u b = 0.16 V."""
    part = StabilizerPower(k_u=8.0, k_i=5.0, k_m=0.03, ratio=50.0)
    part.u, part.test, part.M_load = 0.16, 0.04, 0.7
    part.initialize()
    assert part.get("M") == pytest.approx(-60.0 * 0.02 - 50 * 0.03 * 5 * 0.04 + 0.7, rel=1e-14)
    assert part.get("e") == pytest.approx(0.2, rel=1e-15)
    assert part.get("v") == pytest.approx(-1.0, rel=1e-15)
    assert part.get("saturated") == 0.0


def test_polarity_turns_the_signal_and_nothing_else():
    parts = [StabilizerPower(polarity=s) for s in (1, -1)]
    for part, sign in zip(parts, (1.0, -1.0), strict=True):
        part.u, part.test = sign * 0.1, 0.02
        part.initialize()
    assert parts[0].get("M") == parts[1].get("M") and parts[1].get("e") == pytest.approx(0.12)
    with pytest.raises(ComponentError, match="polarity must be 1 or -1"):
        StabilizerPower(polarity=0).initialize()


def test_motor_limit():
    part = StabilizerPower(v_max=2.0)
    part.u = 1.0
    part.initialize()
    assert part.get("v") == -2.0 and part.get("saturated") == 1.0
    assert part.get("M") == pytest.approx(-2.0 * 0.01 * 100.0)


GYRO = {"H_g": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0}


def test_routh_limit():
    """(10/0.5 + 2/0.02) (10 + 10*2/10) = 120 * 12 = 1440 N.m/rad [STAB-POWER-2DOF]; k_u k_i ratio = 10 * 10 * 100."""
    StabilizerPower(**GYRO, k_m=0.999 * 0.144).initialize()
    with pytest.raises(ComponentError, match=r"at or beyond the Routh limit 1440 N\.m/rad"):
        StabilizerPower(**GYRO, k_m=0.144 * 1.0001).initialize()
    StabilizerPower(**GYRO, k_m=0.2, allow_unstable=1).initialize()
    StabilizerPower(k_m=0.2).initialize()  # not told the gyro: not judged


@pytest.mark.parametrize("name", ["k_u", "k_i", "k_m", "ratio", "J_x", "J_y"])
def test_zero_is_refused(name):
    with pytest.raises(ComponentError, match=name):
        StabilizerPower(**{name: 0.0}).initialize()
