"""What makes a tumble impossible: latitude, setup, plan and record.  [TUM1-SING; INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames, units
from gyrobench.reduction.estimation import regression

from .setup import TumbleSetup

Array = NDArray[np.float64]
DPH = units.factor("deg/h")


def refusals(latitude: float) -> list[str]:
    """Why a tumble at ``latitude`` (rad) cannot give the nine coefficients, as sentences; empty when it can."""
    if not math.isfinite(latitude) or abs(latitude) > math.pi / 2:
        return [f"latitude {math.degrees(latitude):.6g}° lies outside −90..90°"]
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
    found = refusals(s.latitude)
    if s.terms not in drift.TERM_SETS:
        found.append(f"{s.terms}-term model unknown; there are {', '.join(map(str, drift.TERM_SETS))}")
    if not 9.7 <= s.gravity <= 9.9:
        found.append(f"gravity {s.gravity:.6g} m/s² lies outside 9.7..9.9 m/s²")
    if not (math.isfinite(s.k) and s.k > 0.0):
        found.append(f"scale factor k = {s.k:g} rad/s/A: a finite positive number is expected; the sign is 'polarity'")
    if s.polarity not in ("project", "book"):
        found.append(
            f"polarity '{s.polarity}' unknown; there are 'project' (k i = ω_IA − ω_d) and 'book' (k i = ω_d − ω_IA)"
        )
    for name, matrix in [("table base", s.base), *((f"mount of {s.label(p)}", f) for p, f in s.faces.items())]:
        try:
            frames.check_rotation(matrix, name)
        except ValueError as error:
            found.append(str(error))
    if s.truth and s.truth.get("D_OO", 0.0) != 0.0 and not s.fold:
        found.append(
            f"D_OO = {s.truth['D_OO'] / DPH:g} °/h/g² is simulated, but at constant |g| it cannot be told from D_F, "
            "D_II and D_SS; set fold to accept the combinations D_F + γ² D_OO, D_II − D_OO, D_SS − D_OO"
        )
    if s.terms == 10 and not s.fold:
        found.append(
            "ten terms have rank 9 at constant |g|: the data do not see D_II + D_OO + D_SS − γ² D_F; reduce nine "
            "terms, or set fold to report the combinations"
        )
    return found


def plan_problems(s: TumbleSetup, w: Mapping[str, Array]) -> list[str]:
    """Missing phases, mounts and dwells, tables that stand still, windows too wide."""
    phase = np.asarray(w["phase"]).astype(int)
    there = set(phase.tolist())
    found = [f"phase {p} ({s.label(p)}) is missing in the record" for p in s.faces if p not in there]
    found += [f"phase {p} is in the record, but its mount is not given" for p in sorted(there - set(s.faces))]
    rate = [p for p in s.faces if s.turns(p)]
    dwell = [p for p in s.faces if p not in rate]
    side = {np.sign(np.asarray(s.faces[p])[1, 2]) for p in rate}
    if len(side) < 2:
        found.append("only one mount: two are needed, output axis along +pole and −pole (D_I, D_IO and D_S, D_OS mix)")
    up = {np.sign(np.asarray(s.faces[p])[1] @ (np.asarray(s.base) @ frames.U)) for p in dwell}
    if len(up) < 2:
        what = "no dwells" if not dwell else "only one dwell"
        found.append(
            f"{what} with the output axis vertical, up and down are needed: D_F cannot be told from D_II + D_SS"
        )
    width = np.asarray(w["angle_end"], dtype=float) - np.asarray(w["angle_start"], dtype=float)
    for p in rate:
        mine = np.abs(width[phase == p])
        if mine.size == 0:
            continue
        if np.max(mine) < 1e-3:
            found.append(f"phase {p} ({s.label(p)}): the table angle does not move, expected a turning table (rate 0?)")
        elif np.max(mine) > 2.0 * math.pi / 5.0 * 1.001:
            per = 2.0 * math.pi / float(np.max(mine))
            found.append(f"phase {p} ({s.label(p)}): {per:.2g} windows a turn, at least 5 are needed for two harmonics")
    for p in dwell:
        mine = np.abs(width[phase == p])
        if mine.size and np.max(mine) > 1e-2:
            found.append(f"phase {p} ({s.label(p)}): the table turns by {math.degrees(np.max(mine)):.3g}° in a dwell")
    return found
