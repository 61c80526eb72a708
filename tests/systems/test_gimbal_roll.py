"""A roll of the base under an inner joint at an angle: the co-simulation against Hamilton's equations in scipy, the
budget, its second order, the warning; and the swaps that the README prints.
"""

from __future__ import annotations

import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import tf2ss
from support.gimbal_rides import ridden, rows

from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

pytestmark = pytest.mark.long

README = Path(__file__).parents[2] / "systems" / "gimbal_stabilization" / "README.md"
ASKEW = math.radians(40.0)
UP_TO = 1.0  # s, of the comparison
J = {"outer": np.diag([0.03] * 3), "inner": np.diag([0.045, 0.03, 0.045])}  # kg.m2, and a motor on each axis:
MOTOR, VISCOUS, K_T = 0.005, 0.01, 0.4


def turned(axis: str, angle: float, v: Any) -> Any:
    """Return v in axes that are turned by an angle about x or z."""
    c, s = math.cos(angle), math.sin(angle)
    if axis == "x":
        return np.array([v[0], c * v[1] + s * v[2], c * v[2] - s * v[1]])
    return np.array([c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]])


class Rigid:
    """The gimbal without modes by its kinetic energy alone, Hamilton's equations; joints (outer, inner).

    T = 1/2 w_A I_A w_A + 1/2 w_B I_B w_B + 1/2 J ((w_b + q3')3 ^2 + (w_A1 + q1')^2) on the outer and the inner axis.
    """

    def __init__(self, form: str, q: dict[str, Any], omega: Any) -> None:
        self.axes = "zx" if form == "yaw-pitch" else "xz"  # outer, inner joint
        self.omega = omega
        self.loops = []
        for axis in ("yaw", "pitch") if form == "yaw-pitch" else ("pitch", "yaw"):
            num, den = (np.trim_zeros(np.asarray(q[f"{axis}.{n}"], float), "b")[::-1] for n in ("num", "den"))
            self.loops.append(tf2ss(num, den))
        w = 2.0 * math.pi * q["gyro.bandwidth"]
        self.w = w

    def rates(self, t: float, q: Any, dq: Any) -> tuple[Any, Any, float, float]:
        e_outer, e_inner = (np.eye(3)["xyz".index(a)] for a in self.axes)
        w_b = self.omega(t)
        w_a = turned(self.axes[0], q[0], w_b) + dq[0] * e_outer
        w_in = turned(self.axes[1], q[1], w_a) + dq[1] * e_inner
        return w_a, w_in, float(e_outer @ w_a), float(e_inner @ w_a + dq[1])

    def energy(self, t: float, q: Any, dq: Any) -> float:
        w_a, w_in, motor_out, motor_in = self.rates(t, q, dq)
        return 0.5 * float(w_a @ J["outer"] @ w_a + w_in @ J["inner"] @ w_in + MOTOR * (motor_out**2 + motor_in**2))

    def speeds(self, t: float, q: Any, p: Any) -> Any:
        """Return q' of momenta p = dT/dq': T is a quadratic form, so three of its values give its matrix."""
        zero, e = self.energy(t, q, np.zeros(2)), np.eye(2)
        ahead = [self.energy(t, q, v) for v in e]
        behind = [self.energy(t, q, -v) for v in e]
        b = np.array([(a - c) / 2.0 for a, c in zip(ahead, behind, strict=True)])
        m = np.diag([a + c - 2.0 * zero for a, c in zip(ahead, behind, strict=True)])
        m[0, 1] = m[1, 0] = self.energy(t, q, e[0] + e[1]) - zero - b.sum() - 0.5 * (m[0, 0] + m[1, 1])
        return np.linalg.solve(m, p - b)

    def slope(self, t: float, y: Any) -> Any:
        q, p, star, gyro = y[:2], y[2:4], y[4:7], y[7:11].reshape(2, 2)
        dq = self.speeds(t, q, p)
        h = 1e-6
        force = np.array([
            (self.energy(t, q + h * v, dq) - self.energy(t, q - h * v, dq)) / (2.0 * h) for v in np.eye(2)
        ])  # fmt: skip
        w_in = self.rates(t, q, dq)[1]
        seen = np.array([w_in["xyz".index(a)] for a in self.axes])
        filtered = np.column_stack([gyro[:, 1], self.w**2 * (seen - gyro[:, 0]) - math.sqrt(2.0) * self.w * gyro[:, 1]])
        signal = gyro[:, 0] / np.array([math.cos(q[1]), 1.0])
        x, moved, volts = y[11:], [], []
        for (a, b, c, d), u in zip(self.loops, signal, strict=True):
            n = len(a)
            moved.append(a @ x[:n] + b[:, 0] * u)
            volts.append(-(c[0] @ x[:n] + d[0, 0] * u))
            x = x[n:]
        torque = K_T * np.array(volts) - VISCOUS * dq
        return np.concatenate([dq, torque + force, np.cross(star, w_in), filtered.ravel(), *moved])

    def line_of_sight(self, t: Any, q0: Any) -> Any:
        """Return the angles of the line of sight about x and z at times t; at rest at first."""
        p0 = np.array([
            (self.energy(0.0, q0, 1e-3 * v) - self.energy(0.0, q0, -1e-3 * v)) / 2e-3 for v in np.eye(2)
        ])  # fmt: skip
        states = sum(len(a) for a, *_ in self.loops)
        y0 = np.concatenate([q0, p0, [0.0, 1.0, 0.0], np.zeros(4 + states)])
        star = solve_ivp(self.slope, (0.0, t[-1]), y0, t_eval=t, rtol=1e-5, atol=1e-9, max_step=0.005).y[4:7]
        return np.array([np.arctan2(-star[2], star[1]), np.arctan2(star[0], star[1])])


@pytest.fixture(scope="module")
def roll(tmp_path_factory: Any) -> str:
    """Return a file with a vibration about y alone, of the vehicle's size."""
    file = tmp_path_factory.mktemp("psd") / "roll.csv"
    file.write_text("frequency [Hz],rate_y [deg2/s2/Hz]\n1,2\n3,2\n10,0.05\n")
    return str(file)


@pytest.mark.parametrize(("form", "inner"), [("yaw-pitch", "pitch"), ("pitch-yaw", "yaw")])
def test_a_roll_past_the_bearings_is_rigid_kinematics(form: str, inner: str, roll: str) -> None:
    """About the outer axis the loop alone takes tan 40 degrees of the roll: hundreds of µrad, in both forms.

    Of the same motion Hamilton's equations make the same line of sight within 2 % of its rms (the step of 0.2 ms).
    """
    given = {"bending": 0.0, "gyro_noise": 0.0, "psd": roll, "jitter_from": 10.0, "ride": 5.0}
    result, record = ridden(form=form, **{inner: ASKEW}, **given)
    t = record.channels["time"]
    omega = CubicSpline(t, np.array([record.channels[f"vibration.omega[{k}]"] for k in (1, 2, 3)]).T)
    use = (t > 0.0) & (t <= UP_TO)
    los = np.array([record.channels[f"platform.los[{k}]"] for k in (1, 2)])[:, use]
    model = Rigid(form, record.run.parameters, omega).line_of_sight(t[use], np.array([0.0, ASKEW]))
    outer = 1 if form == "yaw-pitch" else 0
    size = float(np.std(los[outer]))
    assert 2e-4 < size < 6e-4
    assert float(np.std(los[outer] - model[outer])) < 0.02 * size
    assert float(np.std(los[1 - outer] - model[1 - outer])) < 0.02 * size
    budget = rows(result)
    assert budget["motion of the base about y"][2] > 90.0
    assert any("40" not in w and "must follow it with 0.84 times its rate" in w for w in result.warnings)


@pytest.mark.parametrize("form", ["yaw-pitch", "pitch-yaw"])
def test_second_order_is_in_the_budget(form: str) -> None:
    """A vehicle four times as rough: the roll times the joint angle rules, 16 times as large; budget within 2 %."""
    result, _ = ridden(form=form, psd_scale=4.0, gyro_noise=0.0, ride=36.0)
    outer = "jitter yaw" if form == "yaw-pitch" else "jitter pitch"
    assert rows(result)["roll times joint angle"][2] > 20.0
    assert result[outer].estimate == pytest.approx(result[outer].closed, rel=0.02)


def printed_swaps() -> list[dict[str, str]]:
    """Return the parts of each printed command of the README that swaps some."""
    commands = re.findall(r"^ {4}gyrobench run gimbal_stabilization(.*?)(?:#.*)?$", README.read_text("utf-8"), re.M)
    words = [shlex.split(c) for c in commands]
    found = [dict(w[k + 1].split("=") for k, x in enumerate(w) if x == "--part") for w in words]
    return [f for f in found if f]


def test_printed_swaps_give_a_result() -> None:
    """With sines of the base, which a manoeuvre does not make: the isolation has no value, and the rest stands."""
    swaps = printed_swaps()
    assert swaps
    for parts in swaps:
        system: Any = load_system("gimbal_stabilization")
        for name, value in {"sweeps": False, "load_step": 0.0, "jitter_from": 4.0, "ride": 9.0}.items():
            system.set(name, value)
        with Session(system, parts) as session:
            result = system.reduce(session.run({}, seed=3))
        assert result["jitter"].estimate > 0.0
        if parts.get("motion") == "manoeuvre":
            assert "takes no test sines" in result["isolation x 1 Hz"].no_value
