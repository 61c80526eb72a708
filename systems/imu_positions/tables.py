"""Tables of both triads together: how to correct readings, and the angles between the input axes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.result import Coefficient, DriftTestResult, Table
from gyrobench.units import factor

from . import channels, thermal
from .channels import CHANNELS
from .geometry import Motion

AXES = "xyz"
#: printed unit -> SI, of all coefficients of the test
SCALES = {**channels.SCALES, **thermal.SCALES}
TRIADS = {"g": ("gyros", "rad/s"), "a": ("accelerometers", "m/s²")}


def tables(coefficients: Sequence[Coefficient]) -> list[Table]:
    """Return the corrections and the angles between the axes of each triad, as far as the record determines them."""
    by_name = {c.name: c for c in coefficients if c.unit in SCALES}
    corrections: list[list[Any]] = []
    angles: list[list[Any]] = []
    for kind, (words, unit) in TRIADS.items():
        if f"b{kind}_x" not in by_name:
            continue
        matrix = _matrix(kind, by_name)
        inverse = np.linalg.inv(matrix)
        for i, a in enumerate(AXES):
            bias = by_name[f"b{kind}_{a}"]
            counts = bias.unit == "counts"
            value = bias.estimate * SCALES[bias.unit]
            corrections.append([words, a, *(float(x) for x in inverse[i]), value, "counts" if counts else unit])
        angles += _angles(kind, words, matrix, by_name)
    caption = (
        "true = C (reading − b), gyros: C (reading − b − G f/g0), SI; C is the inverse of the unit matrix plus S, of "
        "counts that of the scale factors times it. Elements that the record does not determine are taken as zero"
    )
    head = ["triad", "row", "C, x", "C, y", "C, z", "b", "unit of b"]
    out = [Table("imu.correction", "Correction of readings", caption, head, corrections)]
    if angles:
        caption = "Angle between two input axes less 90°; the same however the case stands on the plate. u: noise alone"
        head = ["triad", "axes", "angle − 90° / ″", "u, type A / ″"]
        out.append(Table("imu.angles", "Angles between the input axes", caption, head, angles))
    return out


def by_position(windows: Mapping[str, Any], motion: Motion, found: DriftTestResult) -> Table:
    """Return what is left of the mean reading of each instrument in each phase."""
    phase = np.asarray(windows["phase"]).astype(int)
    left = {s.label: (np.rint(s.x), np.asarray(s.residual)) for s in found.series}
    rows: list[list[Any]] = []
    for p in np.unique(phase):
        k = int(np.flatnonzero(phase == p)[0])
        turned = [math.degrees((end[k] - start[k]) / motion.length[k]) for start, end in (motion.outer, motion.inner)]
        at = [math.degrees(start[k]) for start, _ in (motion.outer, motion.inner)]
        rest = bool(motion.at_rest[k])
        means = [
            float(np.mean(r[x == p])) if np.any(x == p) else None
            for x, r in (left[f"{c.name}: {c.words}"] for c in CHANNELS)
        ]
        rows.append([int(p), *(at if rest else [None, None]), 0.0 if rest else max(turned, key=abs), *means])
    head = ["phase", "outer / °", "inner / °", "rate / (°/s)"]
    head += [f"{c.name} / {'(°/h)' if c.gyro else 'µg'}" for c in CHANNELS]
    caption = (
        "Mean of the readings of a phase less the fit. One that stands out is a position that was mistaken; an "
        "accelerometer off alike wherever its axis is level, and the other way where it is up or down, has a square"
    )
    return Table("imu.positions", "Residuals by position", caption, head, rows)


def _matrix(kind: str, by_name: Mapping[str, Coefficient]) -> Array:
    """Return readings over inputs (3, 3), SI or counts."""
    matrix = np.eye(3)
    for i, a in enumerate(AXES):
        scale, counts = by_name.get(f"S{kind}_{a}{a}"), by_name.get(f"k{kind}_{a}")
        for j, b in enumerate(AXES):
            if (c := by_name.get(f"S{kind}_{a}{b}")) is not None and i != j:
                matrix[i, j] = c.estimate * SCALES[c.unit]
        if counts is not None:
            matrix[i] *= counts.estimate
        elif scale is not None:
            matrix[i, i] += scale.estimate * SCALES[scale.unit]
    return matrix


def _angles(kind: str, words: str, matrix: Array, by_name: Mapping[str, Coefficient]) -> list[list[Any]]:
    rows = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        names = f"S{kind}_{AXES[i]}{AXES[j]}", f"S{kind}_{AXES[j]}{AXES[i]}"
        there = [by_name[n] for n in names if n in by_name]
        if len(there) < (2 if kind == "g" else 1):
            continue
        a, b = matrix[i], matrix[j]
        # the angle in the direction of a misalignment: towards the other axis it is smaller than 90°
        angle = math.acos(float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))) - math.pi / 2.0
        u = math.hypot(*((c.u_a or 0.0) for c in there))
        rows.append([words, f"{AXES[i]}{AXES[j]}", angle / factor("arcsec"), u])
    return rows
