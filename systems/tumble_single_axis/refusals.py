"""What makes a tumble impossible: latitude, setup, plan and record.  [TUM1-SING; INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression

from .setup import TumbleSetup


def refusals(latitude: float) -> list[str]:
    """Why a tumble at ``latitude`` (rad) cannot give the nine coefficients, as sentences; empty when it can."""
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
    if design.rank < 9:
        return [f"{where}rank {design.rank} of 9, the record does not see {'; '.join(design.lost)}"]
    return [f"{where}condition {design.condition:.3g}, hardly seen is {design.weakest}"]


def setup_problems(s: TumbleSetup) -> list[str]:
    problems = refusals(s.latitude) + s.problems()
    if s.terms not in drift.TERM_SETS:
        problems.append(f"{s.terms}-term model unknown; there are {', '.join(map(str, drift.TERM_SETS))}")
    if s.terms == 10 and not s.fold:
        problems.append(
            "ten terms have rank 9 at constant |g|: the data do not see D_II + D_OO + D_SS − γ² D_F; reduce nine "
            "terms, or set fold to report the combinations"
        )
    return problems


def plan_problems(s: TumbleSetup, w: Mapping[str, Array]) -> list[str]:
    """Missing phases, mounts and dwells, tables that stand still, windows too wide."""
    problems = s.table_problems(w)
    if len(s.sides(1)) < 2:
        problems.append(
            "only one mount: two are needed, output axis along +pole and −pole (D_I, D_IO and D_S, D_OS mix)"
        )
    dwells = s.dwells()
    if len(set(dwells.values())) < 2:
        problems.append(
            f"{'only one dwell' if dwells else 'no dwells'} with the output axis vertical, up and down are needed: D_F "
            "cannot be told from D_II + D_SS"
        )
    return problems
