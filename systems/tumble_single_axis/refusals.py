"""Latitudes at which a tumble is impossible.  [TUM1-SING; INPUT-LIMITS]"""

from __future__ import annotations

import math

import numpy as np

from gyrobench import drift, frames
from gyrobench.reduction.estimation import regression


def refusals(latitude: float) -> list[str]:
    """Return why a tumble at ``latitude`` (rad) cannot give the nine coefficients, as sentences; empty when it can."""
    if problems := frames.latitude_problems(latitude):
        return problems
    size = abs(math.degrees(latitude))
    if 5.0 <= size <= 85.0:
        return []
    faces, base = frames.tumble_faces(latitude), frames.polar_base(latitude)
    angles = np.radians(np.arange(0.0, 360.0, 10.0))
    rows = [frames.to_face(-frames.U, faces[m], base, a) for m in ("mount 1", "mount 2") for a in angles]
    rows += [frames.to_face(-frames.U, faces[s], base, 0.0) for s in ("static 3", "static 4")]
    design = regression.examine(drift.regressors(np.array(rows), drift.terms(9)), drift.terms(9))
    where = f"latitude {math.degrees(latitude):.4g}° (5° to 85° north or south is possible): "
    return [f"{where}{design.weakness}"]
