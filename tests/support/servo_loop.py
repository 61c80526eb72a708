"""The servo loop of the tests: table and gyro, as native FMUs or, to be linearized, as plain classes."""

from __future__ import annotations

import math

import numpy as np
from wired import BENCH, NO_DRIFT, QUIET, FloatedGyro, Native

from gyrobench.packaging import load_part

TableServo = load_part("table_servo", BENCH)

ARCSEC = math.pi / 648000.0
GCM = 9.80665e-5  # g.cm, N.m
H = 1e-4
ALONG = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]  # input axis along the table axis
FAST = {"H": 0.04, "J": 1.2e-5, "C": 0.03, "K_sg": 10.0}  # 0.4 ms, sensor of TABLE-SERVO: H/c 4/3
SLOW = {"H": 0.04, "J": 3e-5, "C": 0.03, "K_sg": 10.0}  # 1 ms
FREE = {"H": 0.04, "J": 3e-5, "C": 1e-9, "K_sg": 10.0}  # undamped


class Loop:
    """Table and gyro, table first: each sees the newest output of the other."""

    def __init__(self, gyro=SLOW, *, h=H, face=ALONG, inputs=None, gyro_parameters=None, plain=False, **parameters):
        self.h, self.k = h, 0
        gyro_values = {**QUIET, **NO_DRIFT, **gyro, **(gyro_parameters or {})}
        self.gyro = FloatedGyro(**gyro_values) if plain else Native("floated_gyro", **gyro_values)
        design = dict(zip(("H_g", "J_g", "C_g", "K_g"), (gyro[n] for n in ("H", "J", "C", "K_sg")), strict=True))
        table_values = {"capture": 0, **design, **parameters}
        self.table = TableServo(**table_values) if plain else Native("table_servo", **table_values)
        self.table.mode, self.table.face = 3.0, face
        for name, x in (inputs or {}).items():
            setattr(self.table, name, x)
        self.table.initialize()
        self.gyro.initialize()
        self.K_T = self.table.gain * gyro["K_sg"] * gyro["H"] / gyro["C"]

    def run(self, duration, torque=None):
        track = []
        for _ in range(round(duration / self.h)):
            t = self.k * self.h
            if torque:
                self.table.torque = torque(t)
            self.table.u = self.gyro.u
            self.table.do_step(t, self.h)
            for name in ("omega", "alpha", "f"):
                setattr(self.gyro, name, list(getattr(self.table, name)))
            self.gyro.do_step(t, self.h)
            self.k += 1
            part = self.table
            track.append((t + self.h, part.angle, part.rate, part.motor, part.saturated, part.in_position, self.gyro.b))
        return np.array(track)
