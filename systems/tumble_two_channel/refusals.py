"""What makes a setup or a record of the two-channel tumble impossible.  [TUM2B-SING, INPUT-LIMITS]"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames, units

from . import geometry

if TYPE_CHECKING:
    from .setup import TwoChannelSetup

Array = NDArray[np.float64]
DPH = units.factor("deg/h")


def setup_problems(s: TwoChannelSetup) -> list[str]:
    found = geometry.refusals(s.latitude, s.model)
    if not 9.7 <= s.gravity <= 9.9:
        found.append(f"gravity {s.gravity:.6g} m/s² lies outside 9.7..9.9 m/s²")
    for name, k in s.k.items():
        if not (math.isfinite(k) and k > 0.0):
            found.append(
                f"scale factor k_{name} = {k:g} rad/s/A: a finite positive number is expected; the sign is 'polarity'"
            )
    if s.polarity not in ("project", "book"):
        found.append(
            f"polarity '{s.polarity}' unknown; there are 'project' (k i = ω_IA − ω_d) and 'book' (k i = ω_d − ω_IA)"
        )
    for name, matrix in [("table base", s.base), *((f"mount of {s.label(p)}", f) for p, f in s.faces.items())]:
        try:
            frames.check_rotation(matrix, name)
        except ValueError as error:
            found.append(str(error))
    for square, into in geometry.FOLD.values():
        value = (s.truth or {}).get(square, 0.0)
        if value != 0.0 and s.model == "nine" and not s.fold:
            found.append(
                f"{square} = {value / DPH:g} °/h/g² is simulated, but at constant |g| it cannot be told from "
                f"{', '.join(into)}; set fold to accept the combinations"
            )
    return found


def plan_problems(s: TwoChannelSetup, w: Mapping[str, Array]) -> list[str]:
    """Missing phases, mounts and dwells, tables that stand still, windows too wide, one sense only."""
    phase = np.asarray(w["phase"]).astype(int)
    there = set(phase.tolist())
    found = [f"phase {p} ({s.label(p)}) is missing in the record" for p in s.faces if p not in there]
    found += [f"phase {p} is in the record, but its mount is not given" for p in sorted(there - set(s.faces))]
    rate = [p for p in s.faces if s.turns(p)]
    dwell = [p for p in s.faces if p not in rate]
    if len({np.sign(np.asarray(s.faces[p])[2, 2]) for p in rate}) < 2:
        found.append("only one mount: two are needed, spin axis along +pole and −pole (constants and z terms mix)")
    up = np.asarray(s.base) @ frames.U
    if s.model == "nine" and len({np.sign(np.asarray(s.faces[p])[1] @ up) for p in dwell}) < 2:
        what = "no dwells" if not dwell else "only one dwell"
        found.append(
            f"{what} with the y axis vertical, up and down are needed: the constants cannot be told from the squares"
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
    senses = set(np.sign(width[np.isin(phase, rate)]).tolist())
    if s.tilt and len(senses) < 2:
        found.append("tilt: turns in both senses are needed to tell the tilt from the z terms")
    return found
