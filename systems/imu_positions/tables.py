"""Tables of both triads together: how to correct readings, and the angles between the input axes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.result import Coefficient, Table
from gyrobench.units import factor

AXES = "xyz"
TRIADS = {"g": ("gyros", "rad/s"), "a": ("accelerometers", "m/s²")}
SCALE = {"ppm": 1e-6, "″": factor("arcsec"), "°/h": factor("deg/h"), "°/h/g": factor("deg/h"), "µg": factor("ug")}


def tables(coefficients: Sequence[Coefficient]) -> list[Table]:
    """Return the corrections in SI and the angles between the axes of each triad that the record determines."""
    si = {c.name: c.estimate * SCALE[c.unit] for c in coefficients if c.unit in SCALE}
    type_a = {c.name: (c.u_a or 0.0) * SCALE[c.unit] for c in coefficients if c.unit in SCALE}
    corrections: list[list[Any]] = []
    angles: list[list[Any]] = []
    for kind, (words, unit) in TRIADS.items():
        matrix = np.eye(3) + np.array([[si.get(f"S{kind}_{a}{b}", 0.0) for b in AXES] for a in AXES])
        inverse = np.linalg.inv(matrix)
        for i, a in enumerate(AXES):
            corrections.append([words, a, *(float(x) for x in inverse[i]), si[f"b{kind}_{a}"], unit])
        angles += _angles(kind, words, matrix, type_a)
    caption = (
        "true = C (reading − b), gyros: C (reading − b − G f/g0), SI; C is the inverse of the unit matrix plus S. "
        "Elements that the record does not determine are taken as zero"
    )
    head = ["triad", "row", "C, x", "C, y", "C, z", "b", "unit of b"]
    out = [Table("imu.correction", "Correction of readings", caption, head, corrections)]
    if angles:
        caption = "Angle between two input axes less 90°; the same however the case stands on the plate. u: noise alone"
        head = ["triad", "axes", "angle − 90° / ″", "u, type A / ″"]
        out.append(Table("imu.angles", "Angles between the input axes", caption, head, angles))
    return out


def _angles(kind: str, words: str, matrix: Array, type_a: Mapping[str, float]) -> list[list[Any]]:
    rows = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        names = f"S{kind}_{AXES[i]}{AXES[j]}", f"S{kind}_{AXES[j]}{AXES[i]}"
        if not all(n in type_a for n in names):
            continue
        a, b = matrix[i], matrix[j]
        angle = math.acos(float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))) - math.pi / 2.0
        u = math.hypot(*(type_a[n] for n in names))
        rows.append([words, f"{AXES[i]}{AXES[j]}", angle / factor("arcsec"), u / factor("arcsec")])
    return rows
