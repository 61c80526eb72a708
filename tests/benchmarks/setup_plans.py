"""Default plans of the servo tests, of the eight positions and of tests in one attitude for setup_effects.py.

Windows in deg/h, from the equations, with what a misalignment of the input axis does to them, and the candidates of
their reductions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench import drift, frames
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.nuisances import Candidate

ARCSEC = math.pi / 180.0 / 3600.0
PHI = math.radians(45.75)
EARTH = math.degrees(frames.EARTH_RATE) * 3600.0  # deg/h
POLE = frames.pole(PHI)


@dataclass(frozen=True)
class Plan:
    """Times (n,) s, design (n, p), effect of a tilt of 1 arcsec, number of each window's mount, candidates."""

    t0: np.ndarray
    t1: np.ndarray
    X: np.ndarray
    names: tuple[str, ...]
    tilt: np.ndarray
    mount: np.ndarray
    candidates: list[Candidate]
    readings: bool = False


def servo_polar() -> Plan:
    """Two dwells of 6 windows of 600 s with the input axis east, output axis up and down, then 144 against (mount S)
    and along the pole, in which the table turns once a day.  A tilt towards the output axis sees the Earth in the
    dwells.
    """
    east = np.array([1.0, 0.0, 0.0])
    t0, rows, tilt, mount, t = [], [], [], [], 0.0
    for phase, (x, y, count) in enumerate(
        ((east, frames.U, 6), (east, -frames.U, 6), (-POLE, east, 144), (POLE, east, 144))
    ):
        t += 60.0
        for k in range(count):
            # among the stars the gyro stands still: its table turns against the Earth, about its own axis x
            angle = -float(x @ POLE) * 2.0 * math.pi * (k + 0.5) / 144.0
            gyro = np.array([x, y, np.cross(x, y)])
            gyro = (
                np.array([[1, 0, 0], [0, math.cos(angle), math.sin(angle)], [0, -math.sin(angle), math.cos(angle)]])
                @ gyro
            )
            rows.append(drift.regressors(gyro @ -frames.U, drift.terms(9)))
            tilt.append(-EARTH * float(gyro[1] @ POLE) * ARCSEC)
            t0.append(t)
            mount.append(phase)
            t += 600.0
    start, column, number = np.array(t0), np.array(tilt), np.array(mount)
    found = [
        Candidate("tilt", "misalignment", "arcsec", 1.0, column, visible=0.1),
        nuisances.trend(start, start + 600.0),
        nuisances.scatter("mount", "remount", mount),
    ]
    return Plan(start, start + 600.0, np.array(rows), drift.terms(9), column, number, found, True)


def servo_vertical_level() -> Plan:
    """Twice six attitudes of 10 windows of 60 s: input axis down, up, and east with y up, y down, z up, z down."""
    E, N, U = frames.E, frames.N, frames.U
    attitudes = [(-U, E), (U, E), (E, U), (E, -U), (E, -N), (E, N)] * 2
    gyro = np.repeat([[x, y, np.cross(x, y)] for x, y in attitudes], 10, axis=0)
    phase = np.repeat(np.arange(12), 10)
    start = 70.0 * phase + 60.0 * np.arange(120.0)
    names = ("D_F", "D_I", "D_S", "D_O", "D_II", "D_SS")
    X = np.array([drift.regressors(g @ -U, names) for g in gyro])
    tilt = -EARTH * (gyro[:, 1] @ POLE) * ARCSEC
    found = [
        Candidate("tilt", "misalignment", "arcsec", 1.0, tilt, visible=0.1),
        Candidate("tilt z", "misalignment", "arcsec", 1.0, -EARTH * (gyro[:, 2] @ POLE) * ARCSEC, visible=0.1),
        nuisances.trend(start, start + 60.0),
        nuisances.scatter("mount", nuisances.MOUNTS, phase.tolist()),
    ]
    return Plan(start, start + 60.0, X, names, tilt, phase, found, True)


def servo_two_axis() -> Plan:
    """A day in each of mounts 2 (x east, y up) and 4 (x north, y up), 144 windows of 600 s; channel x.  A gyro without
    drift keeps x and y free of rotation by the angles x and y of the axes (Hu 1981, eq. 3-97 without drift) and rolls
    about z.
    """
    E, N, U = frames.E, frames.N, frames.U
    rows, t0, t = [], [], 0.0
    for first in (E, N):
        base = np.array([first, U, np.cross(first, U)])
        e, up = base @ POLE * frames.EARTH_RATE, base @ U

        def rates(a: np.ndarray, e: np.ndarray = e) -> np.ndarray:
            x, y = a
            across = e[1] * math.sin(x) - e[2] * math.cos(x)
            return np.array([-e[0] - across * math.tan(y), -e[1] * math.cos(x) - e[2] * math.sin(x)])

        t, a, h = t + 60.0, np.zeros(2), 30.0
        for k in range(2880):  # RK4; rows at the middle of 600 s
            if k % 20 == 10:
                (sx, sy), (cx, cy) = np.sin(a), np.cos(a)
                A = np.array([[cy, sx * sy, -cx * sy], [0.0, cx, sx], [sy, -cy * sx, cx * cy]])
                gx, gy, gz = -A @ up
                rows.append([1.0, gx, gy, gz, gx * gx, gz * gz, gx * gy, gy * gz, gx * gz])
                t0.append(t + 600.0 * (k // 20))
            k1 = rates(a)
            k2 = rates(a + h / 2.0 * k1)
            k3 = rates(a + h / 2.0 * k2)
            a = a + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rates(a + h * k3))
        t += 86400.0
    start, mount = np.array(t0), np.repeat([0, 1], 144)
    found = [nuisances.trend(start, start + 600.0), nuisances.scatter("mount", nuisances.MOUNTS, mount.tolist())]
    names = ("0", "x", "y", "z", "xx", "zz", "xy", "yz", "xz")
    return Plan(start, start + 600.0, np.array(rows), names, np.zeros(288), mount, found, True)


def eight_position() -> Plan:
    """Ten cycles of the eight positions, the ten readings of each averaged: 60 s every 70 s.  The current about x
    measures k I = w_y - R - ... ; the k of the first column is the scale factor less the assumed one over 1000.
    """
    E, N, U = frames.E, frames.N, frames.U
    both = [(E, N), (N, -E), (-E, -N), (-N, E), (U, E), (-E, U), (-U, -E), (E, -U)] * 10
    w = EARTH * np.array([[x @ POLE, y @ POLE] for x, y in both])
    g = -np.array([[x @ U, y @ U, np.cross(x, y) @ U] for x, y in both])
    X = np.column_stack([1e-3 * w[:, 1], np.ones(80), g[:, 2], -g[:, 1], g[:, 1] ** 2, g[:, 0]])
    start = 70.0 * np.arange(80.0)
    tilt = -w[:, 0] * ARCSEC
    found = [Candidate("tilt", "misalignment", "arcsec", 1.0, tilt), nuisances.trend(start, start + 60.0)]
    return Plan(start, start + 60.0, X, ("k", "R", "u", "u_z", "q", "s"), tilt, np.arange(80), found)


def fixed_position(readings: bool = False) -> Plan:
    """Thirty windows of two minutes in one attitude, which shows no tilt.  readings: open_loop_drift, their data are
    differences of readings.
    """
    start, nothing = 120.0 * np.arange(30.0), np.zeros(30)
    found = [nuisances.trend(start, start + 120.0)]
    return Plan(start, start + 120.0, np.ones((30, 1)), ("D",), nothing, np.zeros(30, int), found, readings)


PLANS = {
    "servo_polar": servo_polar,
    "servo_vertical_level": servo_vertical_level,
    "servo_two_axis": servo_two_axis,
    "eight_position": eight_position,
    "fixed_position": fixed_position,
    "open_loop_drift": lambda: fixed_position(True),
}
STILL = ("fixed_position", "open_loop_drift", "servo_vertical_level", "servo_two_axis")  # of a tilt nothing is seen
