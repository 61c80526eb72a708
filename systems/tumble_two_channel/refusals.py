"""What makes a setup or a record of the two-channel tumble impossible.  [TUM2B-SING, INPUT-LIMITS]"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.setup.setups import scale_factor_problems

from . import geometry

if TYPE_CHECKING:
    from .setup import TwoChannelSetup


def setup_problems(s: TwoChannelSetup) -> list[str]:
    problems = geometry.refusals(s.latitude, s.model) + s.problems(s.model == "nine")
    return problems + [text for a, k in s.k.items() for text in scale_factor_problems(k, f"k_{a}")]


def plan_problems(s: TwoChannelSetup, w: Mapping[str, Array]) -> list[str]:
    """Missing phases, mounts and dwells, tables that stand still, windows too wide, one sense only."""
    problems = s.table_problems(w)
    if len(s.sides(2)) < 2:
        problems.append("only one mount: two are needed, spin axis along +pole and −pole (constants and z terms mix)")
    dwells = s.dwells()
    if s.model == "nine" and len(set(dwells.values())) < 2:
        problems.append(
            f"{'only one dwell' if dwells else 'no dwells'} with the y axis vertical, up and down are needed: the "
            "constants cannot be told from the squares"
        )
    turned = np.asarray(w["angle_end"], dtype=float) - np.asarray(w["angle_start"], dtype=float)
    turning = np.isin(np.asarray(w["phase"]).astype(int), [p for p in s.faces if s.turns(p)])
    if s.tilt and len(set(np.sign(turned[turning]).tolist())) < 2:
        problems.append("tilt: turns in both senses are needed to tell the tilt from the z terms")
    return problems
