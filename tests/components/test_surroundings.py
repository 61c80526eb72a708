"""Temperature and magnetic field: the surroundings in time, and what they do to the gyros."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import BENCH, DEG_H

from gyrobench.packaging.instance import InstanceError, Plain
from gyrobench.packaging.loading import load_part

Surroundings = load_part("surroundings", BENCH)
HEAT = {"offset": 1.5, "ramp": 2e-4, "swing": 3.0, "period": 86400.0, "phase": 0.7, "tau": 5400.0, "start_above": -4.0}
ROOM = lambda t: 1.5 + 2e-4 * t + 3.0 * math.sin(2.0 * math.pi / 86400.0 * t + 0.7)  # noqa: E731


def instance(cls, **values):
    made = Plain(cls)
    made.set(values)
    return made


def test_the_temperature_is_the_solution_of_its_differential_equation():
    """tau T' = room - T from room(0) + start_above, by an integrator that shares no code; in steps of an hour."""
    made = instance(Surroundings, **HEAT, **{"share[2]": 0.1, "gradient[2]": 0.3, "gradient_ramp[2]": 1e-5})
    made.initialize(0.0)
    times = np.arange(0.0, 86400.0 + 1.0, 3600.0)
    right = solve_ivp(lambda t, y: [(ROOM(t) - y[0]) / 5400.0], (0.0, times[-1]), [ROOM(0.0) - 4.0], t_eval=times,
                      rtol=1e-12, atol=1e-12).y[0]  # fmt: skip
    for k, t in enumerate(times):
        temperature, room, along = made.get(["temperature", "room", "dT[2]"])
        assert temperature == pytest.approx(right[k], abs=1e-9)
        assert room == pytest.approx(ROOM(t), abs=1e-12)
        assert along == pytest.approx(0.3 + 1e-5 * t + 0.1 * (ROOM(t) - right[k]), abs=1e-9)
        made.step(t, 3600.0)


def test_without_a_time_constant_the_instrument_has_the_temperature_of_the_room():
    made = instance(Surroundings, **{**HEAT, "tau": 0.0, "start_above": 0.0})
    made.initialize(0.0)
    made.step(0.0, 1000.0)
    assert made.get(["temperature"])[0] == made.get(["room"])[0] == pytest.approx(ROOM(1000.0), abs=1e-12)


def test_a_start_above_the_room_needs_a_time_constant():
    with pytest.raises(InstanceError, match=r"start_above = 2 K needs a time constant: tau must be above 0 s"):
        instance(Surroundings, start_above=2.0).initialize(0.0)


def test_the_field_is_turned_into_the_axes_of_the_instrument():
    """Table axis up: base = unit matrix.  At a table angle of 90 degrees the table's x axis points north, its y axis
    west; face rows: I along table z (up), O along table x (north), S along table y (west).  A field of 20 uT north and
    44 uT down is then (-44, 20, 0) uT, and a difference of 1 uT along east (0, 0, -1) uT.
    """
    made = instance(Surroundings, **{"field[2]": 20e-6, "field[3]": -44e-6, "field_difference[1]": 1e-6})
    face = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], dtype=float)
    made.set({f"face[{i + 1},{j + 1}]": face[i, j] for i in range(3) for j in range(3)} | {"angle": math.pi / 2})
    made.initialize(0.0)
    assert made.get(["B[1]", "B[2]", "B[3]"]) == pytest.approx([-44e-6, 20e-6, 0.0], abs=1e-20)
    assert made.get(["dB[1]", "dB[2]", "dB[3]"]) == pytest.approx([0.0, 0.0, -1e-6], abs=1e-20)


# ---------------------------------------------------------------------------------------- the gyros
EXPOSED = {"temperature": 4.0, "B[1]": 1e-5, "B[2]": 2e-5, "B[3]": -3e-5, "dB[1]": 1e-6, "dB[2]": 0.0, "dB[3]": 5e-6}
SDF = {"D_T": 0.02 * DEG_H, "D_B[1]": 100.0 * DEG_H, "D_B[3]": 50.0 * DEG_H, "D_dB[3]": 1000.0 * DEG_H}
#: a mount that turns the case by 90 degrees about O: gyro I = case S, gyro S = -case I
MOUNT = {"mount[1,1]": 0.0, "mount[1,3]": 1.0, "mount[3,1]": -1.0, "mount[3,3]": 0.0}


@pytest.mark.parametrize("part", ["floated_gyro", "compliant_gyro"])
def test_drift_of_a_floated_gyro_by_temperature_and_field(part):
    """0.02 x 4 = 0.08; B along I = case S = -3e-5 T, along S = -1e-5 T: -0.003 and -0.0005; dB along S = -1e-6 T:
    -0.001: 0.0755 deg/h in all, whatever the attitude.
    """
    cls = load_part(part, BENCH)
    quiet = {"markov": 0.0, "white": 0.0, "pickoff": 0.0, "f[2]": 9.81}
    drifts = []
    for values in ({}, {**SDF, **EXPOSED}):
        made = instance(cls, **quiet, **MOUNT, **values)
        made.initialize(0.0)
        drifts.append(made.get(["drift"])[0])
    assert drifts[1] - drifts[0] == pytest.approx(0.0755 * DEG_H, rel=1e-9)


@pytest.mark.parametrize("part", ["floated_gyro", "compliant_gyro"])
def test_the_torquer_is_stronger_when_warm(part):
    """k_T = 1e-3/K at 4 K: the float is still with a current that is 1/1.004 of the one at the reference."""
    cls = load_part(part, BENCH)
    made = instance(cls, markov=0.0, white=0.0, pickoff=0.0, k_T=1e-3, temperature=4.0)
    drift, k = -0.3 * DEG_H, 17.2e3 * DEG_H  # D_F at f = 0, omega = 0: k i = -drift
    made.set({"i": -drift / (1.004 * k)})
    made.initialize(0.0)
    made.step(0.0, 1.0)
    assert made.get(["b"])[0] == pytest.approx(0.0, abs=1e-15)
    made = instance(cls, markov=0.0, white=0.0, pickoff=0.0, temperature=4.0, i=-drift / (1.004 * k))
    made.initialize(0.0)
    made.step(0.0, 1.0)
    assert abs(made.get(["b"])[0]) > 1e-9  # without k_T the same current leaves 0.4 % of the drift


def test_drift_of_both_channels_of_a_two_axis_gyro():
    """x: 0.02 x 4 + 100 x 1e-5 = 0.081 deg/h; y: -0.01 x 4 + 1000 x 5e-6 = -0.035 deg/h."""
    cls = load_part("gyro_2dof", BENCH)
    given = {"Dx_T": 0.02, "Dx_B[1]": 100.0, "Dy_T": -0.01, "Dy_dB[3]": 1000.0}
    quiet = {f"{n}_{c}": 0.0 for n in ("markov", "white", "pickoff") for c in "xy"}
    found = []
    for values in ({}, {n: v * DEG_H for n, v in given.items()} | EXPOSED):
        made = instance(cls, **quiet, **values)
        made.initialize(0.0)
        found.append(made.get(["drift_x", "drift_y"]))
    change = np.array(found[1]) - np.array(found[0])
    assert change == pytest.approx(np.array([0.081, -0.035]) * DEG_H, rel=1e-9)
