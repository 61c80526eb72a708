"""Two-degree-of-freedom gyros without drift and noise, alone and in their loops."""

import math

import numpy as np
from wired import BENCH, Native, Wired, begun, given

from gyrobench.packaging import load_part

Gyro2dof = load_part("gyro_2dof", BENCH)
H = 1e-3
G0 = 9.80665
TERMS = ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")
QUIET = dict.fromkeys(("markov_x", "markov_y", "white_x", "white_y", "pickoff_x", "pickoff_y"), 0.0)
NO_DRIFT = {f"D{c}_{n}": 0.0 for c in "xy" for n in TERMS}
STILL = {**QUIET, **NO_DRIFT}


def started(plain=False, **values):
    return begun(Gyro2dof if plain else "gyro_2dof", **values)


def looped(late=False, **parameters):
    """The gyro and two rebalances: u_x feeds i_y, u_y feeds i_x."""
    parts = {
        "gyro": given("gyro_2dof", **{**QUIET, **parameters}),
        "about_y": Native("rebalance_analog", meter=0.0),
        "about_x": Native("rebalance_analog", meter=0.0),
    }
    wires = [("gyro.u_x", "about_y.u"), ("about_y.i", "gyro.i_y"), ("gyro.u_y", "about_x.u"), ("about_x.i", "gyro.i_x")]
    return Wired(parts, list(parts), wires, late)


def settled(seconds=5.0, **parameters):
    pair = looped(**parameters)
    for _ in range(round(seconds / H)):
        pair.step(H)
    return pair.parts["gyro"]


def drift(part, channel, f):
    """omega_d by a sum over the names of the coefficients."""
    v = dict(zip("xyz", -np.asarray(f) / G0, strict=True))
    return sum(getattr(part, f"D{channel}_{n}") * math.prod(v[a] for a in n if a != "0") for n in TERMS)
