"""Inductosyns that are started, and that follow a table."""

import math

import numpy as np
from wired import BENCH

from gyrobench.packaging import load_part

Inductosyn = load_part("inductosyn", BENCH)
ARCSEC = math.pi / 648000.0
DEG = math.pi / 180.0
H = 1e-3
CLEAN = {f"encoder_{n}": 0.0 for n in ("eccentricity", "tilt", "pitch", "d0", "de", "e3", "e5", "reading")}
#: 2 kHz and 10 MHz: 5000 counts of 1e-4 deg to half a degree; 7.2 MHz: 3600 coarse counts of 0.1 deg
KHZ2 = {"f_0": 2000.0, "f_T": 10e6, "f_c": 7.2e6, "quantum": 1e-4 * DEG}
PULSE = {"mode": 2, "f_0": 2000.0, "f_T": 7.2e6, "f_c": 7.2e6, "quantum": ARCSEC, "rate_max": 9e-3}


def started(angle=0.0, rate=0.0, **parameters):
    part = Inductosyn(**{**CLEAN, **parameters})
    part.angle, part.rate = angle, rate
    part.initialize()
    return part


def follow(part, angle, rate, until, h=H, start=0.0):
    """Step along angle(t), rate(t); return rows (t, reading minus angle(t_read), t_read, lost)."""
    rows = []
    for k in range(round(start / h), round(until / h)):
        t = (k + 1) * h
        part.angle, part.rate = angle(t), rate(t)
        part.do_step(k * h, h)
        rows.append((t, part.angle_read - angle(part.t_read), part.t_read, part.lost))
    return np.array(rows)
