"""Figures of the floated gyros of the bench in closed form.  [GYRO-DYN-1, GYRO-DYN-3]"""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument

from .model import read_off


def true_values(run: RunDocument, highest: float, output: bool) -> Array | None:
    """Return the figures of read_off of the gyro of a run; None for another gyro, a spring, an axis that leans."""
    name = run.parts["gyro"].name if "gyro" in run.parts else ""
    p = {n.removeprefix("gyro."): v for n, v in run.parameters.items() if n.startswith("gyro.")}
    if run.measured or name not in ("FloatedGyro", "CompliantGyro") or p.get("K", 0.0):
        return None
    if not np.array_equal(np.reshape(p.get("mount", np.eye(3)), (3, 3)), np.eye(3)):
        return None
    H, J, C = (float(p[n]) for n in ("H", "J", "C"))
    if not C > 0.0:
        return None
    tau, rest = J / C, []
    if name == "CompliantGyro":
        K_I, K_O = float(p["K_I"]), float(p["K_O"])
        a2 = H * H / (K_I * K_O)
        tau, rest = J / C + H * H / (K_I * C), [a2, a2 * J / C]
    return read_off(np.array([0.0 if output else math.log(H / C), math.log(tau), *rest]), highest, H, output)
